"""A daemon's status as lines for people."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from service.cli.colour import Colour, painted

WELL = ("Ready", "SingleExecution", "ContinuousExecution")


def page(status: dict[str, Any]) -> str:
    """All of it for people, in colour on a terminal."""
    return "\n".join(_painted(name, f"{name:<9} {text}", status) for name, text in lines(status))


def _painted(name: str, line: str, status: dict[str, Any]) -> str:
    if name == "state":
        colour = (
            Colour.GOOD if status["state"] in WELL else Colour.BAD if status["state"] == "Error" else Colour.DOUBTFUL
        )
        return painted(line, colour)
    colours = {"fault": Colour.BAD, "warning": Colour.DOUBTFUL}
    return painted(line, colours[name]) if name in colours else line


def lines(status: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """Names and texts of the page."""
    reason = f": {status['reason']}" if status["reason"] else ""
    yield "state", f"{status['state']}, for {_duration(status['since_s'])}{reason}"
    yield "process", f"{status['process']}, combtrace {status['version']}, up {_duration(status['uptime_s'])}"
    job = "none" if status["job"] is None else f"{status['job']} is being executed"
    yield "job", job + (f", {status['waiting']} wait" if status["waiting"] else "")
    last = status["last_job"]
    if last is not None:
        why = f": {last['code']} {last['name']}: {last['detail']}" if last["code"] else ""
        yield "last job", f"{last['job']} {last['outcome']} at {last['settled_at']}{why}"
    counts = ", ".join(f"{entry['kind']} {entry['what']} {entry['count']}" for entry in status["triggers"])
    yield "triggers", f"{status['missed_triggers']} missed" + (f"; {counts}" if counts else "")
    for part, fault in status["faults"].items():
        yield "fault", f"{part}: {fault['code']} {fault['name']}: {fault['text']}"
    for part, text in status["warnings"].items():
        yield "warning", f"{part}: {text}"
    for part in status["parts"]:
        if part["restarts"]:
            error = f", last after {part['last_error']} at {part['failed_at']}" if part["last_error"] else ""
            yield "part", f"{part['name']} was started again {part['restarts']} times{error}"


def _duration(seconds: float) -> str:
    """As people say it: the two largest units."""
    units = ((86_400, "d"), (3600, "h"), (60, "min"), (1, "s"))
    left, words = int(seconds), list[str]()
    for size, name in units:
        count, left = divmod(left, size)
        if count or (name == "s" and not words):
            words.append(f"{count} {name}")
    return " ".join(words[:2])
