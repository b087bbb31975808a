"""Faults of a cell, of each of which the certificate must not pass."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from contour.length_test.verdict import Decision
from service.certifying.page import certificate_page
from service.reasons import Language, Reason
from tests.support.scenes.gauge_pictures import block_file, block_picture
from tests.support.scenes.gauge_scenes import Bend, places, turned
from tests.support.service.gauge_trials import HEIGHT_MM, PlateTrial, certificate, seen


def test_a_wrong_square_is_found(trial: PlateTrial, tmp_path: Path) -> None:
    known = trial.cell.known
    wrong = replace(known, translation_mm=known.translation_mm * 1.002)
    found = certificate(trial.told, replace(trial.record, calibration=wrong), trial.pictures, tmp_path)
    assert found.decision is Decision.FAILS
    assert found.worst.error_mm > 0.2


def test_a_wrong_height_is_found(trial: PlateTrial, tmp_path: Path) -> None:
    found = certificate({**trial.told, "height_mm": HEIGHT_MM + 2.0}, trial.record, trial.pictures, tmp_path)
    assert not found.passes
    assert found.worst.error_mm < -0.2


def test_a_bent_table_is_found_by_the_plane_and_by_lengths(trial: PlateTrial, tmp_path: Path) -> None:
    found = certificate(trial.told, trial.record, trial.again(bend=Bend(1.0, True, 0.0)), tmp_path)
    assert not found.passes
    plane = found.worst_plane
    assert plane is not None
    assert plane.decision is Decision.FAILS


def test_a_camera_that_was_knocked_is_found_by_its_marks(trial: PlateTrial, tmp_path: Path) -> None:
    camera = turned(trial.cell.camera, np.random.default_rng(3), 0.3)
    found = certificate(trial.told, trial.record, trial.again(camera=camera), tmp_path)
    assert not found.passes
    assert [reason for reason, _ in found.findings] == [Reason.SENTINEL_MOVED]
    assert found.fields()["findings"][0]["code"] == 142
    assert "was moved" in certificate_page(Language.ENGLISH, found)


def test_a_block_is_traced_and_its_sides_are_measured(trial: PlateTrial, tmp_path: Path) -> None:
    cell, size = trial.cell, (220.0, 140.0)
    told = block_file(size, HEIGHT_MM, np.random.default_rng(4))
    spots = places(cell, size, HEIGHT_MM, np.random.default_rng(5), 6)
    pictures = [block_picture(cell, size, spot, HEIGHT_MM, seed=number) for number, spot in enumerate(spots)]
    _, _, sights = seen(told, replace(trial.record, sentinels=None), pictures, tmp_path)
    errors = [
        length.measured_mm - known
        for sight in sights
        if sight.gauge is not None
        for length, known in zip(sight.gauge.lengths, size, strict=True)
    ]
    assert len(errors) == 12, [sight.refused for sight in sights]
    assert np.abs(errors).max() < 0.4
