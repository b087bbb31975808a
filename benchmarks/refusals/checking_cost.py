"""What refusing and stating an uncertainty cost on top of tracing, on the 12 MP scene, both in the same run."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from types import ModuleType
from typing import Any
from unittest.mock import patch

from contour.acceptance import trace_check
from contour.synthetic import render
from contour.tracing import wall_tips
from contour.walls import see_block
from service.config.recipes import Recipe
from service.measuring import measure
from service.measuring.measure import Measurer
from tests.support.scenes.bench_scenes import measured_scenes
from tests.support.scenes.trials import calibration_for

ALLOWED = 0.15
SCENE = "12mp"
_ROUNDS = 9
# All that tracing would not need; what a comb looks like falls off while cells are counted.
_CHECKS: dict[str, tuple[tuple[ModuleType, str], ...]] = {
    "quality of the picture": ((trace_check, "block_quality"),),
    "second account of the block": ((trace_check, "_bent"), (trace_check, "disagreement")),
    "uncertainty": ((wall_tips, "uncertainty"),),
    "other pieces, reach to the frame": ((see_block, "pieces_beside"), (see_block, "walls_at_frame")),
    "limits, comb likeness, budget": ((measure, "judge"), (measure, "error_budget")),
}


@dataclass(frozen=True)
class CheckingCost:
    """Processor time in milliseconds of the cheapest of some rounds: tracing without the checks, and each check."""

    tracing_ms: float
    checks_ms: dict[str, float]

    @property
    def share(self) -> float:
        """The checks over the tracing that they come on top of."""
        return sum(self.checks_ms.values()) / self.tracing_ms

    def __str__(self) -> str:
        parts = ", ".join(f"{what} {spent:.1f}" for what, spent in self.checks_ms.items())
        return (
            f"On the 12 MP scene all checks together take {sum(self.checks_ms.values()):.1f} ms of processor time on "
            f"top of {self.tracing_ms:.0f} ms of tracing (mask and trace without them), {100 * self.share:.1f} %; at "
            f"most {100 * ALLOWED:g} % are allowed. In ms: {parts}."
        )


def checking_cost() -> CheckingCost:
    """The cost on the 12 MP scene, through the service's own code."""
    scene = next(scene for scene in measured_scenes() if scene.name == SCENE)
    rendered = render(scene.scene)
    measurer = Measurer(calibration_for(rendered.camera), clock=time.process_time)
    recipe = Recipe(number=1, name="default")
    rounds = []
    for _ in range(_ROUNDS):
        spent = dict.fromkeys(_CHECKS, 0.0)
        with ExitStack() as stack:
            for what, calls in _CHECKS.items():
                for module, name in calls:
                    stack.enter_context(patch.object(module, name, _timed(getattr(module, name), what, spent)))
            found = measurer.measure(rendered.picture, recipe, rendered.thickness_mm)
        within = spent["uncertainty"] + spent["other pieces, reach to the frame"]
        rounds.append(CheckingCost(found.timings_ms["mask"] + found.timings_ms["trace"] - within, spent))
    return min(rounds, key=lambda one: one.tracing_ms + sum(one.checks_ms.values()))


def _timed(call: Callable[..., Any], what: str, spent: dict[str, float]) -> Callable[..., Any]:
    def timed(*arguments: Any, **named: Any) -> Any:
        started = time.process_time()
        result = call(*arguments, **named)
        spent[what] += (time.process_time() - started) * 1e3
        return result

    return timed
