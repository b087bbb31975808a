"""What is packed: which versions and hashes, under which licences, by which files."""

from __future__ import annotations

import re
import subprocess
import sys
from importlib.metadata import Distribution, distribution
from pathlib import Path

import pytest
import yaml

from tests.support.processes.processes import ROOT, called

PACKAGING = ROOT / "packaging"
PINNED = re.compile(r"^([\w.-]+)==(\S+)", re.MULTILINE)


def pinned(file: Path) -> dict[str, str]:
    """Versions by normalised name."""
    return {re.sub(r"[-_.]+", "-", name).lower(): version for name, version in PINNED.findall(file.read_text())}


def needed(package: Distribution, extras: tuple[str, ...]) -> set[str]:
    """Names of all that it needs with these extras, itself left out."""
    from packaging.requirements import Requirement  # a dependency of pytest

    found: set[str] = set()
    for text in package.requires or ():
        requirement = Requirement(text)
        if requirement.marker is None or any(requirement.marker.evaluate({"extra": extra}) for extra in ("", *extras)):
            name = re.sub(r"[-_.]+", "-", requirement.name).lower()
            if name not in found:
                found |= {name} | needed(distribution(requirement.name), tuple(requirement.extras))
    return found


def test_what_is_packed_is_what_was_tested_each_file_by_its_hash() -> None:
    packed = pinned(PACKAGING / "requirements.txt")
    tested = pinned(ROOT / "constraints.txt")
    assert packed == {name: tested[name] for name in packed}
    assert set(packed) == needed(distribution("combtrace"), ("metrics", "page", "export", "hil"))
    text = (PACKAGING / "requirements.txt").read_text()
    for block in re.split(r"^(?=\S)", text, flags=re.MULTILINE)[1:]:
        assert re.search(r"--hash=sha256:[0-9a-f]{64}", block), block.splitlines()[0]


def test_the_packaged_configuration_is_sound(tmp_path: Path) -> None:
    """With the samples where they lie here, and the state in a folder of ours."""
    text = (PACKAGING / "debian" / "config.yaml").read_text(encoding="utf-8")
    installed = "/opt/combtrace/lib/python3.11/site-packages/service/samples"
    assert text.count(installed) == 2
    text = text.replace(installed, str(ROOT / "service" / "samples")).replace("/var/lib/combtrace", str(tmp_path))
    (tmp_path / "config.yaml").write_text(text)
    checked = called("check", "--config", tmp_path / "config.yaml")
    assert checked.returncode == 0, checked.stdout + checked.stderr
    assert yaml.safe_load(text)["triggers"] == []


@pytest.fixture
def packages(tmp_path: Path) -> Path:
    """A folder as pip leaves one: a package, and a library that its wheel carries."""
    info = tmp_path / "thing-1.2.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.4\nName: thing\nVersion: 1.2\nLicense-Expression: MIT\n")
    (info / "LICENSE").write_text("Copyright A. N. Other\n")
    (info / "RECORD").write_text("thing-1.2.dist-info/LICENSE,,\n")
    (tmp_path / "thing.libs").mkdir()
    (tmp_path / "thing.libs" / "libgeos-d1e818bb.so.3.14.1").touch()
    (tmp_path / "sbom.json").write_text('{"components": [{"name": "thing", "version": "1.2"}]}')
    return tmp_path


def third_party(packages: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, PACKAGING / "third_party.py", packages, packages / "sbom.json"]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_licences_are_told_with_their_texts_and_libraries_within_wheels_are_named(packages: Path) -> None:
    done = third_party(packages)
    assert done.returncode == 0, done.stderr
    assert "thing 1.2: MIT\nlibgeos 3.14.1, in thing: LGPL-2.1-or-later\n" in done.stdout
    assert "Copyright A. N. Other" in done.stdout
    assert '"version": "3.14.1"' in (packages / "sbom.json").read_text()


@pytest.mark.parametrize(
    ("file", "content", "told"),
    [
        (
            "thing-1.2.dist-info/METADATA",
            "Name: thing\nVersion: 1.2\nLicense-Expression: MIT AND GPL-3.0-only\n",
            "GPL-3",
        ),
        ("thing-1.2.dist-info/METADATA", "Name: thing\nVersion: 1.2\n", "thing 1.2 is under ''"),
        ("thing.libs/libnew-d1e818bb.so.1", "", "libnew-d1e818bb.so.1, in thing: nobody noted its licence"),
    ],
)
def test_what_nobody_allowed_ends_the_build(packages: Path, file: str, content: str, told: str) -> None:
    (packages / file).write_text(content)
    done = third_party(packages)
    assert (done.returncode, told in done.stderr) == (1, True), done.stderr
