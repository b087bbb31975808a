"""How well the outline that was traced in a picture agrees with the true one, and what that says of all pictures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from contour.geometry.agreement import Agreement, agreement, rectified_edges
from contour.geometry.rings import Contour
from drivers.camera.files.folder import shown
from service.judging.truth_file import Truth
from service.measuring.measure import Measurer
from service.measuring.measurement import Measurement
from service.reasons import Reason


@dataclass(frozen=True)
class Judgement:
    """What became of one picture; its status by the words of `combtrace trace --json`.

    agreement: None where there is no outline to compare. bound_px: the 95 % bound that was stated. edge, true_edge: how
    the border runs, as it was told and as it is; None where a method, or the truth, does not say.
    """

    image: Path
    status: Literal["ok", "refused", "error"]
    reasons: tuple[Reason, ...] = ()
    details: tuple[str, ...] = ()
    agreement: Agreement | None = None
    bound_px: float | None = None
    edge: str | None = None
    true_edge: str | None = None

    @property
    def edge_told(self) -> bool | None:
        """Whether the border was told as what it is; None where either is not there."""
        return None if self.edge is None or self.true_edge is None else self.edge == self.true_edge

    @property
    def bound_held(self) -> bool | None:
        """Whether 95 % of the true outline lies within the stated bound; None where either is not there."""
        if self.agreement is None or self.bound_px is None:
            return None
        return self.agreement.holds(self.bound_px)

    @property
    def passes(self) -> bool:
        """Accepted, and not outside the stated bound."""
        return self.status == "ok" and self.bound_held is not False

    def record(self) -> dict[str, Any]:
        """The contract's object of one picture."""
        figures = self.agreement
        return {
            "image": shown(self.image),
            "status": self.status,
            "reasons": [reason.label for reason in self.reasons],
            "iou": None if figures is None else figures.iou,
            "mean_px": None if figures is None else figures.mean_px,
            "p95_px": None if figures is None else figures.p95_px,
            "hausdorff_px": None if figures is None else figures.hausdorff_px,
            "bound_px": self.bound_px,
            "bound_held": self.bound_held,
            "edge": self.edge,
            "true_edge": self.true_edge,
            "edge_told": self.edge_told,
            "details": list(self.details),
        }


def judged(image: Path, measurement: Measurement, outline: Contour | None, truth: Truth) -> Judgement:
    """The judgement of an outline as `outline_px` gives it; a refused one is compared too."""
    return Judgement(
        image,
        "refused" if measurement.findings else "ok",
        measurement.reasons,
        measurement.texts,
        None if outline is None else agreement(outline, truth.outline),
        measurement.uncertainty_px,
        measurement.edge,
        truth.edge,
    )


def outline_px(measurement: Measurement, measurer: Measurer, thickness_mm: float) -> Contour | None:
    """The polygon that would be sent, in pixels: what is straight in millimetres is bent there by the lens."""
    if measurement.pixels is None or measurer.guard is None:
        return measurement.pixels
    return rectified_edges(measurement.pixels, measurer.guard.record.calibration.rectifier(thickness_mm))


def summary(judgements: Sequence[Judgement]) -> dict[str, Any]:
    """The contract's last object: counts, and figures over accepted pictures, null where none is."""
    accepted = [one for one in judgements if one.status == "ok"]
    figures = [one.agreement for one in accepted if one.agreement is not None]
    return {
        "pictures": len(judgements),
        "accepted": len(accepted),
        "refused": sum(one.status == "refused" for one in judgements),
        "errors": sum(one.status == "error" for one in judgements),
        "iou_mean": _mean([one.iou for one in figures]),
        "iou_worst": min((one.iou for one in figures), default=None),
        "mean_px": _mean([one.mean_px for one in figures]),
        "bounds_stated": sum(one.bound_held is not None for one in accepted),
        "bounds_held": sum(one.bound_held is True for one in accepted),
        "edges_known": sum(one.edge_told is not None for one in accepted),
        "edges_told": sum(one.edge_told is True for one in accepted),
    }


def _mean(values: Sequence[float]) -> float | None:
    return sum(values) / len(values) if values else None
