"""What was seen in one picture, and what speaks against it."""

from __future__ import annotations

from collections import Counter
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from contour.acceptance.error_budget import ErrorBudget
from contour.acceptance.quality import Quality
from contour.acceptance.sent_evidence import SentStretch
from contour.geometry.arrays import Float64s
from contour.geometry.rings import Contour
from contour.image.overlay import Hidden
from service.reasons import Reason, Rejection

if TYPE_CHECKING:
    from service.parts.core_ribbon import CoreRibbon
    from service.parts.fit import PartFit

_STRETCH_FIELDS = ("ring", "from_px", "to_px", "from_mm", "to_mm", "state", "by", "bound_px", "bound_mm")


@dataclass(frozen=True)
class Measurement:
    """What was seen in one picture: the contour, where there is one, and the findings against it, lowest code first.

    pixels and millimetres hold the same vertices in the same order; millimetres are of the machine frame. timings_ms
    has a figure for each stage that ran, and "total". shown_px: paths in the picture that show what speaks
    against it, (N, 2) each. edge: cut, cells or mixed, as the picture shows it. evidence: what the contour rests on,
    stretches along its rings; None where nobody says. part: the recipe's part in it; None where the recipe has none,
    or the contour was refused before it was tried. parts: those of a recipe with several that lie in it; wanted: how
    many of each were to be laid. ribbon: where the core's runs; None where no part asks for it. network: whether it was
    seen in what a network tells of the picture.
    """

    method: str
    polarity: str | None = None
    pitch_px: float | None = None
    edge: str | None = None
    network: bool = False
    pixels: Contour | None = None
    shown_px: tuple[Float64s, ...] = ()
    millimetres: Contour | None = None
    area_px2: float | None = None
    area_mm2: float | None = None
    uncertainty_px: float | None = None
    uncertainty: ErrorBudget | None = None
    evidence: tuple[SentStretch, ...] | None = None
    part: PartFit | None = None
    parts: tuple[PartFit, ...] = ()
    ribbon: CoreRibbon | None = None
    wanted: tuple[int, ...] = ()
    thickness_mm: float | None = None
    aligned: bool = False
    quality: Quality | None = None
    findings: tuple[Rejection, ...] = ()
    timings_ms: dict[str, float] = field(default_factory=dict)

    @property
    def reasons(self) -> tuple[Reason, ...]:
        """Why it is refused, lowest code first; empty where it is not."""
        return tuple(reason for reason, _ in self.findings)

    @property
    def texts(self) -> tuple[str, ...]:
        """The findings as sentences, each with the measured value and the limit."""
        return tuple(text for _, text in self.findings)

    @property
    def uncertainty_mm(self) -> float | None:
        """95 % bound on the position of the polygon that is sent, all causes together; None where it is not known."""
        return None if self.uncertainty is None else self.uncertainty.total_mm

    @property
    def size_mm(self) -> tuple[float, float] | None:
        """Width and height of the contour's box in the machine frame."""
        if self.millimetres is None:
            return None
        width, height = np.ptp(self.millimetres.exterior, axis=0).tolist()
        return width, height

    @property
    def laid(self) -> tuple[PartFit, ...]:
        """The part, or the parts, that lie in it."""
        return self.parts if self.part is None else (self.part,)

    @property
    def laid_of_each(self) -> list[tuple[int, int, int]]:
        """Of several parts each number, how many of it were laid, and how many were wanted."""
        laid = Counter(fit.number for fit in self.parts)
        return [(number, laid[number], wanted) for number, wanted in enumerate(self.wanted, start=1)]

    @property
    def evidence_fields(self) -> list[dict[str, Any]] | None:
        """The evidence as `combtrace trace --json` and documents tell it."""
        if self.evidence is None:
            return None
        return [{name: getattr(stretch, name) for name in _STRETCH_FIELDS} for stretch in self.evidence]

    @property
    def hidden(self) -> list[Hidden]:
        """The parts of the contour that were not seen, for an overlay."""
        parts = [stretch for stretch in self.evidence or () if stretch.state != "seen"]
        return [Hidden(part.ring, part.from_px, part.to_px, part.state == "covered") for part in parts]

    def summary(self) -> dict[str, Any]:
        """What the journal keeps of it."""
        contour = self.pixels or self.millimetres
        return {
            "method": self.method,
            "polarity": self.polarity,
            "pitch_px": _rounded(self.pitch_px),
            **({"network": True} if self.network else {}),
            "vertices": 0 if contour is None else contour.point_count,
            "area_mm2": _rounded(self.area_mm2),
            "uncertainty_mm": _rounded(self.uncertainty_mm),
            "thickness_mm": self.thickness_mm,
            **({} if self.part is None else {"part": self.part.summary()}),
            **({"parts": [part.summary() for part in self.parts]} if self.parts else {}),
            **({} if self.ribbon is None else {"ribbon": self.ribbon.fields()}),
            "quality": None if self.quality is None else {k: _rounded(v) for k, v in asdict(self.quality).items()},
            "timings_ms": {name: _rounded(value) for name, value in self.timings_ms.items()},
        }


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(float(value), 3)
