"""A measured block with a hole, and a part with a hole laid into it."""

from __future__ import annotations

from pathlib import Path

from contour.acceptance.error_budget import ErrorBudget
from contour.geometry.rings import Contour
from contour.placement.place import Placement
from contour.placement.pose import Pose
from contour.synthetic import disc_ring, rectangle, with_holes
from service.measuring.measurement import Measurement
from service.parts.fit import PartFit
from service.parts.part import Part

BLOCK = with_holes(rectangle((150.0, 100.0), 300.0, 200.0), disc_ring((40.0, 160.0), 20.0))
PART = with_holes(rectangle((200.0, 100.0), 160.0, 160.0), disc_ring((200.0, 100.0), 60.0))


def measured(part: Contour = PART) -> Measurement:
    placement = Placement(Pose(0.0, 0.0, 0.0), 20.0, ((120.0, 20.0), (120.0, 0.0)))
    fit = PartFit(Part(Path("part.dxf"), part, "mm"), placement, part, 3.0, 0.4)
    bound = ErrorBudget(0.4, 0.0, None)
    return Measurement("wall-tips", millimetres=BLOCK, uncertainty=bound, part=fit, thickness_mm=25.0)
