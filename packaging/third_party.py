"""Print a package's copyright file, add to its SBOM what wheels bring compiled in; 1 where a licence is not allowed.

    third_party.py SITE_PACKAGES SBOM > copyright

Allowed is what may be sold in a closed machine if its text goes along; of libraries under the LGPL, that anybody may
put another in their place: they are files of their own below /opt/combtrace.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterator
from importlib.metadata import Distribution, distributions
from pathlib import Path

ALLOWED = {"0BSD", "Apache-2.0", "BSD", "BSD-2-Clause", "BSD-3-Clause", "CC0-1.0", "MIT", "MPL-2.0", "PSF-2.0", "Zlib"}
"""Every licence of an expression must be one."""
OTHER_NAMES = {"Apache 2.0": "Apache-2.0", "BSD License": "BSD", "MIT License": "MIT"}  # without an SPDX expression
BUNDLED = {
    "aom": "BSD-2-Clause",
    "avcodec": "LGPL-2.1-or-later",
    "avformat": "LGPL-2.1-or-later",
    "avif": "BSD-2-Clause",
    "avutil": "LGPL-2.1-or-later",
    "crypto": "OpenSSL",
    "drm": "MIT",
    "geos": "LGPL-2.1-or-later",
    "geos_c": "LGPL-2.1-or-later",
    "gfortran": "GPL-3.0-or-later WITH GCC-exception-3.1",
    "openblasp": "BSD-3-Clause",
    "png16": "libpng-2.0",
    "quadmath": "LGPL-2.1-or-later",
    "scipy_openblas64_": "BSD-3-Clause",
    "ssl": "OpenSSL",
    "swresample": "LGPL-2.1-or-later",
    "swscale": "LGPL-2.1-or-later",
    "vpx": "BSD-3-Clause",
}
"""Libraries that wheels bring as files of their own, by the name without lib, with their licences."""
LIBRARY = re.compile(r"lib(?P<name>\w+?)(?:-r0)?-[0-9a-f-]+\.(?:so\.?)?(?P<version>[\w.]*?)(?:\.so)?")


class NotAllowed(Exception):
    """Something is shipped that nobody allowed: what, and where to say so."""


def main() -> int:
    """Print, write, and say what is wrong on standard error."""
    packages, sbom = Path(sys.argv[1]), Path(sys.argv[2])
    found = sorted(distributions(path=[str(packages)]), key=lambda one: one.name.lower())
    document = json.loads(sbom.read_text(encoding="utf-8"))
    try:
        lines = [f"{one.name} {one.version}: {licence_of(one)}" for one in found]
        for component in document["components"]:
            if inside := list(libraries(packages, component["name"])):
                component["components"] = inside
                lines += [f"{one['name']} {one['version']}, in {component['name']}: {licence(one)}" for one in inside]
    except NotAllowed as error:
        print(f"third_party: {error}", file=sys.stderr)
        return 1
    sbom.write_text(json.dumps(document, indent=1, sort_keys=True) + "\n", encoding="utf-8")
    print("combtrace is under the MIT licence. What is shipped with it, each under its own:\n", *lines, sep="\n")
    for one in found:
        for name, text in texts(one):
            print(f"\n{'-' * 78}\n{one.name} {one.version}: {name}\n{'-' * 78}\n{text.strip()}")
    return 0


def licence_of(package: Distribution) -> str:
    """Its licence as SPDX expression, or as it calls it; raise NotAllowed."""
    said = package.metadata
    named = said.get("License-Expression") or said.get("License") or ""
    if not named or "\n" in named:
        named = " ".join(text.rpartition(" :: ")[2] for text in said.get_all("Classifier", []) if "License ::" in text)
    named = OTHER_NAMES.get(named, named)
    if not named or set(re.split(r" AND | OR |[()]", named)) - ALLOWED - {""}:
        raise NotAllowed(f"{package.name} {package.version} is under {named!r}, allowed is what ALLOWED has here")
    return named


def libraries(packages: Path, name: str) -> Iterator[dict[str, object]]:
    """Components for the library files of a package; raise NotAllowed."""
    for file in sorted((packages / f"{name.replace('-', '_')}.libs").glob("*")):
        match = LIBRARY.fullmatch(file.name)
        if match is None or match["name"] not in BUNDLED:
            raise NotAllowed(f"{file.name}, in {name}: nobody noted its licence. Add it to BUNDLED here")
        yield {
            "type": "library",
            "name": f"lib{match['name']}",
            "version": match["version"] or "unknown",
            "licenses": [{"expression": BUNDLED[match["name"]]}],
        }


def licence(component: dict[str, object]) -> str:
    """What `libraries` noted."""
    return BUNDLED[str(component["name"]).removeprefix("lib")]


def texts(package: Distribution) -> Iterator[tuple[str, str]]:
    """The texts that a package brings, by their names."""
    for file in package.files or ():
        if ".dist-info/" in str(file) and re.search(r"licen[cs]e|copying|notice", file.name, re.IGNORECASE):
            yield file.name, Path(str(file.locate())).read_text(encoding="utf-8", errors="replace")


if __name__ == "__main__":
    sys.exit(main())
