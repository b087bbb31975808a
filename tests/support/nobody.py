"""Python as user nobody, where root runs the tests: wherever the interpreter and the modules lie."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

NOBODY = 65534

needs_root = pytest.mark.skipif(os.geteuid() != 0, reason="needs root to become somebody else")

# What is imported late may lie below a home that nobody may enter: every import is made as root.
_BECOME_NOBODY = f"""
import builtins, os
def _become_nobody(imported=builtins.__import__):
    def as_root(*args, **kwargs):
        before = os.geteuid()
        os.seteuid(0)
        try:
            return imported(*args, **kwargs)
        finally:
            os.seteuid(before)
    builtins.__import__ = as_root
    os.setgroups([])
    os.setresgid({NOBODY}, {NOBODY}, {NOBODY})
    os.setresuid({NOBODY}, {NOBODY}, 0)
"""


def python_as_nobody(prepare: str, code: str, *arguments: str | Path) -> subprocess.CompletedProcess[str]:
    """How Python ended that ran `prepare` as root, then `code` as nobody; `sys.argv[1:]` are the arguments."""
    lines = f"{_BECOME_NOBODY}\nimport sys\n{prepare}\n_become_nobody()\n{code}"
    command = [sys.executable, "-c", lines, *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@contextmanager
def open_folder() -> Iterator[Path]:
    """A folder where everybody may read what is made: pytest's own are closed to others, TMPDIR and umask may be."""
    mask = os.umask(0o022)
    folder = Path(tempfile.mkdtemp(prefix="combtrace-", dir="/tmp"))
    folder.chmod(0o755)
    try:
        yield folder
    finally:
        os.umask(mask)
        shutil.rmtree(folder)
