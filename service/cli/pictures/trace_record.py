"""What `combtrace trace` tells of one picture: the object for programs, the line for people."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from contour.geometry.rings import Contour
    from service.measuring.measurement import Measurement


def sentence(measurement: Measurement, language: str) -> str:
    """The line for people, without the picture's name; language: of the reasons."""
    from service.reasons import Language

    if measurement.findings and language == Language.RUSSIAN:
        told = (f"{int(code)} {code.label}: {code.explained(Language.RUSSIAN)}" for code in measurement.reasons)
        return "отказ: " + "; ".join(told) + " [" + "; ".join(measurement.texts) + "]"
    if measurement.findings:
        return "refused: " + "; ".join(f"{int(code)} {code.label}: {text}" for code, text in measurement.findings)
    assert measurement.pixels is not None
    text = f"{measurement.method}, {measurement.pixels.point_count} vertices"
    if measurement.pixels.holes:
        text += f", {len(measurement.pixels.holes)} holes"
    size = measurement.size_mm
    if size is not None:
        text += f", {measurement.area_mm2:.0f} mm², {size[0]:.1f} x {size[1]:.1f} mm"
    else:
        text += f", {measurement.area_px2:.0f} px²"
    if measurement.uncertainty_mm is not None:
        text += f", within {measurement.uncertainty_mm:.2f} mm"
    elif measurement.uncertainty_px is not None:
        text += f", within {measurement.uncertainty_px:.2f} px"
    if measurement.ribbon is not None:
        text += f", {measurement.ribbon.words}"
    if measurement.part is not None:
        text += f", {measurement.part.sentence}"
    if measurement.parts:
        text += f", {len(measurement.parts)} of {sum(measurement.wanted)} parts laid"
    return f"{text}, {measurement.timings_ms['total']:.0f} ms"


def record_of(image: Path, measurement: Measurement) -> dict[str, Any]:
    """The contract's object for a picture that could be read."""
    from drivers.camera.files.folder import shown

    reasons = [reason.label for reason in measurement.reasons]
    return {
        "image": shown(image),
        "status": "refused" if reasons else "ok",
        "reason": reasons[0] if reasons else None,
        "reasons": reasons,
        "reason_codes": [int(reason) for reason in measurement.reasons],
        "method": measurement.method,
        "polarity": measurement.polarity,
        "pitch_px": measurement.pitch_px,
        "edge": measurement.edge,
        **({"network": True} if measurement.network else {}),
        "pixels": _rings(measurement.pixels),
        "area_px2": measurement.area_px2,
        "uncertainty_px": measurement.uncertainty_px,
        "evidence": measurement.evidence_fields,
        "frame": "machine",
        "thickness_mm": measurement.thickness_mm,
        "millimetres": _rings(measurement.millimetres),
        "area_mm2": measurement.area_mm2,
        "uncertainty_mm": measurement.uncertainty_mm,
        **({} if measurement.ribbon is None else {"ribbon": measurement.ribbon.fields()}),
        **({} if measurement.part is None else {"part": measurement.part.fields()}),
        **({"parts": [part.fields() for part in measurement.parts]} if measurement.parts else {}),
        "timings_ms": {name: round(value, 3) for name, value in measurement.timings_ms.items()},
        "details": list(measurement.texts),
    }


def unusable_record(image: Path, method: str, text: str) -> dict[str, Any]:
    """The contract's object for a picture that could not be used."""
    from service.measuring.measurement import Measurement

    return {**record_of(image, Measurement(method=method)), "status": "error", "details": [text]}


def _rings(contour: Contour | None) -> dict[str, Any] | None:
    if contour is None:
        return None
    return {"exterior": contour.exterior.tolist(), "holes": [hole.tolist() for hole in contour.holes]}
