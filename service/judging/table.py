"""Judgements in words and columns, for terminal and report."""

from __future__ import annotations

from collections.abc import Sequence

from drivers.camera.files.folder import shown
from service.judging.judgement import Judgement, summary

VERDICTS = {"ok": "accepted", "refused": "refused", "error": "not judged"}
COLUMNS = ("picture", "verdict", "IoU", "mean px", "95 % px", "Hausdorff", "bound px", "edge", "held", "reasons")
_HELD = {True: "yes", False: "NO", None: ""}


def cells(judgement: Judgement) -> tuple[str, ...]:
    """What stands in COLUMNS; what is not known is empty. Of a picture that was not judged the reason is a text."""
    figures = judgement.agreement
    reasons = [f"{int(reason)} {reason.label}" for reason in judgement.reasons]
    told = [""] * 4
    if figures is not None:
        distances = (figures.mean_px, figures.p95_px, figures.hausdorff_px)
        told = [f"{figures.iou:.3f}", *(f"{distance:.2f}" for distance in distances)]
    return (
        shown(judgement.image.name),
        VERDICTS[judgement.status],
        *told,
        "" if judgement.bound_px is None else f"{judgement.bound_px:.2f}",
        _edge(judgement),
        _HELD[judgement.bound_held],
        ", ".join(reasons if judgement.status != "error" else judgement.details),
    )


def _edge(judgement: Judgement) -> str:
    edge = judgement.edge or ""
    return edge if judgement.edge_told is not False else f"{edge}, NOT {judgement.true_edge}"


def line(words: Sequence[str], name_width: int) -> str:
    """COLUMNS or cells in columns, whose names are no longer than that."""
    name, verdict, *figures, edge, held, reasons = words
    numbers = "".join(f"{word:>11}" for word in figures)
    return f"{name:<{name_width}}  {verdict:<10}{numbers}  {edge:<15}  {held:<4}  {reasons}".rstrip()


def sentence(judgements: Sequence[Judgement]) -> str:
    """What is said of all of them."""
    told = summary(judgements)
    text = f"{told['pictures']} pictures: {told['accepted']} accepted"
    if told["iou_mean"] is not None:
        text += f" (IoU {told['iou_mean']:.3f} mean, {told['iou_worst']:.3f} worst"
        text += f"; {told['bounds_held']} of {told['bounds_stated']} bounds held)" if told["bounds_stated"] else ")"
    if told["edges_known"]:
        text += f", edge told rightly in {told['edges_told']} of {told['edges_known']}"
    return f"{text}, {told['refused']} refused, {told['errors']} not judged"
