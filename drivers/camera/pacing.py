"""Waiting for the time after which a frame must be exposed, for cameras that expose when they are asked."""

from __future__ import annotations

from collections.abc import Callable

from drivers.camera import CameraTimeout


def wait_until(
    exposed_after_s: float,
    timeout_s: float,
    *,
    now: Callable[[], float],
    sleep: Callable[[float], None],
    source: str,
) -> float:
    """The time, at or after `exposed_after_s`; raise CameraTimeout after `timeout_s` where that comes first."""
    ahead_s = exposed_after_s - now()
    if ahead_s > timeout_s:
        sleep(max(0.0, timeout_s))
        raise CameraTimeout(
            f"{source}: a frame was asked for {ahead_s:.3f} s ahead; expected at most the time-out, {timeout_s} s. "
            "Raise the time-out."
        )
    # A sleep may end early by the clock's grain; the promise is "not before".
    while (reached_s := now()) < exposed_after_s:
        sleep(exposed_after_s - reached_s)
    return reached_s
