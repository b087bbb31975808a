"""Aravis by its GObject introspection, found in the system's Python where the running one does not have it."""

from __future__ import annotations

import functools
import importlib
import importlib.util
import sys
import sysconfig
import warnings
from pathlib import Path
from types import ModuleType
from typing import Any

from drivers.camera import CameraRefused

INSTALL = "apt install gir1.2-aravis-0.8 python3-gi"
# Where Debian and Ubuntu keep the modules of their Python. A virtual environment does not look there.
SYSTEM_PACKAGES = Path("/usr/lib/python3/dist-packages")


@functools.cache
def aravis() -> Any:
    """The module of Aravis 0.8; raise CameraRefused, with what to install."""
    gi = _gi(SYSTEM_PACKAGES)
    try:
        gi.require_version("Aravis", "0.8")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ImportWarning)  # its importer is of an old kind, and works
            return importlib.import_module("gi.repository.Aravis")
    except (ValueError, ImportError) as error:
        raise CameraRefused(f"camera kind genicam: no Aravis ({error}); as root, run `{INSTALL}`.") from error


def error_type() -> type[Exception]:
    """The exception in which Aravis tells its errors."""
    aravis()
    found: type[Exception] = sys.modules["gi.repository.GLib"].Error
    return found


def _gi(packages: Path) -> ModuleType:
    """Python's binding of GObject: this environment's, else the system's, of which only `gi` is taken.

    With the system's whole folder on the path, its numpy and others would stand in for those that were tested.
    """
    try:
        return importlib.import_module("gi")
    except ImportError:
        pass
    folder = packages / "gi"
    if not (folder / "__init__.py").is_file():
        raise CameraRefused(f"camera kind genicam: Aravis is missing; as root, run `{INSTALL}`.")
    if not (folder / f"_gi{sysconfig.get_config_var('EXT_SUFFIX')}").is_file():
        here = f"{sys.version_info.major}.{sys.version_info.minor}"
        built = ", ".join(sorted(path.name.split(".")[1] for path in folder.glob("_gi.*.so"))) or "none"
        raise CameraRefused(
            f"camera kind genicam: this is Python {here}, and the system's python3-gi is built for {built}; expected "
            "one Python. Make the virtual environment with /usr/bin/python3, or add PyGObject to this one."
        )
    spec = importlib.util.spec_from_file_location(
        "gi", folder / "__init__.py", submodule_search_locations=[str(folder)]
    )
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["gi"] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules["gi"]
        raise
    return module
