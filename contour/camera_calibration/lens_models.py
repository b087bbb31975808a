"""Camera models of rising order, and which of them the views support: by cross-validation, not by least residual."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from contour.geometry.arrays import Float64s
from contour.image import opencv_boards as cv
from contour.image.opencv import project

Progress = Callable[[str], None]


@dataclass(frozen=True)
class LensModel:
    """Which distortion coefficients are free (indices in OpenCV's order), and whether pixels are taken as square."""

    name: str
    free: tuple[int, ...]
    flags: int
    square_pixels: bool = True

    @property
    def size(self) -> int:
        """Length of its distortion vector."""
        return 8 if max(self.free, default=0) > 4 else 5

    @property
    def parameter_count(self) -> int:
        """Free numbers of the camera: focal length, centre, distortion."""
        return len(self.free) + (3 if self.square_pixels else 4)


def _model(name: str, *free: int) -> LensModel:
    flags = cv2.CALIB_FIX_ASPECT_RATIO
    fixed = {0: cv2.CALIB_FIX_K1, 1: cv2.CALIB_FIX_K2, 2: cv2.CALIB_ZERO_TANGENT_DIST, 4: cv2.CALIB_FIX_K3}
    for index, flag in fixed.items():
        if index not in free:
            flags |= flag
    if 5 in free:
        flags |= cv2.CALIB_RATIONAL_MODEL
    return LensModel(name, free, flags)


MODELS = (
    _model("no distortion"),
    _model("k1", 0),
    _model("k1 k2", 0, 1),
    _model("k1 k2 p1 p2", 0, 1, 2, 3),
    _model("k1 k2 p1 p2 k3", 0, 1, 2, 3, 4),
    _model("rational", 0, 1, 2, 3, 4, 5, 6, 7),
)
BROAD = MODELS[3]
"""Serves to find outliers before the order is chosen."""


def with_free_aspect(model: LensModel) -> LensModel:
    """The same model for pixels that need not be square."""
    flags = model.flags & ~cv2.CALIB_FIX_ASPECT_RATIO
    return LensModel(f"{model.name}, pixels not square", model.free, flags, square_pixels=False)


_CLEARLY = 3.0
"""Sensors have square pixels: that they are not must be seen at three standard errors."""


@dataclass(frozen=True, eq=False)
class Observed:
    """One view as numbers: corners on the board (N, 3), mm, and their pixels (N, 2)."""

    points_mm: Float64s
    pixels: Float64s

    def half(self, which: int) -> Observed:
        """Every other corner: 0 or 1."""
        return Observed(self.points_mm[which::2], self.pixels[which::2])


def solve(
    views: Sequence[Observed], size: tuple[int, int], model: LensModel, guess: tuple[Float64s, Float64s] | None = None
) -> cv.Solved | None:
    """The camera that fits the views best under the model, or None where there is no solution."""
    if guess is not None:
        distortion = np.zeros(model.size)
        kept = [index for index in model.free if index < len(guess[1])]
        distortion[kept] = guess[1][kept]
        matrix = guess[0].copy()
        if model.square_pixels:
            matrix[0, 0] = matrix[1, 1]
        guess = (matrix, distortion)
    solved = cv.solve_camera([v.points_mm for v in views], [v.pixels for v in views], size, model.flags, guess)
    if solved is None or min(solved.camera_matrix[0, 0], solved.camera_matrix[1, 1]) <= 0:
        return None
    return solved._replace(distortion=solved.distortion[: model.size])


@dataclass(frozen=True)
class Trial:
    """How a model did on views it had not seen: root mean square error, px, and the same on those it was fitted to."""

    model: LensModel
    unseen_px: float
    fitted_px: float


def choose_model(
    views: Sequence[Observed], size: tuple[int, int], folds: int, on_progress: Progress
) -> tuple[LensModel, list[Trial]]:
    """The simplest model whose error on unseen views is within one standard error of the best one's.

    Views are left out in `folds` turns. The standard error is that of the paired difference over views (the rule of one
    standard error, Breiman et al., 1984). Last, pixels that are not square are tried for the chosen order.
    """
    errors: list[tuple[LensModel, Float64s]] = []
    trials: list[Trial] = []
    for model in MODELS:
        on_progress(f"cross-validating the lens model '{model.name}'")
        trial, squares = _try(views, size, model, folds)
        trials.append(trial)
        errors.append((model, squares))
    chosen = _simplest(errors)
    free = with_free_aspect(chosen)
    on_progress(f"cross-validating the lens model '{free.name}'")
    trial, squares = _try(views, size, free, folds)
    trials.append(trial)
    gain = next(error for model, error in errors if model is chosen) - squares
    clearly = gain.mean() > _CLEARLY * gain.std(ddof=1) / np.sqrt(len(gain))
    return (free if clearly else chosen), trials


def _simplest(errors: list[tuple[LensModel, Float64s]]) -> LensModel:
    finite = [(model, squares) for model, squares in errors if np.isfinite(squares).all()]
    if not finite:
        return errors[0][0]
    best = min((squares for _, squares in finite), key=lambda squares: float(squares.mean()))
    for model, squares in finite:
        excess = squares - best
        if excess.mean() <= excess.std(ddof=1) / np.sqrt(len(excess)):
            return model
    return finite[-1][0]


def _try(views: Sequence[Observed], size: tuple[int, int], model: LensModel, folds: int) -> tuple[Trial, Float64s]:
    """The trial, and the mean square error of each view when it was left out."""
    squares = np.full(len(views), np.inf)
    whole = solve(views, size, model)
    if whole is None:
        return Trial(model, float("inf"), float("inf")), squares
    fitted = np.concatenate(residuals(views, whole))
    for fold in range(folds):
        held = list(range(fold, len(views), folds))
        rest = [view for index, view in enumerate(views) if index not in held]
        solved = solve(rest, size, model, (whole.camera_matrix, whole.distortion))
        for index in held if solved is not None else []:
            assert solved is not None
            squares[index] = _unseen(views[index], solved)
    unseen = float(np.sqrt(squares.mean()))
    return Trial(model, unseen, float(np.sqrt((fitted**2).sum(axis=1).mean()))), squares


def _unseen(view: Observed, solved: cv.Solved) -> float:
    """Mean square error of a view: the pose from one half of its corners, the error on the other, both ways."""
    total = 0.0
    for which in (0, 1):
        known, asked = view.half(which), view.half(1 - which)
        pose = cv.solve_pose(known.points_mm, known.pixels, solved.camera_matrix, solved.distortion)
        miss = asked.pixels - project(asked.points_mm, *pose, solved.camera_matrix, solved.distortion)
        total += float((miss**2).sum())
    return total / len(view.pixels)


def residuals(views: Sequence[Observed], solved: cv.Solved) -> list[Float64s]:
    """Seen less expected pixels of each view, shape (N, 2)."""
    return [
        view.pixels - project(view.points_mm, rotation, translation, solved.camera_matrix, solved.distortion)
        for view, rotation, translation in zip(views, solved.rotations, solved.translations, strict=True)
    ]
