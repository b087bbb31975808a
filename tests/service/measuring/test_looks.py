"""Which of several looks at a picture counts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from contour.errors import EdgeContradicted, NoBlockFound
from contour.synthetic import render
from service.config.recipes import Recipe
from service.measuring.looks.look import Look
from service.measuring.looks.outcome import best
from service.measuring.measure import Measurer
from service.measuring.measurement import Measurement
from service.reasons import Reason
from tests.support.scenes.edge_scenes import HOLED

PLAIN = Look(np.zeros((8, 8), np.uint8))
DRAWN = PLAIN._replace(draw=lambda **_: None)


@pytest.fixture(scope="module")
def accepted() -> Measurement:
    found = Measurer(None).measure(render(HOLED).picture, Recipe(number=1, name="default"), 0.0)
    assert not found.reasons
    return found


def found_by(drawn: Measurement | Exception, accepted: Measurement) -> Measurement | Exception:
    """What counts where a plain look saw no block, drawn walls showed this, and later looks find what they accept."""

    def outlined(look: Look) -> Measurement:
        if look.network and look.by == "ends":
            if isinstance(drawn, Exception):
                raise drawn
            return drawn
        return accepted

    first = NoBlockFound("no block found")
    looks = iter([DRAWN, DRAWN._replace(by="border"), PLAIN._replace(least_rise=1.0)])
    return best(first, looks, outlined, lambda _: None)


def test_what_drawn_walls_do_not_show_later_looks_may(accepted: Measurement) -> None:
    assert found_by(NoBlockFound("no block found"), accepted) is accepted


def test_where_drawn_walls_close_their_cells_no_later_look_counts(accepted: Measurement) -> None:
    """It would take teeth of closed cells for ends of walls: two lattices were accepted so, off by 0.6 and 0.7."""
    assert isinstance(found_by(EdgeContradicted("closed", "mixed"), accepted), NoBlockFound)
    unsure = replace(accepted, edge="mixed", findings=((Reason.UNCERTAINTY_TOO_LARGE, "unsure"),))
    assert isinstance(found_by(unsure, accepted), NoBlockFound)


def test_where_something_lies_over_drawn_ends_of_walls_two_networks_alone_may_tell_an_outline(
    accepted: Measurement,
) -> None:
    asked: list[str] = []

    def outlined(look: Look) -> Measurement:
        asked.append(look.by if look.network else "walls")
        return replace(accepted, findings=((Reason.EDGE_COVERED, "a thing"),))

    looks = iter([DRAWN, DRAWN._replace(by="border"), DRAWN._replace(by="networks"), PLAIN._replace(least_rise=1.0)])
    first = NoBlockFound("no block found")
    assert best(first, looks, outlined, lambda _: None) is first
    assert asked == ["ends", "networks"]
