"""What the pictures of the board are good for so far: each looked at once, then judged together."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from contour.camera_calibration.board import Board, described_board
from contour.camera_calibration.board_detection import BoardView, find_board
from contour.camera_calibration.coverage_zones import COLUMNS, ROWS, covered_zones
from contour.camera_calibration.view_selection import ViewsSoFar, judge_so_far
from contour.errors import BoardNotSeen, ParameterError
from drivers.camera import CameraError
from drivers.camera.files.decode import read_picture
from service.web.commission.models import BoardRequest
from service.web.commission.models import Shot as ShotTold
from service.web.commission.session import Session, Shot, StepRefused

GOOD_VIEWS = 12
NO_ZONES = [[0] * COLUMNS for _ in range(ROWS)]


@dataclass(frozen=True, eq=False)
class Judged:
    """All pictures as they are told, and what they are good for together."""

    shots: list[ShotTold] = field(default_factory=list)
    so_far: ViewsSoFar | None = None
    zones: list[list[int]] = field(default_factory=lambda: NO_ZONES)

    @property
    def sound(self) -> bool:
        """True where a calibration may come of them."""
        return self.so_far is not None and self.so_far.fault is None

    @property
    def score(self) -> int:
        """Views, sides and places of the picture that there are, of those wanted, in per cent."""
        if self.so_far is None:
            return 0
        thirds = [
            [self.zones[row][column] for row in rows for column in columns]
            for rows in _thirds(ROWS)
            for columns in _thirds(COLUMNS)
        ]
        views = min(len(self.so_far.kept) / GOOD_VIEWS, 1)
        return round(100 * (views + len(self.so_far.raised) / 4 + sum(map(any, thirds)) / 9) / 3)


@dataclass(frozen=True, eq=False)
class _Seen:
    """What one picture shows: (width, height), and the board or why there is none."""

    size: tuple[int, int]
    view: BoardView | None
    why: str | None


class BoardShots:
    """Looks at a session's pictures; in one thread."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._seen: dict[tuple[str, int], _Seen] = {}  # by name and time: a name may come again with another picture
        self._by: Board | None = None

    def judged(self, go_on: Callable[[], None]) -> Judged:
        """As they are now. go_on: called before each picture, raises where nobody wants to know any more."""
        asked, shots = self._session.notes.board, self._session.shots
        if asked is None:
            return Judged([_told(shot, None, None) for shot in shots])
        board = board_of(asked)
        if board != self._by:
            self._seen, self._by = {}, board
        before, self._seen = self._seen, {}
        for shot in shots:
            key = shot.path.name, shot.path.stat().st_mtime_ns
            if key not in before:
                go_on()
            self._seen[key] = before.get(key) or _look(shot, board)
        return self._together(shots, list(self._seen.values()), board)

    def _together(self, shots: list[Shot], seen: list[_Seen], board: Board) -> Judged:
        flat = self._session.flat
        size = next(
            (one.size for shot, one in zip(shots, seen, strict=True) if shot == flat), seen[0].size if seen else (0, 0)
        )
        seen = [one if one.size == size else _of_another_size(one, size) for one in seen]
        views = [one.view for one in seen if one.view is not None]
        if not views:
            return Judged([_told(shot, one, None) for shot, one in zip(shots, seen, strict=True)])
        so_far = judge_so_far(views, board, size, "" if flat is None else flat.path.name)
        kept = [view.pixels for view in views if view.name in so_far.kept]
        zones = covered_zones(kept, size).counts.tolist() if kept else NO_ZONES
        return Judged([_told(shot, one, so_far) for shot, one in zip(shots, seen, strict=True)], so_far, zones)


def board_of(asked: BoardRequest) -> Board:
    """The board that was told; raise StepRefused."""
    marker_mm = asked.marker_mm or None if asked.kind == "charuco" else None
    try:
        return described_board(asked.kind, (asked.squares_x, asked.squares_y), asked.square_mm, marker_mm)
    except ParameterError as error:
        raise StepRefused(str(error)) from error


def _look(shot: Shot, board: Board) -> _Seen:
    try:
        picture = read_picture(shot.path)
    except CameraError as error:
        return _Seen((0, 0), None, str(error).removeprefix(f"{shot.path}: "))
    size = (picture.shape[1], picture.shape[0])
    try:
        return _Seen(size, find_board(picture, board, shot.path.name), None)
    except BoardNotSeen as error:
        return _Seen(size, None, str(error))


def _of_another_size(seen: _Seen, size: tuple[int, int]) -> _Seen:
    why = f"it is {seen.size[0]} x {seen.size[1]} px, the flat view {size[0]} x {size[1]}: the camera was set otherwise"
    return _Seen(seen.size, None, seen.why or why)


def _told(shot: Shot, seen: _Seen | None, so_far: ViewsSoFar | None) -> ShotTold:
    view = None if seen is None else seen.view
    dropped = {} if so_far is None else {one.name: one.reason for one in so_far.dropped}
    why = dropped.get(shot.path.name) if view is not None else None if seen is None else seen.why
    corners = 0 if view is None else len(view.ids)
    return ShotTold(
        number=shot.number, flat=shot.flat, serves=view is not None and why is None, corners=corners, why=why
    )


def _thirds(count: int) -> list[range]:
    return [range(count * third // 3, count * (third + 1) // 3) for third in range(3)]
