"""Sights of a gauge become a certificate; where they cannot, what is missing is named and nothing is certified."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from contour.errors import CalibrationError, ParameterError
from contour.length_test.study import Study, gauge_study
from contour.length_test.verdict import Limit, height_limit_mm, length_errors
from service.certifying.certificate import (
    BLOCK_LIMIT_MM,
    PLATE_LIMIT_MM,
    Certificate,
    Circumstances,
    LimitBy,
    conditions_of,
)
from service.certifying.gauge_file import Gauge, PlateFile
from service.certifying.guide import still_missing, told
from service.certifying.sight import Eye, Sight, marks_finding, served
from service.measuring.calibration_guard import CalibrationGuard

if TYPE_CHECKING:
    from service.config.recipes import Recipe


class NotCertified(Exception):
    """Nothing can be certified: what was seen, what is needed."""


def default_limit(gauge: Gauge, recipe: Recipe) -> tuple[float, LimitBy]:
    """What is tested where nobody states a limit, mm: of a block, what its recipe asks of every contour."""
    if isinstance(gauge.file, PlateFile):
        return PLATE_LIMIT_MM, "default"
    return (recipe.max_uncertainty_mm, "recipe") if recipe.max_uncertainty_mm else (BLOCK_LIMIT_MM, "default")


def check_able(gauge: Gauge, guard: CalibrationGuard, limit: Limit, temperature_c: float | None) -> None:
    """Raise NotCertified where this gauge or calibration could not show that limit, whatever the pictures say."""
    height_mm = gauge.file.height_mm
    if not guard.record.calibration.height_known(height_mm):
        raise NotCertified(
            f"the calibration does not know the scale at {height_mm:g} mm, the height of the gauge's plane. Calibrate "
            "with tilted views of a board, or take a gauge of the calibrated plane's height"
        )
    try:
        height_limit_mm(guard.record.calibration, height_mm, limit)
    except CalibrationError as error:
        raise NotCertified(
            f"the calibration does not hold to the corners of the picture: {error} Calibrate with views that reach them"
        ) from error
    conditions = conditions_of(gauge, temperature_c)
    warmth = conditions.expansion_per_k * conditions.warmer_uncertainty_k
    for known in gauge.known:
        least = float(np.hypot(known.uncertainty_mm, 2 * known.length_mm * warmth))
        if least >= limit.at(known.length_mm):
            raise NotCertified(
                f"length {known.name} of the gauge is sure to {least:.3f} mm only, the limit is "
                f"{limit.at(known.length_mm):g} mm: it can show nothing. Take a better gauge, measure its warmth "
                "(--temperature-c), or state a larger limit (--limit-mm)"
            )
    if gauge.file.form_mm >= limit.constant_mm:
        raise NotCertified(
            f"the gauge's lines are straight to {gauge.file.form_mm:g} mm only, the limit is {limit.constant_mm:g} mm: "
            "they can show nothing. Take a better gauge, or state a larger limit (--limit-mm)"
        )


def certified(
    eye: Eye,
    gauge: Gauge,
    guard: CalibrationGuard,
    circumstances: Circumstances,
    sights: Sequence[Sight],
    study: Study | None = None,
) -> Certificate:
    """The certificate of these pictures; raise NotCertified where they are too few, in places or directions."""
    kept, left = served(sights)
    lack = still_missing(kept, eye, gauge.file.height_mm, circumstances.places)
    if not kept:
        first = f"; the first: {left[0].name}: {left[0].refused.rstrip('.')}" if left else ""
        raise NotCertified(f"the gauge was found in none of {len(sights)} pictures{first}. Nothing is certified")
    if not lack.nothing:
        raise NotCertified(
            f"too few positions: {len(kept)} of {len(sights)} pictures serve, and these are missing: {told(lack)}. "
            "Nothing is certified"
        )
    found = [finding for sight in sights for finding in sight.findings]
    hidden = marks_finding(sights, guard)
    # One of a kind is enough: a camera that was moved was moved in every picture.
    findings = dict(reversed(found if hidden is None else [*found, hidden]))
    return Certificate(circumstances, gauge, guard.record, kept, left, tuple(sorted(findings.items())), study)


def studied(gauge: Gauge, circumstances: Circumstances, operators: Mapping[str, Sequence[Sight]]) -> Study:
    """The study of each operator's pictures; raise NotCertified where they do not make one."""
    conditions, limit = conditions_of(gauge, circumstances.temperature_c), circumstances.limit
    by_person: list[list[list[float]]] = []
    for person, sights in operators.items():
        kept, left = served(sights, places_of_their_own=False)
        if left:
            raise NotCertified(f"--study {person}: {left[0].name} does not serve: {left[0].refused}")
        by_person.append(
            [
                [error.error_mm for error in length_errors(sight.name, sight.gauge, gauge.known, conditions, limit)]
                for sight in kept
                if sight.gauge is not None
            ]
        )
    counts = {person: len(sights) for person, sights in operators.items()}
    if len(set(counts.values())) > 1:
        seen = ", ".join(f"{person} {count}" for person, count in counts.items())
        raise NotCertified(f"--study: pictures of each operator: {seen}; expected as many of each")
    try:
        return gauge_study(np.array(by_person).transpose(2, 0, 1), limit.constant_mm)
    except (ParameterError, ValueError) as error:
        raise NotCertified(f"--study: {error}. Name two operators or more, with two pictures or more each") from error
