"""What is looked at in a picture, or instead of it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from contour.errors import NoBlockFound
from contour.geometry.rings import Contour
from contour.image.pixel_grid import pixels_of
from contour.relief.relief import Relief
from contour.segmentation.comb_picture import CombPicture
from contour.tracing.trace import OnStage
from contour.walls.see_block import Source
from service.reasons import Reason

LIES_THERE = {Reason.SEVERAL_BLOCKS, Reason.EDGE_COVERED}
"""What was seen to lie there is there."""
# Where ends of walls are too few to tell an edge, those of fewer tell less.
_HARDLY_SEEN = {Reason.UNCERTAINTY_TOO_LARGE}


class Look(NamedTuple):
    """A picture, (H, W) grey or (H, W, 3) BGR, or what differs in it from a known table; `least_rise` as in the
    settings of a trace; `draw`: has a network tell of it what to look at, `by` ends of the walls that it draws, the
    border of its comb, or the outline that two networks tell; `times`: how many times as large as it was taken it is.
    """

    picture: NDArray[np.uint8]
    relief: Relief | None = None
    least_rise: float | None = None
    draw: Callable[[], CombPicture | None] | None = None
    by: Literal["ends", "border", "networks"] = "ends"
    times: int = 1

    @property
    def network(self) -> bool:
        """Whether what is looked at is drawn by a network."""
        return self.draw is not None

    def drawn(self, on_stage: OnStage) -> tuple[NDArray[np.uint8], Source | None]:
        """What to look at, and what it was drawn from; raise NoBlockFound where a network sees none, or is in doubt."""
        if self.draw is None:
            return self.picture, None
        drawn = self.draw()
        on_stage("network")
        if drawn is None:
            raise NoBlockFound("no block found: a network sees no comb")
        told = {"ends": drawn.walled, "border": drawn.bordered, "networks": drawn.outlined}[self.by]
        return drawn.drawn, told()

    def check(self, outline: Contour) -> None:
        """Raise NoBlockFound where networks see the border of comb elsewhere than along an outline, pixels as taken."""
        drawn = None if self.draw is None or self.by == "networks" else self.draw()
        if drawn is not None:
            drawn.check(Contour.of(pixels_of(ring, self.times) for ring in outline.rings))

    def may_show_more(self, reasons: set[Reason], *, nowhere: bool) -> bool:
        """Whether it is worth a look after a first one was refused for these reasons, or saw cells nowhere."""
        if self.network:
            return Reason.SEVERAL_BLOCKS not in reasons
        if self.relief is not None:
            return True
        # What is nowhere in the picture is not in its high walls either.
        return not (nowhere or reasons & LIES_THERE or (reasons == _HARDLY_SEEN and self.least_rise is not None))
