"""One random camera, calibrated from rendered views and compared with the truth; and the whole chain through it."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from contour.camera_calibration.board import Board
from contour.camera_calibration.board_detection import find_board
from contour.camera_calibration.calibrate import CameraResult, Setup, calibrate_camera
from contour.geometry.comparison import compare
from contour.geometry.rings import Contour
from contour.polygon.polygon import cutting_polygon
from contour.synthetic import CameraModel, CellGeometry, Scene, Sensor, camera_above, l_shape, rectangle, render
from contour.synthetic.board_poses import board_poses
from contour.synthetic.board_view import board_camera, render_board
from contour.tracing.trace import TraceSettings
from contour.tracing.tracing import trace

SIZE = (1600, 1200)
BOARDS = {
    "charuco": Board("charuco", 11, 8, 30.0, 21.0, "DICT_5X5_250"),
    "chessboard": Board("chessboard", 11, 8, 30.0),
}
VIEWS = 14
HEIGHTS_MM = (0.0, 20.0, 60.0)
TOLERANCE_MM = 0.1


@dataclass(frozen=True)
class Trial:
    """True errors of places inside the covered area, by height, and what the calibration stated for them, mm."""

    seed: int
    model: str
    judgement: str
    inflation: float
    views: int
    errors_mm: tuple[np.ndarray, ...]
    bounds_mm: tuple[np.ndarray, ...]
    figures_mm: tuple[float, ...]


@dataclass(frozen=True)
class ChainTrial:
    """A block of known outline, traced and turned into millimetres by a calibration from rendered views."""

    seed: int
    shape: str
    thickness_mm: float
    mean_mm: float
    p95_mm: float
    worst_mm: float


def random_camera(rng: np.random.Generator) -> CameraModel:
    """A camera over a table 600 mm wide, k1 about -0.12, neither quite straight nor quite centred."""
    return camera_above(
        *SIZE,
        0.375,
        distance_mm=rng.uniform(1000.0, 1400.0),
        plane_mm=0.0,
        tilt_deg=(rng.uniform(-3, 3), rng.uniform(-3, 3)),
        roll_deg=rng.uniform(-10, 10),
        distortion=(
            rng.uniform(-0.15, -0.09),
            rng.uniform(-0.03, 0.03),
            rng.uniform(-5e-4, 5e-4),
            rng.uniform(-5e-4, 5e-4),
            0.0,
        ),
    )


def calibrated(
    camera: CameraModel, rng: np.random.Generator, tilt_deg: float, board: Board
) -> tuple[CameraResult, np.ndarray]:
    """The calibration from rendered views, and where its work frame lies in the camera's table frame, (2,), mm."""
    whole = board.kind == "chessboard"
    poses = board_poses(board, camera, VIEWS, rng, tilt_deg=tilt_deg, whole=whole)
    views = []
    for number, pose in enumerate(poses):
        picture = render_board(board, board_camera(camera, *pose), sensor=Sensor(), seed=int(rng.integers(1 << 30)))
        views.append(find_board(picture, board, f"{number:02d}"))
    result = calibrate_camera(views, board, (camera.width, camera.height), Setup(plane="00"))
    return result, poses[0].translation_mm[:2]


def trial(seed: int, tilt_deg: float, board: str) -> Trial:
    """One random camera."""
    cv2.setNumThreads(1)
    rng = np.random.default_rng(seed)
    camera = random_camera(rng)
    result, origin = calibrated(camera, rng, tilt_deg, BOARDS[board])
    across, down = np.meshgrid(np.linspace(0, SIZE[0] - 1, 41), np.linspace(0, SIZE[1] - 1, 31))
    grid = np.column_stack([across.ravel(), down.ravel()])
    grid = grid[result.verdict.zones.inside(grid)]
    sure = result.verdict.uncertainty
    errors, bounds = [], []
    for height in HEIGHTS_MM:
        found = result.calibration.to_work(grid, height)
        errors.append(np.linalg.norm(found - (camera.back_project(grid, height) - origin), axis=1))
        bounds.append(sure.at(grid, height))
    verdict = result.verdict
    figures = tuple(sure.figure_mm(height) for height in HEIGHTS_MM)
    return Trial(
        seed,
        result.model.name,
        verdict.judgement.name,
        verdict.inflation,
        len(result.views),
        tuple(errors),
        tuple(bounds),
        figures,
    )


def chain_trial(seed: int) -> list[ChainTrial]:
    """Calibrate, then trace blocks 20 and 60 mm thick through the same camera."""
    cv2.setNumThreads(1)
    rng = np.random.default_rng([seed, 7])
    camera = random_camera(rng)
    result, origin = calibrated(camera, rng, 20.0, BOARDS["charuco"])
    shapes = {
        "rectangle": rectangle((300.0, 225.0), 330.0, 240.0, 11.0),
        "L": l_shape((300.0, 225.0), 340.0, 270.0, 120.0, -17.0),
    }
    found = []
    for name, outline in shapes.items():
        for thickness_mm in (20.0, 60.0):
            cells = CellGeometry(pitch_mm=9.5, wall_mm=0.7, warp=0.05, ribbon_deg=12.0, broken=0.003)
            rendered = render(Scene(outline, camera, cells, thickness_mm=thickness_mm, seed=seed))
            rectifier = result.calibration.rectifier(thickness_mm)
            traced = trace(rendered.picture, TraceSettings(), rectifier=rectifier)
            polygon = cutting_polygon(
                traced.contour, result.calibration, height_mm=thickness_mm, tolerance_mm=TOLERANCE_MM
            )
            assert polygon.millimetres is not None
            truth = Contour(outline.exterior - origin, tuple(hole - origin for hole in outline.holes))
            deviation = compare(polygon.millimetres, truth, fit=False)
            found.append(ChainTrial(seed, name, thickness_mm, deviation.mean_mm, deviation.p95_mm, deviation.worst_mm))
    return found
