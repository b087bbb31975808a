"""What a controller keeps over a restart: session counter, last answer, and the contour nobody has acted on yet."""

from __future__ import annotations

import json
import os
import secrets
from pathlib import Path

from drivers.controller.errors import ControllerError
from drivers.controller.simulated.contour import AcceptedContour


class RetainedMemory:
    """Session counter (begun at random), `last_job`, `last_result`, and an accepted contour until it was handed on.

    path: a JSON file, replaced as a whole at each step, so that a killed program leaves the step before or after (a
    power cut may leave less: nothing is forced to disk). None: kept as long as this object lives.
    """

    def __init__(self, path: Path | None = None) -> None:
        self.session = secrets.randbelow(0xFFFF)
        self.last_job = 0
        self.last_result = 0
        self.undelivered: AcceptedContour | None = None
        self._path = path
        if path is not None and path.exists():
            self._load(path)

    def count_session(self) -> int:
        """A session value other than 0 and all before it."""
        self.session = self.session % 0xFFFF + 1
        self._store()
        return self.session

    def keep_answer(self, job_id: int, result: int, contour: AcceptedContour | None) -> None:
        """Keep a final answer, and with an acceptance the contour, in one step."""
        self.last_job, self.last_result, self.undelivered = job_id, result, contour
        self._store()

    def delivered(self) -> None:
        """The contour was handed on: it is not handed on again at the next start."""
        self.undelivered = None
        self._store()

    def forget(self) -> None:
        """Lose everything, as a controller without a battery does."""
        self.session = secrets.randbelow(0xFFFF)
        self.last_job = self.last_result = 0
        self.undelivered = None
        self._store()

    def _store(self) -> None:
        if self._path is None:
            return
        content = {
            "session": self.session,
            "last_job": self.last_job,
            "last_result": self.last_result,
            "undelivered": None if self.undelivered is None else self.undelivered.as_json(),
        }
        beside = self._path.with_name(self._path.name + ".new")
        try:
            beside.write_text(json.dumps(content), encoding="utf-8")
            os.replace(beside, self._path)
        except OSError as error:
            raise ControllerError(
                f"memory {self._path}: cannot be written: {error.strerror}. Name another file"
            ) from error

    def _load(self, path: Path) -> None:
        try:
            content = json.loads(path.read_text(encoding="utf-8"))
            undelivered = content["undelivered"]
            self.session, self.last_job, self.last_result = (
                int(content[name]) for name in ("session", "last_job", "last_result")
            )
            self.undelivered = None if undelivered is None else AcceptedContour.from_json(undelivered)
        except OSError as error:
            raise ControllerError(f"memory {path}: cannot be read: {error.strerror}. Name another file") from error
        except (ValueError, TypeError, KeyError) as error:
            raise ControllerError(
                f"{path} is no memory of a simulated controller ({error!r}). Delete it to start with lost memory"
            ) from error
