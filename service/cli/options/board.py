"""Options that describe a board and the size of a camera's pictures."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from service.cli.errors import UserError

if TYPE_CHECKING:
    from contour.camera_calibration.board import Board


def add_board_arguments(parser: argparse._ArgumentGroup | argparse.ArgumentParser, *, required: bool) -> None:
    """What describes a board, for all commands that need one."""
    parser.add_argument("--board", choices=("charuco", "chessboard"), required=required)
    parser.add_argument("--squares", type=_squares, required=required, metavar="WxH", help="squares, not inner corners")
    parser.add_argument("--square-mm", type=float, required=required, metavar="S", help="side of a square, measured")
    parser.add_argument("--marker-mm", type=float, metavar="M", help="side of a marker; default 0.7 squares")
    parser.add_argument("--dictionary", metavar="NAME", help="ArUco dictionary; default DICT_5X5_250")


def board_of(args: argparse.Namespace) -> Board:
    """The board that the arguments describe; raise UserError."""
    from contour.camera_calibration.board import described_board
    from contour.errors import ParameterError

    try:
        return described_board(args.board, args.squares, args.square_mm, args.marker_mm, args.dictionary)
    except ParameterError as error:
        raise UserError(str(error)) from error


def _squares(text: str) -> tuple[int, int]:
    return _two_numbers(text, "squares such as 11x8")


def picture_size(text: str) -> tuple[int, int]:
    """Width and height of `1600x1200`."""
    return _two_numbers(text, "a size such as 1600x1200")


def _two_numbers(text: str, expected: str) -> tuple[int, int]:
    parts = text.lower().replace("×", "x").split("x")
    if len(parts) != 2 or not all(part.strip().isdecimal() and 0 < int(part) <= 100_000 for part in parts):
        raise argparse.ArgumentTypeError(f"{text!r}: expected {expected}")
    return int(parts[0]), int(parts[1])
