"""Another installed version of combtrace, asked what it makes of archived jobs: a process of its own interpreter."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any, Final, Self

from service.config.recipes import Recipe
from service.records.replay import Settings
from service.replays import other_version
from service.replays.errors import ReplayError
from service.replays.rows import Side, Versions

END_S: Final = 10.0  # the job that it is at, at most


class OtherVersionError(Exception):
    """The other version could not do a job, or has ended."""


class OtherVersion:
    """Asked for one job at a time. A wheel is measured with the libraries that are installed here, an environment with
    its own.
    """

    def __init__(self, given: Path) -> None:
        """given: a wheel, or the folder of a virtual environment; raise ReplayError where neither can be started."""
        self._said = TemporaryFile()  # noqa: SIM115 - closed with the process
        try:
            self._process = subprocess.Popen(
                _command(given), stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._said, text=True
            )
        except (OSError, ReplayError) as error:
            self._said.close()
            raise ReplayError(f"--against {given}: {error}") from error
        assert self._process.stdout is not None
        first = self._process.stdout.readline()
        try:
            self.versions = Versions(**json.loads(first))
        except (ValueError, TypeError) as error:
            self._process.kill()
            why = self._last_said()
            self.close()
            raise ReplayError(f"--against {given}: no combtrace that could be started there: {why}") from error

    @property
    def alive(self) -> bool:
        """False where it has ended by itself."""
        return self._process.poll() is None

    def measured(self, archive: Path, job_id: int, settings: Settings) -> Side:
        """What it makes of the job; raise OtherVersionError."""
        asked = {
            "archive": str(archive),
            "job_id": job_id,
            "recipe": settings.recipe,
            "limits": settings.limits,
            "calibration": None if settings.calibration is None else str(settings.calibration),
            "defaults": _defaults(),
        }
        answer = self._answer(asked)
        if "error" in answer:
            raise OtherVersionError(f"combtrace {self.versions.combtrace} of the other side: {answer['error']}")
        return Side(tuple(answer["codes"]), answer["kept"], self.versions)

    def _answer(self, asked: dict[str, Any]) -> dict[str, Any]:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        try:
            self._process.stdin.write(json.dumps(asked) + "\n")
            self._process.stdin.flush()
            return dict(json.loads(self._process.stdout.readline()))
        except (OSError, ValueError) as error:
            self._process.kill()
            self._process.wait()
            raise OtherVersionError(f"the other version has ended: {self._last_said()}") from error

    def _last_said(self) -> str:
        self._said.seek(0)
        lines = self._said.read().decode(errors="replace").strip().splitlines()
        return lines[-1] if lines else "it said nothing"

    def close(self) -> None:
        """Have it end: it does so by itself, once nobody asks any more."""
        try:
            self._process.communicate(timeout=END_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.communicate()
        self._said.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _command(given: Path) -> list[str]:
    """What starts it; raise ReplayError."""
    script = other_version.__file__
    if given.suffix == ".whl":
        if not given.is_file():
            raise ReplayError("there is no such wheel")
        return [sys.executable, "-I", script, str(given)]
    python = given / "bin" / "python"
    if not python.exists():
        raise ReplayError("expected a wheel (.whl) or the folder of a virtual environment with bin/python")
    return [str(python), "-I", script]


def _defaults() -> dict[str, Any]:
    """A recipe's keys and what they are where nobody says: a version that does not know one needs not be told that."""
    return Recipe(number=1, name="-").model_dump(mode="json")
