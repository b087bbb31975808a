"""What can be done, by name: of what it is asked, to which step it belongs, and whether jobs may run meanwhile."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any

from service.web.commission import models
from service.web.commission.bench import Bench
from service.web.commission.board_actions import BoardActions
from service.web.commission.cell_actions import CellActions
from service.web.commission.machine_actions import MachineActions


@dataclass(frozen=True)
class Action:
    """asked: its model. halted: it is carried out only then. do: gives what the journal is to say; raises
    StepRefused."""

    step: models.StepName
    asked: type[models.ActionRequest]
    halted: bool
    do: Callable[[Any], Awaitable[str]]


def actions(bench: Bench) -> dict[str, Action]:
    """All of them."""
    board, cell, machine = BoardActions(bench), CellActions(bench), MachineActions(bench)
    plain = models.ActionRequest
    return {
        "look": Action("camera", models.LookRequest, False, board.look),
        "board": Action("board", models.BoardRequest, False, board.board),
        "shoot": Action("board", models.ShootRequest, False, board.shoot),
        "remove": Action("board", models.RemoveRequest, False, board.remove),
        "calibrate": Action("calibration", models.CalibrateRequest, True, board.calibrate),
        "adopt": Action("calibration", plain, True, board.adopt),
        "height": Action("height", models.HeightRequest, False, machine.height),
        "point": Action("alignment", models.PointRequest, False, machine.point),
        "forget": Action("alignment", models.ForgetRequest, False, machine.forget),
        "align": Action("alignment", models.AlignRequest, True, machine.align),
        "marks": Action("marks", models.MarksRequest, True, machine.marks),
        "teach": Action("table", plain, True, cell.teach),
        "probe": Action("controller", models.ProbeRequest, True, cell.probe),
        "apply": Action("controller", plain, True, cell.apply),
    }
