"""The service in one line, for the serial `STAT`."""

from __future__ import annotations

from service.jobs.health import Health


def status_line(health: Health, settled: int, missed: int) -> str:
    """`STAT <state> <job> <settled job> <missed> <code> <name>`, 80 characters at most.

    job 0 = none is being executed; code and name are of the reason for not being ready, `0 ok` without one.
    """
    fault = health.first()
    reason = "0 ok" if fault is None else f"{int(fault.reason)} {fault.reason.label}"
    return f"STAT {health.state.label} {health.job or 0} {settled} {missed} {reason}"
