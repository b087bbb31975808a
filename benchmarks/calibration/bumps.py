"""Fixed marks: whether bumps are caught, noise is not, and how long a look takes."""

from __future__ import annotations

import time
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import cv2
import numpy as np

from contour.calibration.fixed_marks import Sentinels, check_sentinels, see_sentinels
from contour.camera_calibration.board import mark_boxes
from contour.synthetic import CameraModel, camera_above
from contour.synthetic.board_view import render_flat

TOLERANCE_PX = 1.0
MARK_MM = 24.0
PLACES_MM = ((20.0, 30.0), (555.0, 20.0), (25.0, 390.0), (550.0, 395.0))
BUMPS, REPEATS = 30, 50


@dataclass(frozen=True)
class Bumps:
    """Of turns by 0.3 degrees and of shifts by 2 px, how many were caught, and the least offset seen; of still pictures
    how many raised an alarm, and the largest offset; milliseconds of one core a look at 12 MP, median."""

    tried: int
    turns_caught: int
    least_turn_px: float
    shifts_caught: int
    least_shift_px: float
    repeats: int
    alarms: int
    largest_still_px: float
    look_ms: float


def measure_bumps(rng: np.random.Generator, pool: Executor) -> Bumps:
    """All of it, over one camera of 1600 x 1200 px and one of 4000 x 3000."""
    look = pool.submit(_look_ms)
    camera = camera_above(1600, 1200, 0.375, plane_mm=0.0, tilt_deg=(2.0, -1.5), distortion=(-0.12, 0.0, 0.0, 0.0, 0.0))
    seen = see_sentinels(_marked(camera, 1), "DICT_4X4_50")
    assert seen is not None
    cameras = [_turned(camera, rng) for _ in range(BUMPS)] + [_shifted(camera, rng) for _ in range(BUMPS)]
    cameras += [camera] * REPEATS
    offsets = list(pool.map(_largest, cameras, range(2, 2 + len(cameras)), [seen] * len(cameras)))
    turns, shifts, still = offsets[:BUMPS], offsets[BUMPS : 2 * BUMPS], offsets[2 * BUMPS :]
    return Bumps(
        BUMPS,
        sum(one > TOLERANCE_PX for one in turns),
        min(turns),
        sum(one > TOLERANCE_PX for one in shifts),
        min(shifts),
        REPEATS,
        sum(one > TOLERANCE_PX for one in still),
        max(still),
        look.result(),
    )


def _largest(camera: CameraModel, seed: int, seen: Sentinels) -> float:
    cv2.setNumThreads(1)
    found = check_sentinels(_marked(camera, seed), seen).largest_px
    return 0.0 if found is None else found


def _look_ms() -> float:
    cv2.setNumThreads(1)
    camera = camera_above(4000, 3000, 0.15, plane_mm=0.0)
    picture = _marked(camera, 1)
    seen = see_sentinels(picture, "DICT_4X4_50")
    assert seen is not None
    times = []
    for _ in range(15):
        started = time.process_time()
        check_sentinels(picture, seen)
        times.append((time.process_time() - started) * 1000)
    return float(np.median(times))


def _marked(camera: CameraModel, seed: int) -> np.ndarray:
    sheets = []
    for number, (x, y) in enumerate(PLACES_MM):
        paper = np.array([x - 6, y - 6, x + MARK_MM + 6, y + MARK_MM + 6])
        sheets.append((paper, mark_boxes("DICT_4X4_50", number, np.array([x, y]), MARK_MM)))
    return render_flat(camera, sheets, seed=seed)


def _turned(camera: CameraModel, rng: np.random.Generator) -> CameraModel:
    """By 0.3 degrees about any axis through the camera."""
    axis = rng.normal(size=3)
    turn = cv2.Rodrigues(np.radians(0.3) * axis / np.linalg.norm(axis))[0]
    rows = tuple((float(r[0]), float(r[1]), float(r[2])) for r in turn @ np.array(camera.rotation))
    x, y, z = (turn @ np.array(camera.translation_mm)).tolist()
    return replace(camera, rotation=rows, translation_mm=(x, y, z))


def _shifted(camera: CameraModel, rng: np.random.Generator) -> CameraModel:
    """By 2 px in any direction."""
    angle = rng.uniform(0, 2 * np.pi)
    x, y = camera.centre_px
    return replace(camera, centre_px=(x + 2.0 * float(np.cos(angle)), y + 2.0 * float(np.sin(angle))))
