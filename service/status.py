"""The service in one line, for the serial `STAT`."""

from __future__ import annotations

from service.health import Health

LONGEST = 200


def status_line(health: Health, settled: int, missed: int) -> str:
    """`STATE <name> JOB <n> SETTLED <n> MISSED <n> REASON <text>`, ASCII, one line; JOB 0 = none is being executed."""
    fault = health.first()
    line = f"STATE {health.state.label} JOB {health.job or 0} SETTLED {settled} MISSED {missed}"
    if fault is not None:
        line += f" REASON {int(fault.reason)} {fault.reason.label}: {fault.text}"
    return " ".join(line.encode("ascii", "replace").decode("ascii").split())[:LONGEST]
