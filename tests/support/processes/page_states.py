"""Every state that the operator's page can tell, shown by the page itself from what a daemon would say of it."""

from __future__ import annotations

import copy
import json
from typing import Any

from playwright.sync_api import BrowserContext, Page

from service.reasons import Reason

WIDTHS = {390: 844, 1280: 800, 1920: 1080, 3840: 2160}
LONG = "Die Anlage steht wegen Wartungsarbeiten_am_Vakuumtisch_und_am_Werkzeugwechsler_bis_morgen " * 2

# The page hears states from this instead of from the service; the test gives them.
_PLAYED_EVENTS = """
window.EventSource = class {
  constructor() { window.played = this; }
  close() {}
};
"""


def play(context: BrowserContext) -> None:
    """Pages of this context hear what `tell` gives them, and nothing else."""
    context.add_init_script(_PLAYED_EVENTS)


def tell(page: Page, state: dict[str, Any] | None) -> None:
    """Have the page hear a state; None = the connection breaks."""
    page.wait_for_function("Boolean(window.played?.onmessage)")
    if state is None:
        page.evaluate("window.played.onerror()")
    else:
        page.evaluate("(text) => window.played.onmessage({data: text})", json.dumps(state))


def states(ready: dict[str, Any]) -> dict[str, dict[str, Any] | None]:
    """What the page is told in each state, by a name; made of what a ready daemon said."""

    def changed(**more: Any) -> dict[str, Any]:
        return {**copy.deepcopy(ready), "faults": {}, "warnings": {}, "reason": None, "code": 0, "job": None, **more}

    def last(outcome: str | None, reason: Reason | None = None) -> dict[str, Any] | None:
        if outcome is None:
            return None
        return {
            "job": 12_345,
            "outcome": outcome,
            "code": int(reason or 0),
            "name": reason and reason.label,
            "detail": "Seen 17.25 px, expected 3 px." if reason else None,
            "settled_at": "2026-03-04T05:06:07.890+00:00",
        }

    def fault(part: str, reason: Reason, text: str) -> dict[str, Any]:
        return {part: {"code": int(reason), "name": reason.label, "text": text, "starting": False}}

    refused = {
        f"refused {reason.label}": changed(last_job=last("refused", reason)) for reason in Reason if 100 <= reason < 140
    }
    lost = fault("controller", Reason.CONTROLLER_LOST, "modbus-tcp 127.0.0.1:502: connection refused")
    gone = fault(
        "camera", Reason.NO_FRAME, "/dev/v4l/by-id/usb-a_very_long_name_of_a_camera-video-index0: is not there"
    )
    waiting = {**copy.deepcopy(ready["link"]), "not_ready": "machine state 2: it is cutting"}
    return {
        "starting": changed(state="Preoperational", last_job=None),
        "no job yet": changed(last_job=None),
        "measuring": changed(state="SingleExecution", job=12_346, last_job=last("accepted")),
        "accepted": changed(last_job=last("accepted")),
        **refused,
        "failed": changed(last_job=last("failed", Reason.CONTROLLER_TIMEOUT)),
        "waiting": changed(last_job=last("accepted"), link=waiting),
        "error": changed(
            state="Error", code=int(Reason.CONTROLLER_LOST), faults=lost | gone, last_job=last("accepted")
        ),
        "halted": changed(state="Halted", reason=LONG, last_job=last("accepted"), warnings={"disk": LONG}),
        "lost": None,
    }
