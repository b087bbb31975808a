"""A picture in: the gauge as it shows it, or why it does not serve."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from contour.calibration.calibration import Calibration
from contour.camera_calibration.board_detection import find_board
from contour.errors import ContourError, GaugeNotSeen
from contour.geometry.arrays import Bytes
from contour.image.picture_check import check_picture
from contour.length_test.block import seen_block
from contour.length_test.plate import SeenCorners, seen_plate
from contour.length_test.seen_gauge import SeenGauge
from service.certifying.gauge_file import BlockFile, Gauge, PlateFile
from service.measuring.calibration_guard import CalibrationGuard
from service.measuring.measure import Measurer
from service.reasons import Reason, Rejection

if TYPE_CHECKING:
    from service.config.recipes import Recipe
    from service.measuring.table_file import TableRecord

_BLUR_RATIO, _BLUR_PX = 2.5, 2.0
"""As for views of a calibration: edges that spread twice and a half as far as the sharpest picture's."""


@dataclass(frozen=True, eq=False)
class Sight:
    """One picture: its name and hash, the gauge in it, or the reason why there is none (`refused`).

    `edge_px` is the spread of the plate's edges, None of a block, which the recipe's own limits judge. `marks_px`: the
    farthest fixed mark from its place; None where none is seen, or the calibration has none. `findings`: what speaks
    against the cell, whatever the picture shows of the gauge.
    """

    name: str
    digest: str
    gauge: SeenGauge | None = None
    refused: str = ""
    edge_px: float | None = None
    marks_px: float | None = None
    findings: tuple[Rejection, ...] = ()


class Eye:
    """Looks at pictures of one gauge by one calibration."""

    def __init__(self, gauge: Gauge, guard: CalibrationGuard, recipe: Recipe, table: TableRecord | None = None) -> None:
        self._gauge = gauge
        self._guard = guard
        # A margin, a part, or a limit of area is the job's, not of the outline that is measured here.
        plain = {"margin_mm": 0.0, "part": None, "parts": (), "min_area_mm2": 0.0}
        self._recipe = recipe.model_copy(update=plain)
        self._measurer = Measurer(guard.record.calibration, table=table)

    @property
    def calibration(self) -> Calibration:
        """What pixels become millimetres by."""
        return self._guard.record.calibration

    @property
    def recipe(self) -> Recipe:
        """What a block is traced by."""
        return self._recipe

    def look(self, picture: Bytes, name: str, camera: str = "") -> Sight:
        """What a picture of a camera ("" = not told) shows."""
        digest = f"sha256:{hashlib.sha256(picture.tobytes()).hexdigest()}"
        try:
            check_picture(picture)
            height, width = picture.shape[:2]
            self.calibration.check_fits(width, height)
        except ContourError as error:
            return Sight(name, digest, refused=str(error))
        marks = self._guard.sentinels(picture)
        marks_px = None if marks is None else marks.largest_px
        # That marks are hidden in one picture is the gauge's doing; that none is seen in any is told in the end.
        spoken = (
            self._guard.expired(),
            self._guard.other_camera(camera),
            None if marks_px is None else self._guard.moved(marks),
        )
        findings = tuple(one for one in spoken if one is not None)
        try:
            gauge, edge_px = self._seen(picture)
        except ContourError as error:
            return Sight(name, digest, refused=str(error), marks_px=marks_px, findings=findings)
        return Sight(name, digest, gauge, "", edge_px, marks_px, findings)

    def _seen(self, picture: Bytes) -> tuple[SeenGauge, float | None]:
        file = self._gauge.file
        if isinstance(file, PlateFile):
            return self._plate(picture, file)
        return self._block(picture, file), None

    def _plate(self, picture: Bytes, file: PlateFile) -> tuple[SeenGauge, float]:
        board = file.board.board()
        view = find_board(picture, board)
        # Its own size, as it was calibrated: perspective tells heights by it.
        told = [entry.length_mm / nominal for entry, nominal in zip(file.lengths, file.nominal_mm(), strict=True)]
        plate_mm = board.corners_mm()[view.ids] * float(np.mean(told))
        corners = SeenCorners(view.ids, view.pixels, plate_mm, board.columns, board.rows)
        return seen_plate(corners, file.pairs(), self.calibration, file.height_mm), view.edge_sigma_px

    def _block(self, picture: Bytes, file: BlockFile) -> SeenGauge:
        result = self._measurer.measure(picture, self._recipe, file.height_mm)
        if result.findings or result.pixels is None:
            raise GaugeNotSeen("; ".join(result.texts) or "no outline is traced")
        names = (file.lengths[0].name, file.lengths[1].name)
        sizes = (file.lengths[0].length_mm, file.lengths[1].length_mm)
        return seen_block(result.pixels.exterior, names, sizes, self.calibration, file.height_mm)


def served(sights: Sequence[Sight], *, places_of_their_own: bool = True) -> tuple[list[Sight], list[Sight]]:
    """The sights that serve, and the others with their reasons: blurred against the sharpest, the same place twice.

    Of two in one place the first stays; with `places_of_their_own` False both do, as in a study.
    """
    sharpest = min((sight.edge_px for sight in sights if sight.gauge and sight.edge_px is not None), default=0.0)
    bound = max(_BLUR_RATIO * sharpest, _BLUR_PX)
    kept: list[Sight] = []
    left: list[Sight] = []
    for sight in sights:
        reason = sight.refused
        if sight.gauge is not None and sight.edge_px is not None and not sight.edge_px <= bound:
            reason = (
                f"blurred: its edges spread over {sight.edge_px:.1f} px, those of the sharpest picture {sharpest:.1f} "
                "px. Hold it still, and take it again"
            )
        elif sight.gauge is not None and places_of_their_own:
            gauge = sight.gauge
            twin = next((one for one in kept if one.gauge is not None and gauge.same_place(one.gauge)), None)
            reason = "" if twin is None else f"the gauge lies where it lay in {twin.name}. Move or turn it"
        if reason:
            left.append(Sight(sight.name, sight.digest, None, reason, sight.edge_px, sight.marks_px, sight.findings))
        else:
            kept.append(sight)
    return kept, left


def marks_finding(sights: Sequence[Sight], guard: CalibrationGuard) -> Rejection | None:
    """142 where the calibration has fixed marks, they are required, and no picture shows one."""
    marks = guard.record.sentinels
    if marks is None or not guard.limits.sentinels_required or any(sight.marks_px is not None for sight in sights):
        return None
    return Reason.SENTINEL_MOVED, "None of the fixed marks is seen in any picture. Clear them."
