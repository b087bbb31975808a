"""Cells with a calibration of their own, and pictures of gauges on their tables: true figures for acceptance tests.

What is not rendered: a gauge that is bent itself, a lens beyond the calibration's models, a camera that warms up.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from contour.calibration.calibration import CameraCalibration
from contour.calibration.fixed_marks import Sentinels, see_sentinels
from contour.camera_calibration.board import Board, mark_boxes
from contour.camera_calibration.board_detection import BoardView, find_board
from contour.camera_calibration.calibrate import CameraResult, Setup, calibrate_camera
from contour.geometry.arrays import Float64s
from contour.synthetic import CameraModel, camera_above
from contour.synthetic.board_poses import BoardPose, board_poses
from contour.synthetic.board_view import board_camera, render_board, render_flat

SIZE = (1280, 960)
MARKS = "DICT_4X4_50"
_VIEWS, _TILT_DEG = 10, 20.0
MARK_SHARE = 0.035
_EDGE_PX = 12.0


@dataclass(frozen=True, eq=False)
class Cell:
    """A camera over a table, views of a board that it was calibrated by, and its fixed marks.

    Positions are in the camera's table frame, of which the calibration's work frame is a shift.
    """

    camera: CameraModel
    board: Board
    views: tuple[BoardView, ...]
    marks: Sentinels

    @property
    def field_mm(self) -> Float64s:
        """Low and high corner of what the camera sees of the table, shape (2, 2)."""
        return _field_mm(self.camera)

    def calibrated(self, square_mm: float | None = None) -> CameraResult:
        """The calibration from its views; `square_mm`: what somebody takes for the side of the board's squares."""
        told = self.board if square_mm is None else replace(self.board, square_mm=square_mm, marker_mm=0.7 * square_mm)
        return calibrate_camera(list(self.views), told, SIZE, Setup(plane="00"))

    @property
    def known(self) -> CameraCalibration:
        """The calibration that is true, its work frame the camera's table frame."""
        camera = self.camera
        return CameraCalibration(
            image_width=camera.width,
            image_height=camera.height,
            camera_matrix=camera.matrix,
            distortion_coefficients=np.array(camera.distortion),
            rotation_vector=np.array(camera.rotation_vector),
            translation_mm=np.array(camera.translation_mm),
        )


def random_cell(rng: np.random.Generator) -> Cell:
    """A camera 0.9 to 1.5 m over a table 450 to 640 mm wide, with rendered views of a board."""
    bare = bare_cell(rng)
    poses = board_poses(bare.board, bare.camera, _VIEWS, rng, tilt_deg=_TILT_DEG)
    views = [
        find_board(render_board(bare.board, board_camera(bare.camera, *pose), seed=_seed(rng)), bare.board, f"{k:02d}")
        for k, pose in enumerate(poses)
    ]
    return replace(bare, views=tuple(views))


def bare_cell(rng: np.random.Generator) -> Cell:
    """Such a camera without views, neither quite straight nor quite centred."""
    camera = camera_above(
        *SIZE,
        rng.uniform(0.35, 0.5),
        distance_mm=rng.uniform(900.0, 1500.0),
        plane_mm=0.0,
        tilt_deg=(rng.uniform(-3, 3), rng.uniform(-3, 3)),
        roll_deg=rng.uniform(-10, 10),
        distortion=(rng.uniform(-0.15, -0.05), rng.uniform(-0.03, 0.03), *rng.uniform(-5e-4, 5e-4, 2).tolist(), 0.0),
    )
    square = round(0.05 * SIZE[0] * camera.mm_per_px((0.0, 0.0), 0.0), 1)
    board = Board("charuco", 11, 8, square, 0.7 * square, "DICT_5X5_250")
    seen = see_sentinels(render_flat(camera, mark_sheets(camera), seed=_seed(rng)), MARKS)
    assert seen is not None
    return Cell(camera, board, (), seen)


# --- the table --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Bend:
    """A table that is no plane: `high_mm` at the field's border against its middle, about one axis, or as a bowl, there
    at the ends of the field's longer way.
    """

    high_mm: float
    round: bool
    turn_deg: float

    def at(self, points_mm: Float64s, field_mm: Float64s) -> Float64s:
        """Heights of table points, shape (N,)."""
        away, half = points_mm - field_mm.mean(axis=0), np.ptp(field_mm, axis=0) / 2
        along = np.array([np.cos(np.radians(self.turn_deg)), np.sin(np.radians(self.turn_deg))])
        share = np.linalg.norm(away, axis=1) / half.max() if self.round else away @ along / (np.abs(along) @ half)
        return np.asarray(self.high_mm * share**2)


FLAT = Bend(0.0, True, 0.0)


def lying(size_mm: tuple[float, float], place: tuple[float, float, float], cell: Cell, bend: Bend) -> BoardPose:
    """The pose of a stiff rectangle, its own origin a corner, laid with its middle at x, y, turned by degrees."""
    x, y, turn_deg = place
    turn = cv2.Rodrigues(np.array([0.0, 0.0, np.radians(turn_deg)]))[0]
    steps = np.linspace(-0.5, 0.5, 7)
    grid = np.stack(np.meshgrid(steps * size_mm[0], steps * size_mm[1]), axis=-1).reshape(-1, 2)
    under = grid @ turn[:2, :2].T + [x, y]
    heights = bend.at(under, cell.field_mm)
    plane = np.column_stack([under, np.ones(len(under))])
    slope, *_ = np.linalg.lstsq(plane, heights, rcond=None)
    slope[2] += float(
        (heights - plane @ slope).max()
    )  # stiff: it touches where the table is highest, and sinks nowhere
    normal = np.array([-slope[0], -slope[1], 1.0])
    lean = cv2.Rodrigues(np.cross([0.0, 0.0, 1.0], normal / np.linalg.norm(normal)))[0]
    rotation = np.asarray(lean @ turn, np.float64)
    middle = np.array([x, y, float(np.dot(slope, [x, y, 1.0]))])
    return BoardPose(rotation, middle - rotation @ np.array([*size_mm, 0.0]) / 2)


def raised(pose: BoardPose, height_mm: float) -> BoardPose:
    """The plane that lies so much above the pose's own."""
    return BoardPose(pose.rotation, pose.translation_mm + height_mm * pose.rotation[:, 2])


def places(
    cell: Cell, size_mm: tuple[float, float], height_mm: float, rng: np.random.Generator, count: int
) -> list[tuple[float, float, float]]:
    """Where a person lays a rectangle: the middle, the corners of the field, its sides; all of it is seen."""
    low, high = cell.field_mm
    spots = [(0.5, 0.5), (0.1, 0.1), (0.9, 0.9), (0.1, 0.9), (0.9, 0.1), (0.5, 0.1), (0.1, 0.5), (0.9, 0.5), (0.5, 0.9)]
    found = []
    for number in range(count):
        share = np.array(spots[number % len(spots)]) + rng.uniform(-0.05, 0.05, 2)
        turn = 45.0 * number + float(rng.uniform(-12, 12))
        wanted = low + share * (high - low)
        found.append(_inwards(cell, size_mm, height_mm, wanted, turn))
    return found


def _inwards(
    cell: Cell, size_mm: tuple[float, float], height_mm: float, wanted: Float64s, turn: float
) -> tuple[float, float, float]:
    """The place nearest to the wanted one, on the way to the middle, from which all of it is seen."""
    middle = cell.field_mm.mean(axis=0)
    box = np.array([[0, 0], [size_mm[0], 0], size_mm, [0, size_mm[1]]], dtype=np.float64)
    for share in np.linspace(0.0, 1.0, 41):
        x, y = (wanted + share * (middle - wanted)).tolist()
        pose = raised(lying(size_mm, (x, y, turn), cell, FLAT), height_mm)
        seen = board_camera(cell.camera, *pose).project(box, 0.0)
        if (seen > _EDGE_PX).all() and (seen < np.array(SIZE) - _EDGE_PX).all():
            break
    return x, y, turn


# --- what goes wrong --------------------------------------------------------------------------------------------------


def turned(camera: CameraModel, rng: np.random.Generator, degrees: float) -> CameraModel:
    """The camera knocked about any axis through its centre."""
    axis = rng.normal(size=3)
    turn = cv2.Rodrigues(np.radians(degrees) * axis / np.linalg.norm(axis))[0]
    rows = tuple((float(r[0]), float(r[1]), float(r[2])) for r in turn @ np.array(camera.rotation))
    x, y, z = (turn @ np.array(camera.translation_mm)).tolist()
    return replace(camera, rotation=rows, translation_mm=(x, y, z))


def shifted(camera: CameraModel, rng: np.random.Generator, by_mm: float) -> CameraModel:
    """The camera pushed along the table in any direction."""
    angle = rng.uniform(0, 2 * np.pi)
    x, y, z = camera.translation_mm
    return replace(camera, translation_mm=(x + by_mm * float(np.cos(angle)), y + by_mm * float(np.sin(angle)), z))


def mark_sheets(camera: CameraModel) -> list[tuple[Float64s, Float64s]]:
    """Four marks near the corners of what is seen of the table, each on white paper."""
    side = MARK_SHARE * float(np.ptp(_field_mm(camera)[:, 0]))
    width, height = SIZE
    spots = np.array([[0.05, 0.93], [0.93, 0.93], [0.93, 0.06], [0.05, 0.06]]) * [width, height]
    sheets = []
    for number, (x, y) in enumerate(camera.back_project(spots, 0.0) - side / 2):
        paper = np.array([x - side / 4, y - side / 4, x + 1.25 * side, y + 1.25 * side])
        sheets.append((paper, mark_boxes(MARKS, number, np.array([x, y]), side)))
    return sheets


def _field_mm(camera: CameraModel) -> Float64s:
    corners = np.array([[0.0, 0.0], [SIZE[0] - 1.0, SIZE[1] - 1.0]])
    return np.asarray(np.sort(camera.back_project(corners, 0.0), axis=0))


def _seed(rng: np.random.Generator) -> int:
    return int(rng.integers(1 << 30))
