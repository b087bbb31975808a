"""Real parts that a test needs and a machine may lack: there it skips and says how to get them; in CI it fails."""

from __future__ import annotations

import importlib
import os
import shutil
from types import ModuleType
from typing import NoReturn

import pytest

CLUSTER = "pip install 'combtrace[cluster]'"


def missing(reason: str) -> NoReturn:
    """Skip the test, or file, for `reason`, or fail it where CI=true: there nothing may be left out in silence."""
    if os.environ.get("CI", "").lower() == "true":
        pytest.fail(reason, pytrace=False)
    pytest.skip(reason, allow_module_level=True)


def need_module(name: str, install: str) -> ModuleType:
    """The module `name`; without it the test skips with the command that installs it."""
    try:
        return importlib.import_module(name)
    except ImportError as error:
        missing(f"{error.name} is not here. Install it: {install}")


def need_program(name: str, install: str) -> str:
    """The path of program `name`; without it the test skips with the command that installs it."""
    path = shutil.which(name) or shutil.which(name, path="/usr/sbin:/sbin")  # where an ordinary user does not look
    if path is None:
        missing(f"{name} is not here. Install it: {install}")
    return path
