"""Whether a part can be cut from a block: where it lies best, and by how much it is short where it does not fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from contour.calibration.calibration import Calibration
from contour.errors import CalibrationError
from contour.geometry.rings import Contour, densified, perimeter
from contour.image.overlay import DrawnPart
from contour.placement.place import Placement, best_placement, placement_at
from contour.placement.pose import Pose
from contour.placement.several import Wanted, lay_several
from service.parts.part import CHORD_MM, Part
from service.parts.sure_block import SureBlock

if TYPE_CHECKING:
    from service.config.recipes import OneOfParts, PartToCut


_STEP_MM = 5.0
"""A lens bends what is straight in millimetres; over so much, by less than a pixel."""


@dataclass(frozen=True)
class PartFit:
    """A part where its least margin to the measured block is largest, millimetres of the machine frame.

    placed: its outline there. asked_mm: the margin that the recipe asks for. bound_mm: by how much the true edge may
    lie nearer to the part than it was measured. number: its place among the recipe's parts, from 1; several: it has
    such. drawn: the same in the picture; None where it is not in view.
    """

    part: Part
    placement: Placement
    placed: Contour
    asked_mm: float
    bound_mm: float
    drawn: DrawnPart | None = None
    number: int = 1
    several: bool = False

    @property
    def needed_mm(self) -> float:
        """What the margin must be: what is asked for, the bound, and what curves lost as chords."""
        return self.asked_mm + self.bound_mm + CHORD_MM

    @property
    def label(self) -> int | None:
        """What is written on it: its number, where there are several."""
        return self.number if self.several else None

    @property
    def margin_mm(self) -> float:
        """The least distance reached, negative where the part stands out of the block."""
        return self.placement.margin

    @property
    def fits(self) -> bool:
        return self.margin_mm >= self.needed_mm

    @property
    def short_by_mm(self) -> float | None:
        """What the margin lacks; None where it fits."""
        return None if self.fits else self.needed_mm - self.margin_mm

    @property
    def sentence(self) -> str:
        """Where it lies, in a few words."""
        pose = self.placement.pose
        return (
            f"{self.part.path.name} at ({pose.x:.2f}, {pose.y:.2f}) mm, turned {pose.angle_deg:.2f} degrees, with "
            f"{self.margin_mm:.2f} mm of {self.needed_mm:.2f} mm needed"
        )

    @property
    def finding(self) -> str | None:
        """Why the block is refused, in a sentence; None where the part fits."""
        if self.fits:
            return None
        (x, y), _ = self.placement.tightest
        reached = (
            f"keeps {self.margin_mm:.2f} mm"
            if self.margin_mm >= 0
            else f"stands out of the block by {-self.margin_mm:.2f} mm or more"
        )
        needed = (
            f"{self.needed_mm:.2f} mm ({self.asked_mm:g} mm, and {self.bound_mm:.2f} mm that the contour may be off)"
        )
        return (
            f"The part {self.part.path.name} does not fit: where it lies best it {reached} at ({x:.1f}, {y:.1f}) mm, "
            f"needed are {needed}. It is short by {self.short_by_mm:.2f} mm. Lay a larger block, or allow less margin "
            "or more turns."
        )

    def fields(self) -> dict[str, Any]:
        """What `combtrace fit --json` tells."""
        pose = self.placement.pose
        return {
            "fits": self.fits,
            "pose": {"x_mm": pose.x, "y_mm": pose.y, "angle_deg": pose.angle_deg},
            "margin_mm": self.margin_mm,
            "needed_mm": self.needed_mm,
            "tightest_mm": list(self.placement.tightest[0]),
            "part_mm": _rings_kept(self.placed),
            "short_by_mm": self.short_by_mm,
        }

    def kept(self) -> dict[str, Any]:
        """All of it as JSON's types, for `of_kept`."""
        pose, drawn = self.placement.pose, self.drawn
        return {
            **self.summary(),
            "path": str(self.part.path),
            "unit": self.part.unit,
            "pose": [pose.x, pose.y, pose.angle],
            "margin": self.margin_mm,
            "tightest_mm": self.placement.tightest,
            "asked_mm": self.asked_mm,
            "bound_mm": self.bound_mm,
            "number": self.number,
            "several": self.several,
            "millimetres": _rings_kept(self.placed),
            "drawn": None
            if drawn is None
            else {"pixels": _rings_kept(drawn.outline), "margin_px": drawn.margin_px, "tightest_px": drawn.tightest},
        }

    @classmethod
    def of_kept(cls, kept: dict[str, Any]) -> PartFit:
        """The fit that was kept; its part as drawn is that which was placed, taken back."""
        pose, placed = Pose(*kept["pose"]), _rings_of(kept["millimetres"])
        as_drawn = Contour(pose.undone(placed.exterior), tuple(pose.undone(hole) for hole in placed.holes))
        placement = Placement(pose, kept["margin"], _pair(kept["tightest_mm"]))
        fit = cls(
            Part(Path(kept["path"]), as_drawn, kept["unit"]),
            placement,
            placed,
            kept["asked_mm"],
            kept["bound_mm"],
            number=kept.get("number", 1),
            several=kept.get("several", False),
        )
        drawn = kept["drawn"]
        if drawn is None:
            return fit
        outline = _rings_of(drawn["pixels"])
        tightest = _pair(drawn["tightest_px"])
        return replace(fit, drawn=DrawnPart(outline, drawn["margin_px"], tightest, fit.fits, fit.label))

    def summary(self) -> dict[str, Any]:
        """What the journal keeps of it."""
        told = self.fields()
        pose = {name: round(value, 4) for name, value in told["pose"].items()}
        margin, needed = round(self.margin_mm, 3), round(self.needed_mm, 3)
        return {"file": self.part.path.name, "fits": self.fits, "margin_mm": margin, "needed_mm": needed, **pose}


def _rings_kept(contour: Contour) -> dict[str, Any]:
    return {"exterior": contour.exterior.tolist(), "holes": [hole.tolist() for hole in contour.holes]}


def _rings_of(kept: dict[str, Any]) -> Contour:
    return Contour(np.array(kept["exterior"]), tuple(np.array(hole) for hole in kept["holes"]))


def _pair(kept: Any) -> tuple[tuple[float, float], tuple[float, float]]:
    (x, y), (u, v) = kept
    return (x, y), (u, v)


def fit_part(part: Part, block: SureBlock, asked: PartToCut) -> PartFit:
    """The part where its least margin to the block is largest; where it does not fit there since the edge near it is
    less sure than elsewhere, where it does, if anywhere.
    """
    fit = _laid(part, block, best_placement(part.contour, block.measured, asked.turns), asked.margin_mm)
    if fit.fits or fit.margin_mm < asked.margin_mm + block.bound_mm + CHORD_MM:
        return fit
    other = best_placement(part.contour, block.sure, asked.turns)
    elsewhere = _laid(part, block, placement_at(part.contour, block.measured, other.pose), asked.margin_mm)
    return elsewhere if elsewhere.fits else fit


def lay_parts(
    wanted: Sequence[tuple[Part, OneOfParts]], block: SureBlock, apart_mm: float, tries: int
) -> tuple[PartFit, ...]:
    """As many of the parts as can be laid into the block, machine frame, each keeping its margin."""
    asked = [
        Wanted(part.contour, one.quantity, one.margin_mm + block.bound_mm + CHORD_MM, one.priority, one.turns)
        for part, one in wanted
    ]
    found = []
    # Two parts beside one another each lose their chords.
    for laid in lay_several(asked, block.sure, apart_mm + 2 * CHORD_MM, tries):
        part, one = wanted[laid.index]
        placement = placement_at(part.contour, block.measured, laid.placement.pose)
        found.append(replace(_laid(part, block, placement, one.margin_mm), number=laid.index + 1, several=True))
    return tuple(found)


def _laid(part: Part, block: SureBlock, placement: Placement, asked_mm: float) -> PartFit:
    bound_mm = block.bound_at(part.contour, placement)
    return PartFit(part, placement, placement.pose.placed(part.contour), asked_mm, bound_mm)


def in_picture(fit: PartFit, calibration: Calibration, thickness_mm: float) -> PartFit:
    """The same with where it is seen in the picture, on the block's top; unchanged where that is not in view."""
    try:
        rings = [calibration.to_pixels(densified(ring, _STEP_MM), thickness_mm) for ring in fit.placed.rings]
        ends = calibration.to_pixels(np.array(fit.placement.tightest), thickness_mm)
    except CalibrationError:
        return fit
    scale = perimeter(rings[0]) / perimeter(fit.placed.exterior)
    (x, y), (u, v) = ends.tolist()
    outline = Contour(rings[0], tuple(rings[1:]))
    return replace(fit, drawn=DrawnPart(outline, scale * fit.needed_mm, ((x, y), (u, v)), fit.fits, fit.label))
