"""Which board views a calibration is made of, and why the others are left out, each by its name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from contour.camera_calibration.board import Board
from contour.camera_calibration.board_detection import BoardView
from contour.camera_calibration.lens_models import BROAD, Observed, residuals, solve
from contour.errors import CalibrationFailed
from contour.geometry.arrays import Float64s
from contour.image.opencv import rotation_matrix
from contour.image.opencv_boards import Solved

FEWEST_VIEWS = 8
"""Two halves of four views each, the fewest that give a camera of their own."""

_DUPLICATE_PX = 1.0
_BLUR_RATIO, _BLUR_PX = 2.5, 2.0
_OUTLIER_RATIO, _OUTLIER_PX = 3.0, 0.1
_MOST_OUTLIERS = 1 / 3
_LEAST_TURN_DEG = 3.0
_TILTED_DEG = 6.0
_FEWEST_FOR_A_POSE = 3
"""Views that a camera can be solved from at all (Zhang, 2000): enough to tell to which side a board is tilted."""

Side = Literal["left", "right", "top", "bottom"]
SIDES: tuple[Side, ...] = get_args(Side)


@dataclass(frozen=True)
class Dropped:
    """A view that was left out, and why."""

    name: str
    reason: str


@dataclass(frozen=True)
class ViewsSoFar:
    """What views are good for that are not all there yet: `kept` and `dropped` by name, and the sides of the picture at
    which the board was raised in some view. `fault`: why no calibration comes of them now; None = one may."""

    kept: tuple[str, ...]
    dropped: tuple[Dropped, ...]
    raised: frozenset[Side]
    fault: str | None


def judge_so_far(views: Sequence[BoardView], board: Board, size: tuple[int, int], plane: str) -> ViewsSoFar:
    """What a calibration of these views of (width, height) px would keep and lacks. `plane` names the one that lies
    flat; outliers are looked for once there are views enough."""
    kept, dropped = list(views), list[Dropped]()
    try:
        for without in (without_blurred, without_duplicates):
            kept, left = without(kept, plane) if kept else ([], [])
            dropped += left
        check_count(kept, dropped)
        kept, left = without_outliers(kept, board, size, plane)
        dropped += left
        check_count(kept, dropped)
        fault = None
    except CalibrationFailed as error:
        fault = str(error)
    raised = _raised_sides(kept, board, size, plane)
    return ViewsSoFar(tuple(view.name for view in kept), tuple(dropped), raised, fault)


def _raised_sides(views: Sequence[BoardView], board: Board, size: tuple[int, int], plane: str) -> frozenset[Side]:
    """At which sides of the picture the board stood higher than when it lay flat."""
    names = [view.name for view in views]
    solved = solve(observe(views, board), size, BROAD) if len(views) >= _FEWEST_FOR_A_POSE else None
    if solved is None or plane not in names:
        return frozenset()
    normals = np.array([rotation_matrix(rotation)[:, 2] for rotation in solved.rotations])
    leans = normals - normals[names.index(plane)]  # in the camera's frame: x right, y down
    least = np.sin(np.radians(_TILTED_DEG))
    x, y = leans[:, 0], leans[:, 1]
    # A board that looks to the right has its left side raised.
    found: dict[Side, np.bool_] = {
        "left": (x > least).any(),
        "right": (x < -least).any(),
        "top": (y > least).any(),
        "bottom": (y < -least).any(),
    }
    return frozenset(side for side, seen in found.items() if seen)


def without_blurred(views: Sequence[BoardView], plane: str) -> tuple[list[BoardView], list[Dropped]]:
    """The views whose edges are about as sharp as the others'; raise where the plane view is not."""
    usual = float(np.median([view.edge_sigma_px for view in views]))
    bound = max(_BLUR_RATIO * usual, _BLUR_PX)
    kept: list[BoardView] = []
    dropped: list[Dropped] = []
    for view in views:
        if view.edge_sigma_px <= bound:
            kept.append(view)
            continue
        reason = f"blurred: its edges spread over {view.edge_sigma_px:.1f} px, those of the other views {usual:.1f} px"
        _spare_plane(view.name, plane, reason)
        dropped.append(Dropped(view.name, reason))
    return kept, dropped


def without_duplicates(views: Sequence[BoardView], plane: str) -> tuple[list[BoardView], list[Dropped]]:
    """The views that show the board in places of their own; of two alike the plane view stays, else the first."""
    kept: list[BoardView] = []
    dropped: list[Dropped] = []
    for view in sorted(views, key=lambda one: one.name != plane):
        twin = next((other for other in kept if _same_place(view, other)), None)
        if twin is None:
            kept.append(view)
        else:
            dropped.append(Dropped(view.name, f"a duplicate: it shows the board where {twin.name} shows it"))
    return kept, dropped


def _same_place(one: BoardView, other: BoardView) -> bool:
    shared, first, second = np.intersect1d(one.ids, other.ids, return_indices=True)
    if len(shared) < 0.8 * max(len(one.ids), len(other.ids)):
        return False
    return float(np.linalg.norm(one.pixels[first] - other.pixels[second], axis=1).mean()) < _DUPLICATE_PX


def without_outliers(
    views: Sequence[BoardView], board: Board, size: tuple[int, int], plane: str
) -> tuple[list[BoardView], list[Dropped]]:
    """The views that agree on one camera; the worst is left out and all solved anew, until none stands out.

    Raises CalibrationFailed where the plane view is one, or where more than a third of the views are.
    """
    kept, dropped = list(views), list[Dropped]()
    most = int(len(views) * _MOST_OUTLIERS)
    while True:
        errors = _errors_px(kept, board, size)
        worst = int(np.argmax(errors))
        usual = float(np.median(np.delete(errors, worst)))
        if errors[worst] <= max(_OUTLIER_RATIO * usual, _OUTLIER_PX):
            return kept, dropped
        reason = f"an outlier: its corners miss the camera model by {errors[worst]:.2f} px, the others' by {usual:.2f}"
        _spare_plane(kept[worst].name, plane, reason)
        if len(dropped) == most:
            raise CalibrationFailed(
                f"more than a third of the views contradict the others (next: {kept[worst].name}, {reason}). Is the "
                "board flat and stiff, the camera's focus fixed, and is it one camera and one board throughout?"
            )
        dropped.append(Dropped(kept.pop(worst).name, reason))


def _errors_px(views: Sequence[BoardView], board: Board, size: tuple[int, int]) -> Float64s:
    observed = observe(views, board)
    solved = solve(observed, size, BROAD)
    if solved is None:
        raise CalibrationFailed(no_camera(len(views)))
    return np.array([float(np.sqrt((miss**2).sum(axis=1).mean())) for miss in residuals(observed, solved)])


def observe(views: Sequence[BoardView], board: Board) -> list[Observed]:
    """The views as numbers."""
    return [Observed(view.corners_mm(board), view.pixels) for view in views]


def no_camera(count: int) -> str:
    """What to say where the solver finds no camera."""
    return (
        f"no camera fits these {count} views: the board must be tilted to different sides, about 20 degrees, in "
        "several of them. Take more views"
    )


def check_count(views: Sequence[BoardView], dropped: Sequence[Dropped]) -> None:
    """Raise where too few views are left."""
    if len(views) >= FEWEST_VIEWS:
        return
    why = "".join(f"; {one.name}: {one.reason}" for one in dropped)
    raise CalibrationFailed(
        f"too few views: {len(views)} can be used, {FEWEST_VIEWS} or more are needed (12 to 20 are good). Take "
        f"more{why}"
    )


def check_turned(solved: Solved) -> float:
    """The largest angle between two boards, degrees; raise where all lie parallel.

    Parallel views do not tell the focal length from the distance (Zhang, 2000, section 4.4).
    """
    normals = np.array([rotation_matrix(rotation)[:, 2] for rotation in solved.rotations])
    cosines = np.clip(normals @ normals.T, -1, 1)
    widest = float(np.degrees(np.arccos(cosines.min())))
    if widest < _LEAST_TURN_DEG:
        raise CalibrationFailed(
            f"all views are parallel: their boards differ by {widest:.1f} degrees at most, so the focal length cannot "
            "be told from the distance. Tilt the board to all four sides by about 20 degrees in most views"
        )
    return widest


def _spare_plane(name: str, plane: str, reason: str) -> None:
    if name == plane:
        raise CalibrationFailed(
            f"{name}, the --plane view, cannot be used: {reason}. Take that view again, the board flat on the table"
        )
