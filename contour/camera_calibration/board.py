"""The calibration board: its pattern in millimetres, for whoever draws, renders or finds it.

Board frame: millimetres, origin at the outer corner of the lower-left square, x along the lower edge, y up. The
top-left square is black, for both kinds. Inner corners are numbered row by row from the top left, as OpenCV does.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from contour.errors import ParameterError
from contour.geometry.arrays import Float64s
from contour.image.opencv_boards import dictionary_size, known_dictionaries, marker_bits

Kind = Literal["charuco", "chessboard"]
KINDS: tuple[Kind, ...] = get_args(Kind)

FEWEST_SQUARES, MOST_SQUARES = 3, 100
DEFAULT_DICTIONARY = "DICT_5X5_250"
DEFAULT_MARKER_SHARE = 0.7
"""A marker's side as a share of its square's: leaves a white margin wide enough for sub-pixel corners."""


@dataclass(frozen=True)
class Board:
    """A ChArUco board or chessboard of `squares_x` x `squares_y` squares (not inner corners).

    A chessboard needs one even and one odd count: with both even or both odd it looks the same upside down.
    """

    kind: Kind
    squares_x: int
    squares_y: int
    square_mm: float
    marker_mm: float = 0.0
    dictionary: str = ""

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise ParameterError(f"board is {self.kind!r}: expected {' or '.join(KINDS)}")
        counts = (self.squares_x, self.squares_y)
        if not all(FEWEST_SQUARES <= count <= MOST_SQUARES for count in counts):
            raise ParameterError(
                f"squares are {self.name_of_size}: expected {FEWEST_SQUARES} to {MOST_SQUARES} each way. Count "
                "squares, not inner corners"
            )
        if not (np.isfinite(self.square_mm) and 0.5 <= self.square_mm <= 1000):
            raise ParameterError(f"square_mm is {self.square_mm:g}: expected 0.5 to 1000. Measure a square's side")
        if self.kind == "chessboard":
            self._check_chessboard()
        else:
            self._check_markers()

    def _check_chessboard(self) -> None:
        if (self.squares_x - self.squares_y) % 2 == 0:
            parity = "even" if self.squares_x % 2 == 0 else "odd"
            raise ParameterError(
                f"a chessboard of {self.name_of_size} squares is ambiguous: both counts are {parity}, so it looks the "
                "same upside down and its origin is not known. Use one even and one odd count, or a ChArUco board"
            )
        if self.marker_mm or self.dictionary:
            raise ParameterError("marker_mm and dictionary belong to a ChArUco board: leave them out for a chessboard")

    def _check_markers(self) -> None:
        if self.dictionary not in known_dictionaries():
            known = ", ".join(known_dictionaries())
            raise ParameterError(f"dictionary is {self.dictionary!r}: expected one of {known}")
        if not (np.isfinite(self.marker_mm) and 0.3 * self.square_mm <= self.marker_mm <= 0.95 * self.square_mm):
            raise ParameterError(
                f"marker_mm is {self.marker_mm:g} in squares of {self.square_mm:g} mm: expected 0.3 to 0.95 of a square"
            )
        if self.marker_count > dictionary_size(self.dictionary):
            raise ParameterError(
                f"a board of {self.name_of_size} squares needs {self.marker_count} markers, {self.dictionary} has "
                f"{dictionary_size(self.dictionary)}. Use a larger dictionary or fewer squares"
            )

    @property
    def name_of_size(self) -> str:
        """Its squares as people write them: 11x8."""
        return f"{self.squares_x}x{self.squares_y}"

    @property
    def size_mm(self) -> tuple[float, float]:
        """Width and height of all squares together."""
        return self.squares_x * self.square_mm, self.squares_y * self.square_mm

    @property
    def marker_count(self) -> int:
        """Markers of a ChArUco board: one in each white square."""
        return self.squares_x * self.squares_y // 2

    @property
    def columns(self) -> int:
        """Inner corners in a row."""
        return self.squares_x - 1

    @property
    def rows(self) -> int:
        """Rows of inner corners."""
        return self.squares_y - 1

    def corners_mm(self) -> Float64s:
        """Inner corners in the board frame, shape (columns * rows, 2), row by row from the top left."""
        across, down = np.meshgrid(np.arange(1, self.squares_x), np.arange(1, self.squares_y))
        return np.column_stack([across.ravel(), self.squares_y - down.ravel()]).astype(np.float64) * self.square_mm

    def is_black(self, column: int, row: int) -> bool:
        """Colour of the square in this column from the left and row from the top."""
        return (column + row) % 2 == 0

    def marker_squares(self) -> list[tuple[int, int]]:
        """Column and row (from the top) of the square that holds each marker, by its id."""
        places = [(column, row) for row in range(self.squares_y) for column in range(self.squares_x)]
        return [place for place in places if not self.is_black(*place)] if self.kind == "charuco" else []

    def marker_corners_mm(self) -> Float64s:
        """Corners of each marker as OpenCV orders them (from the top left, clockwise as seen), (markers, 4, 2)."""
        half = 0.5 * self.marker_mm
        middles = (np.array(self.marker_squares(), dtype=np.float64).reshape(-1, 2) + 0.5) * self.square_mm
        middles[:, 1] = self.size_mm[1] - middles[:, 1]
        return np.asarray(middles[:, None] + half * np.array([[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]]))

    def black_boxes(self) -> Float64s:
        """Everything black as boxes that do not overlap: left, bottom, right, top, board frame, shape (N, 4), mm."""
        boxes = []
        for row in range(self.squares_y):
            for column in range(self.squares_x):
                if self.is_black(column, row):
                    boxes.append((column, self.squares_y - row - 1, column + 1, self.squares_y - row))
        squares = np.array(boxes, dtype=np.float64) * self.square_mm
        return np.concatenate([squares, *self._marker_boxes()])

    def _marker_boxes(self) -> list[Float64s]:
        return [
            mark_boxes(self.dictionary, number, corners[3], self.marker_mm)
            for number, corners in enumerate(self.marker_corners_mm())
        ]


def mark_boxes(dictionary: str, number: int, lower_left_mm: Float64s, side_mm: float) -> Float64s:
    """The black runs of an ArUco mark as boxes left, bottom, right, top, shape (N, 4), mm."""
    black = ~marker_bits(dictionary, number)
    count = len(black)
    runs = []
    for row, line in enumerate(black):
        edges = np.flatnonzero(np.diff(np.concatenate([[False], line, [False]])))
        runs += [(first, count - row - 1, last, count - row) for first, last in edges.reshape(-1, 2)]
    x, y = lower_left_mm
    return np.asarray(np.array(runs, dtype=np.float64) * (side_mm / count) + np.array([x, y, x, y]))


def described_board(
    kind: Kind,
    squares: tuple[int, int],
    square_mm: float,
    marker_mm: float | None = None,
    dictionary: str | None = None,
) -> Board:
    """The board that somebody describes, `squares` across and up; what they leave out (None) of a ChArUco board's
    markers is usual. Raise ParameterError.
    """
    if kind == "charuco":
        dictionary = DEFAULT_DICTIONARY if dictionary is None else dictionary
        marker_mm = round(DEFAULT_MARKER_SHARE * square_mm, 3) if marker_mm is None else marker_mm
    return Board(kind, *squares, square_mm, marker_mm or 0.0, dictionary or "")
