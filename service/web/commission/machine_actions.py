"""Height, alignment and fixed marks: what is added to the calibration that is in force."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from contour.calibration.fixed_marks import see_sentinels
from contour.camera_calibration.alignment_fit import AlignmentFit, AlignmentLimits, fit_alignment
from contour.camera_calibration.board import DEFAULT_DICTIONARY
from contour.errors import CalibrationError, CalibrationFailed, ContourError
from service.calibrating.alignment import aligned, square_mm
from service.measuring.calibration_file import CalibrationFileError, CalibrationRecord, load_record, save_record
from service.web.commission import models
from service.web.commission.bench import Bench, not_writable
from service.web.commission.board_shots import board_of
from service.web.commission.session import StepRefused


class MachineActions:
    """Each gives what the journal is to say; raises StepRefused."""

    def __init__(self, bench: Bench) -> None:
        self.bench = bench

    async def height(self, asked: models.HeightRequest) -> str:
        """Note how high the block is."""
        self.bench.session.notes.thickness_mm = asked.thickness_mm
        return f"{asked.thickness_mm:g} mm"

    async def point(self, asked: models.PointRequest) -> str:
        """One more place that was jogged to."""
        point = [asked.x_mm, asked.y_mm, asked.machine_x_mm, asked.machine_y_mm]
        session = self.bench.session
        await self.bench.in_thread(lambda: session.keep_points([*session.points, point]))
        return ", ".join(f"{value:g}" for value in point)

    async def forget(self, asked: models.ForgetRequest) -> str:
        """One less."""
        session = self.bench.session

        def work() -> str:
            points = session.points
            if asked.point >= len(points):
                raise StepRefused(f"there is no point {asked.point + 1}")
            session.keep_points(points[: asked.point] + points[asked.point + 1 :])
            return f"point {asked.point + 1} of {len(points)} removed"

        return await self.bench.in_thread(work)

    async def align(self, asked: models.AlignRequest) -> str:
        """The machine frame by all points, in force for the next job."""
        notes, points = self.bench.session.notes, self.bench.session.points

        def fitted(record: CalibrationRecord) -> CalibrationRecord:
            notes.alignment = []
            table = np.array(points, dtype=np.float64).reshape(-1, 4)
            limits = AlignmentLimits(jog_mm=asked.jog_mm, square_mm=square_mm(record))
            try:
                fit = fit_alignment(table[:, :2], table[:, 2:], limits)
            except (CalibrationFailed, CalibrationError) as error:
                raise StepRefused(str(error)) from error
            notes.alignment = _told(fit)
            if fit.refusal is not None:
                raise StepRefused(fit.refusal.text)
            return aligned(record, fit)

        await self._changed(fitted)
        return "; ".join(notes.alignment)

    async def marks(self, asked: models.MarksRequest) -> str:
        """The fixed marks that the camera sees now, in force for the next job."""
        board = self.bench.session.notes.board
        is_board_s = board is not None and board.kind == "charuco" and asked.dictionary == DEFAULT_DICTIONARY
        own = range(board_of(board).marker_count) if is_board_s and board is not None else range(0)

        def seen(record: CalibrationRecord) -> CalibrationRecord:
            picture = self.bench.frame().pixels
            size = (record.calibration.image_width, record.calibration.image_height)
            if (picture.shape[1], picture.shape[0]) != size:
                raise StepRefused(
                    f"the camera gives {picture.shape[1]} x {picture.shape[0]} px, the calibration is for "
                    f"{size[0]} x {size[1]}. Calibrate again"
                )
            try:
                found = see_sentinels(picture, asked.dictionary, without=own)
            except ContourError as error:
                raise StepRefused(str(error)) from error
            if found is None:
                raise StepRefused(f"no mark of {asked.dictionary} is seen. Check its name and the light")
            return replace(record, sentinels=found)

        record = await self._changed(seen)
        assert record.sentinels is not None
        return ", ".join(str(mark.id) for mark in record.sentinels.marks)

    async def _changed(self, change: Callable[[CalibrationRecord], CalibrationRecord]) -> CalibrationRecord:
        """The calibration's file, changed and in force."""
        settings = self.bench.config.calibration
        if settings is None:
            raise StepRefused("the configuration names no calibration.file. Name one")

        def work() -> CalibrationRecord:
            try:
                record = change(load_record(settings.file))
                save_record(settings.file, record)
            except CalibrationFileError as error:
                raise StepRefused(not_writable(error)) from error
            return record

        record = await self.bench.in_thread(work)
        await self.bench.take_effect()
        return record


def _told(fit: AlignmentFit) -> list[str]:
    misses = ", ".join(f"{miss:.3f}" for miss in fit.residuals_mm)
    x, y = fit.alignment.translation_mm
    return [
        f"Points are off by {misses} mm; jogging explains {fit.allowed_mm.min():.3f} mm.",
        f"Turn {fit.alignment.rotation_deg:.4f} degrees, shift {x:.3f}, {y:.3f} mm.",
        f"Scale {fit.scale:.6f}, told and not applied, within {fit.scale_95:.6f} (95 %).",
    ]
