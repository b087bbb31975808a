"""What a person may ask of the running daemon: its status, to halt, to resume, to confirm, to start its parts anew."""

from __future__ import annotations

import importlib.metadata
import json
import logging
import os
import time
from collections.abc import Awaitable, Callable, Mapping
from contextlib import suppress
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TypeVar

from service.atomic_file import sync_folder, write_whole
from service.daemon.control import CommandRefused, Handler, reason_text
from service.daemon.supervisor import Supervisor
from service.jobs.executor import Executor
from service.jobs.health import Fault, Health
from service.jobs.trigger_queue import TriggerRefused
from service.reasons import Reason
from service.records.job import Job
from service.state import State

log = logging.getLogger("combtrace.control")

HALT_FILE = "halted.json"
LINK_PART = "link"
T = TypeVar("T")
CONTROL_PART = "control"  # of the supervisor's parts the one that serves these commands


class Halt:
    """A halt by a person, kept in the state folder: a restart, also one after a power cut, does not undo it."""

    def __init__(self, folder: Path) -> None:
        self._path = folder / HALT_FILE

    def reason(self) -> str | None:
        """Why it is halted, None where it is not. A file that cannot be read still halts."""
        try:
            text = self._path.read_text(encoding="utf-8")
        except FileNotFoundError:
            return None
        except OSError as error:
            return f"{self._path}: {error.strerror}"
        with suppress(ValueError, KeyError, TypeError):
            kept = json.loads(text)
            return f"{kept['reason']} ({kept['by']}, {kept['at']})"
        return f"{self._path} says nothing that can be read"

    def set(self, by: str, reason: str) -> None:
        """Keep it, durably; raise OSError."""
        kept = {"by": by, "reason": reason, "at": datetime.now(UTC).isoformat(timespec="seconds")}
        write_whole(self._path, json.dumps(kept).encode())

    def clear(self) -> None:
        """Forget it, durably; raise OSError."""
        self._path.unlink(missing_ok=True)
        sync_folder(self._path.parent)


class Operations:
    """The commands of the control socket. All run in the loop."""

    def __init__(
        self,
        health: Health,
        executor: Executor,
        supervisor: Supervisor,
        halt: Halt,
        before_reset: Callable[[], None],
        *,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        """before_reset: tells what is being opened anew."""
        self._health = health
        self._executor = executor
        self._supervisor = supervisor
        self._halt = halt
        self._before_reset = before_reset
        self._now = now
        self._begun_s = self._since_s = now()
        health.listen(self._changed)

    def commands(self) -> dict[str, Handler]:
        """By name."""
        return {
            "status": self.status,
            "halt": self.halt,
            "resume": self.resume,
            "confirm": self.confirm,
            "reset": self.reset,
        }

    def _changed(self, _state: State, _reason: str | None) -> None:
        self._since_s = self._now()

    async def status(self, _request: Mapping[str, Any], _who: str) -> dict[str, Any]:
        """All that is known of the service now."""
        health, executor = self._health, self._executor
        first = health.first()
        return {
            "version": importlib.metadata.version("combtrace"),
            "process": os.getpid(),
            "uptime_s": round(self._now() - self._begun_s, 1),
            "state": health.state.label,
            "service_state": int(health.state),
            "reason": health.reason,
            "code": 0 if first is None else int(first.reason),
            "since_s": round(self._now() - self._since_s, 1),
            "job": health.job,
            "waiting": executor.waiting,
            "settled_job": executor.settled_job,
            "last_job": _last_job(executor.last_settled),
            "missed_triggers": executor.missed,
            "triggers": [
                {"kind": kind, "what": what, "count": count} for (kind, what), count in sorted(executor.counts.items())
            ],
            "faults": {part: _fault(fault) for part, fault in health.faults().items()},
            "warnings": health.warnings,
            "parts": [asdict(part) for part in self._supervisor.kept()],
        }

    async def halt(self, request: Mapping[str, Any], who: str) -> dict[str, Any]:
        """Take no trigger until `resume`, over restarts too; the running job comes to its own end."""
        given = request.get("reason")
        reason = (reason_text(given) if isinstance(given, str) else "") or "by hand"
        self._health.halt(f"halted: {reason} ({who})")
        self._executor.refuse_all_queued(TriggerRefused(Reason.ABORTED, f"halted: {reason}"))
        log.warning("halted by %s: %s", who, reason)
        try:
            self._halt.set(who, reason)
        except OSError as error:
            raise CommandRefused(f"halted, but that would not outlive a restart: {error}") from error
        return {"state": self._health.state.label}

    async def resume(self, _request: Mapping[str, Any], who: str) -> dict[str, Any]:
        """End a halt."""
        if self._health.state is not State.HALTED:
            raise CommandRefused(f"the service is {self._health.state.label}, not Halted: there is nothing to resume")
        try:
            self._halt.clear()
        except OSError as error:
            raise CommandRefused(f"still halted: {error}") from error
        log.warning("resumed by %s", who)
        self._health.resume()
        self._executor.wake()
        return {"state": self._health.state.label}

    async def confirm(self, _request: Mapping[str, Any], who: str) -> dict[str, Any]:
        """A person's word for what the service must not decide alone: another service, a `last_job` that leaps."""
        said = self._executor.confirm()
        if not said:
            raise CommandRefused(f"the service is {self._health.state.label}: nothing waits for a person's word")
        for text in said:
            log.warning("confirmed by %s: %s", who, text)
        return {"state": self._health.state.label, "confirmed": said}

    async def alone_with_the_controller(self, work: Awaitable[T]) -> T:
        """What `work` gives while the service leaves its controller alone; only while it is halted."""
        if self._health.state is not State.HALTED or not self._executor.idle:
            raise CommandRefused(f"the service is {self._health.state.label}, not Halted and idle. Halt it first")
        return await self._supervisor.without(LINK_PART, work)

    async def reset(self, _request: Mapping[str, Any], who: str) -> dict[str, Any]:
        """Start all parts anew: connections, camera, ports. A halt stays."""
        if not self._executor.idle:
            raise CommandRefused(f"job {self._health.job} is being executed. Halt, wait for its end, then reset")
        log.warning("reset by %s", who)
        self._health.reset()
        self._before_reset()
        self._supervisor.restart(but=CONTROL_PART)
        return {"state": self._health.state.label}


def _fault(fault: Fault) -> dict[str, Any]:
    return {
        "code": int(fault.reason),
        "name": fault.reason.label,
        "text": fault.text,
        "starting": fault.starting,
    }


def _last_job(job: Job | None) -> dict[str, Any] | None:
    if job is None:
        return None
    return {
        "job": job.job_id,
        "outcome": None if job.outcome is None else str(job.outcome),
        "code": int(job.reason or 0),
        "name": job.reason.label if job.reason else None,
        "detail": job.detail,
        "settled_at": job.settled_at,
    }
