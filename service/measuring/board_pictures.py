"""Picture files become board views: those that cannot serve are named, with their reason."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from contour.camera_calibration.board import Board
from contour.camera_calibration.board_detection import BoardView, find_board
from contour.camera_calibration.view_selection import Dropped
from contour.errors import BoardNotSeen
from drivers.camera import CameraError
from drivers.camera.files.decode import read_picture

Progress = Callable[[str], None]


class PlaneViewError(Exception):
    """The view that defines the work frame cannot be used: the file, and why."""


@dataclass(frozen=True, eq=False)
class Gathered:
    """The usable views, the others with their reasons, and the plane view's picture with its size (width, height)."""

    views: tuple[BoardView, ...]
    dropped: tuple[Dropped, ...]
    plane: str
    plane_picture: NDArray[np.uint8]

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) of the pictures, px."""
        height, width = self.plane_picture.shape[:2]
        return width, height


def gather_views(plane: Path, images: Sequence[Path], board: Board, on_progress: Progress) -> Gathered:
    """The board views in the plane view and the other pictures; a file named twice is read once.

    Raises PlaneViewError where the plane view does not serve.
    """
    name = str(plane)
    try:
        picture = read_picture(plane)
        views = [find_board(picture, board, name)]
    except (CameraError, BoardNotSeen) as error:
        text = str(error) if str(error).startswith(name) else f"{name}: {error}"
        raise PlaneViewError(f"the --plane view cannot be used: {text}") from error
    others = [path for path in dict.fromkeys(images) if not _same_file(path, plane)]
    on_progress(f"view 1 of {len(others) + 1}: {_told(views[0])}")
    dropped = []
    for number, path in enumerate(others, 2):
        head = f"view {number} of {len(others) + 1}: "
        try:
            view = _view(path, board, picture.shape[:2])
        except (CameraError, BoardNotSeen) as error:
            reason = str(error).removeprefix(f"{path}: ")
            dropped.append(Dropped(str(path), reason))
            on_progress(f"{head}{path}: not used: {reason}")
            continue
        views.append(view)
        on_progress(f"{head}{_told(view)}")
    return Gathered(tuple(views), tuple(dropped), name, picture)


def _view(path: Path, board: Board, shape: tuple[int, ...]) -> BoardView:
    picture = read_picture(path)
    if picture.shape[:2] != shape:
        raise BoardNotSeen(
            f"it is {picture.shape[1]} x {picture.shape[0]} px, the plane view {shape[1]} x {shape[0]}: another "
            "resolution, or another camera"
        )
    return find_board(picture, board, str(path))


def _told(view: BoardView) -> str:
    return f"{view.name}: {len(view.ids)} corners, edges {view.edge_sigma_px:.1f} px wide"


def _same_file(one: Path, other: Path) -> bool:
    return one.resolve() == other.resolve()
