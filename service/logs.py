"""The log on standard error: one line a record, as text or JSON, readable in journald, repeats held back and counted.

Each end of a job and each change of state is one record with fields (`event`); such records are never held back. Under
journald a line carries its priority and no time of its own, which journald adds.
"""

from __future__ import annotations

import json
import logging
import os
import re
import sys
import time
from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Literal, TextIO

Format = Literal["text", "json"]
Level = Literal["debug", "info", "warning", "error"]

BURST, WINDOW_S = 5, 60.0  # so many alike within so long are written, the others counted
MOST_KINDS = 256
CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028\u2029]")
CREDENTIALS = re.compile(r"(://[^\s/:@]*):[^\s/@]*@")
SECRET_WORDS = re.compile(r"(?i)\b(password|passwd|secret|token|api[_-]?key)(\s*[=:]\s*)(\"[^\"]*\"|'[^']*'|[^\s,;]+)")
SECRET_NAMES = re.compile(r"(?i)password|passwd|secret|token|api_?key")
PRIORITIES = ((logging.CRITICAL, 2), (logging.ERROR, 3), (logging.WARNING, 4), (logging.INFO, 6), (0, 7))


def event(name: str, **fields: Any) -> dict[str, Any]:
    """`extra` of a structured record: its kind, and fields that JSON carries beside the sentence."""
    return {"event": name, "fields": fields}


def start_logging(level: int, form: Format = "text") -> None:
    """Log combtrace's own records from `level` up. pymodbus, which dumps frames at each lost reply, from errors up."""
    handler = LogHandler(sys.stderr)
    handler.setFormatter(LineFormatter(form, under_journald=journald_reads(sys.stderr)))
    logging.basicConfig(handlers=[handler], level=logging.WARNING)
    logging.getLogger("combtrace").setLevel(level)
    logging.getLogger("pymodbus").setLevel(logging.CRITICAL)
    logging.getLogger("asyncua").setLevel(logging.CRITICAL)  # what counts of it we say ourselves


def journald_reads(stream: TextIO, environment: Mapping[str, str] = os.environ) -> bool:
    """True where what is written to the stream goes to journald: systemd.exec(5), JOURNAL_STREAM."""
    try:
        found = os.fstat(stream.fileno())
    except (OSError, ValueError):
        return False
    return environment.get("JOURNAL_STREAM") == f"{found.st_dev}:{found.st_ino}"


class LineFormatter(logging.Formatter):
    """A record as one line; a traceback, as text, has lines of its own."""

    def __init__(self, form: Format, *, under_journald: bool = False) -> None:
        when = "" if under_journald else "%(asctime)s %(levelname)s "
        super().__init__(f"{when}%(name)s: %(message)s")
        self._form = form
        self._under_journald = under_journald

    def format(self, record: logging.LogRecord) -> str:
        """The line, with its priority under journald."""
        line = self._json(record) if self._form == "json" else super().format(record)
        if not self._under_journald:
            return line
        priority = next(number for level, number in PRIORITIES if record.levelno >= level)
        return "\n".join(f"<{priority}>{part}" for part in line.splitlines())

    def formatMessage(self, record: logging.LogRecord) -> str:  # noqa: N802  logging's own name
        """The sentence on one line, without secrets."""
        record.message = printable(record.message)
        return super().formatMessage(record)

    def formatException(self, ei: Any) -> str:  # noqa: N802  logging's own name
        """The traceback, without secrets."""
        return without_secrets(super().formatException(ei))

    def _json(self, record: logging.LogRecord) -> str:
        values: dict[str, Any] = {
            "time": datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds"),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": without_secrets(record.getMessage()),
        }
        if hasattr(record, "event"):
            values["event"] = record.event
            values |= {key: _safe(key, value) for key, value in getattr(record, "fields", {}).items()}
        if record.exc_info:
            values["exception"] = self.formatException(record.exc_info)
        return json.dumps(values, ensure_ascii=False, default=str)


def _safe(name: str, value: Any) -> Any:
    if SECRET_NAMES.search(name):
        return "***"
    return without_secrets(value) if isinstance(value, str) else value


def without_secrets(text: str) -> str:
    """The text without passwords in addresses and after words such as `password=`."""
    return SECRET_WORDS.sub(r"\1\2***", CREDENTIALS.sub(r"\1:***@", text))


def printable(text: str) -> str:
    """The text on one line, without secrets: what a device sent must not look like a record of ours."""
    return CONTROL.sub(lambda found: found[0].encode("unicode_escape").decode(), without_secrets(text))


@dataclass
class _Kind:
    """Records alike: since when the window runs, how many came in it, and the last that was held back."""

    since_s: float
    count: int = 0
    held: int = 0
    last: logging.LogRecord | None = None


class LogHandler(logging.StreamHandler[TextIO]):
    """Writes records; of those alike, more than five a minute are counted, and the count is told when it is over."""

    def __init__(self, stream: TextIO, *, now: Callable[[], float] = time.monotonic) -> None:
        super().__init__(stream)
        self._now = now
        self._kinds: OrderedDict[tuple[str, int, str], _Kind] = OrderedDict()

    def emit(self, record: logging.LogRecord) -> None:
        """Write the record, or count it."""
        self._tell_held(self._now() - WINDOW_S)
        if hasattr(record, "event") or self._goes(record):
            super().emit(record)

    def close(self) -> None:
        """Tell what was held back, and end."""
        self.acquire()
        try:
            self._tell_held(float("inf"))
        finally:
            self.release()
        super().close()

    def _goes(self, record: logging.LogRecord) -> bool:
        # Numbers differ between records that are alike: counters, addresses, times.
        key = record.name, record.levelno, re.sub(r"\d+", "#", str(record.msg))
        kind = self._kinds.setdefault(key, _Kind(self._now()))
        kind.count += 1
        if kind.count > BURST:
            kind.held += 1
            kind.last = record
        if len(self._kinds) > MOST_KINDS:
            self._tell(self._kinds.popitem(last=False)[1])
        return kind.count <= BURST

    def _tell_held(self, begun_before_s: float) -> None:
        """End the windows that began before then."""
        while self._kinds:
            key, kind = next(iter(self._kinds.items()))
            if kind.since_s > begun_before_s:
                return
            del self._kinds[key]
            self._tell(kind)

    def _tell(self, kind: _Kind) -> None:
        last = kind.last
        if last is None:
            return
        text = f"held back {kind.held} records like this: {last.getMessage()}"
        told = logging.LogRecord(last.name, last.levelno, last.pathname, last.lineno, text, None, None)
        super().emit(told)
