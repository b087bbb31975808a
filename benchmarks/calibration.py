"""Stated against true error of calibrations from rendered boards; `--write` puts the table into the docs.

python -m benchmarks.calibration --cameras 20 --write
"""

from __future__ import annotations

import argparse
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

import cv2
import numpy as np

from contour.board import Board
from contour.board_detection import find_board
from contour.calibrate import CameraResult, Setup, calibrate_camera
from contour.errors import BoardNotSeen
from contour.synthetic import CameraModel, Sensor, camera_above
from contour.synthetic.board_poses import board_poses
from contour.synthetic.board_view import board_camera, render_board

SIZE = (1600, 1200)
BOARD = Board("charuco", 11, 8, 30.0, 21.0, "DICT_5X5_250")
HEIGHTS_MM = (0.0, 20.0, 60.0)
FIRST_SEED = 5000


@dataclass(frozen=True)
class Trial:
    """One camera: true errors of the points inside the covered area, and what the calibration states, by height."""

    seed: int
    tilt_deg: float
    model: str
    judgement: str
    inflation: float
    views: int
    errors_mm: tuple[np.ndarray, ...]
    bounds_mm: tuple[np.ndarray, ...]
    figures_mm: tuple[float, ...]
    halves_mm: float
    seconds: float


def random_camera(rng: np.random.Generator) -> CameraModel:
    """A camera about 1.2 m over a table 600 mm wide, k1 about -0.12, not quite straight."""
    distance = rng.uniform(1000.0, 1400.0)
    return camera_above(
        *SIZE,
        0.375,
        distance_mm=distance,
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
    camera: CameraModel, rng: np.random.Generator, *, tilt_deg: float, count: int = 14, blur_px: float = 0.7
) -> tuple[CameraResult, np.ndarray]:
    """The calibration from rendered views, and where its work frame lies in the camera's table frame, (2,), mm."""
    poses = board_poses(BOARD, camera, count, rng, tilt_deg=tilt_deg)
    views = []
    for number, pose in enumerate(poses):
        sensor = Sensor(blur_px=blur_px)
        picture = render_board(BOARD, board_camera(camera, *pose), sensor=sensor, seed=int(rng.integers(1 << 30)))
        try:
            views.append(find_board(picture, BOARD, f"{number:02d}"))
        except BoardNotSeen as error:
            print(f"  view {number}: {error}")
    result = calibrate_camera(views, BOARD, (camera.width, camera.height), Setup(plane="00"))
    return result, poses[0].translation_mm[:2]


def trial(seed: int, tilt_deg: float) -> Trial:
    """One random camera, calibrated and compared with the truth."""
    cv2.setNumThreads(1)
    rng = np.random.default_rng(seed)
    camera = random_camera(rng)
    started = time.perf_counter()
    result, origin = calibrated(camera, rng, tilt_deg=tilt_deg)
    seconds = time.perf_counter() - started
    across, down = np.meshgrid(np.linspace(0, SIZE[0] - 1, 41), np.linspace(0, SIZE[1] - 1, 31))
    grid = np.column_stack([across.ravel(), down.ravel()])
    grid = grid[result.verdict.zones.inside(grid)]
    sure = result.verdict.uncertainty
    errors, bounds = [], []
    for height in HEIGHTS_MM:
        found = result.calibration.to_work(grid, height)
        errors.append(np.linalg.norm(found - (camera.back_project(grid, height) - origin), axis=1))
        bounds.append(sure.at(grid, height))
    return Trial(
        seed,
        tilt_deg,
        result.model.name,
        result.verdict.judgement.name,
        result.verdict.inflation,
        len(result.views),
        tuple(errors),
        tuple(bounds),
        tuple(sure.figure_mm(height) for height in HEIGHTS_MM),
        float(result.verdict.halves_mm[0].mean()),
        seconds,
    )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cameras", type=int, default=20)
    parser.add_argument("--first", type=int, default=FIRST_SEED)
    parser.add_argument("--tilt", type=float, nargs="+", default=[8.0, 25.0])
    args = parser.parse_args()
    for tilt in args.tilt:
        with ProcessPoolExecutor(2) as pool:
            seeds = range(args.first, args.first + args.cameras)
            trials = list(pool.map(trial, seeds, [tilt] * args.cameras))
        for one in trials:
            print(
                one.seed, one.judgement, one.model, one.views, f"inflation {one.inflation:.2f}", f"{one.seconds:.1f} s"
            )
            for errors, bounds, figure in zip(one.errors_mm, one.bounds_mm, one.figures_mm, strict=True):
                print(
                    f"   mean {errors.mean():.4f} p95 {np.percentile(errors, 95):.4f} worst {errors.max():.4f} "
                    f"figure {figure:.4f} map holds {(errors <= bounds).mean():.2f}"
                )
        for index, height in enumerate(HEIGHTS_MM):
            errors = np.concatenate([one.errors_mm[index] for one in trials])
            bounds = np.concatenate([one.bounds_mm[index] for one in trials])
            figures = np.concatenate([np.full(len(one.errors_mm[index]), one.figures_mm[index]) for one in trials])
            true = float(np.percentile(errors, 95))
            print(
                f"tilt {tilt} h {height}: mean {errors.mean():.4f} p95 {true:.4f} worst {errors.max():.4f}; map holds "
                f"{(errors <= bounds).mean():.3f}, figure holds {(errors <= figures).mean():.3f}, "
                f"figure {np.median(figures):.4f} = {np.median(figures) / true:.2f} x"
            )


if __name__ == "__main__":
    main()
