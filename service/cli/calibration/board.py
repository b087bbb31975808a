"""`combtrace board`: a calibration board to print, as SVG at true scale."""

from __future__ import annotations

import argparse
from pathlib import Path

from service.cli.errors import EXIT_OK, UserError
from service.cli.options.board import add_board_arguments, board_of

HELP = "draw a calibration board to print"
DESCRIPTION = """\
Draw a ChArUco board or a chessboard as SVG at true scale, with a ruler to check the
print and its parameters below. Print it at 100 %, glue it flat on a stiff plate, and
measure: a board that is bent, or scaled by the printer, spoils every calibration.

A chessboard needs one even and one odd count of squares, or it looks the same upside down."""

PAPERS_MM = {"A4": (210, 297), "A3": (297, 420), "A2": (420, 594), "A1": (594, 841), "A0": (841, 1189)}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The board, and where it goes."""
    add_board_arguments(parser, required=False)
    parser.set_defaults(board="charuco", squares=(11, 8), square_mm=20.0)
    parser.add_argument("--output", type=Path, required=True, metavar="FILE", help="SVG file to write")


def run(args: argparse.Namespace) -> int:
    """Draw and write."""
    from service.measuring.board_svg import arguments, board_svg, sheet_size_mm

    board = board_of(args)
    try:
        args.output.write_text(board_svg(board), encoding="utf-8")
    except OSError as error:
        raise UserError(f"--output {args.output}: cannot be written: {error.strerror}. Name another file") from error
    width, height = sheet_size_mm(board)
    fits = [
        name for name, sides in PAPERS_MM.items() if min(width, height) <= sides[0] and max(width, height) <= sides[1]
    ]
    paper = f"fits {fits[0]}" if fits else "larger than A0: print it on a plate"
    print(f"{args.output}: {board.kind}, {board.name_of_size} squares, sheet {width:g} x {height:g} mm, {paper}")
    print(f"print at 100 %, measure the ruler, then: combtrace calibrate {arguments(board)} …")
    return EXIT_OK
