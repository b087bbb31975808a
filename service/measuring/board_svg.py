"""The calibration board as an SVG sheet at true scale: pattern, ruler, origin, and its parameters in words."""

from __future__ import annotations

from html import escape

from contour.camera_calibration.board import Board

MARGIN_MM = 12.0
FOOT_MM = 34.0
LONGEST_RULER_MM = 500


def board_svg(board: Board) -> str:
    """The sheet; one unit of its view box is a millimetre."""
    width, height = sheet_size_mm(board)
    boxes = board.black_boxes()
    boards_top = MARGIN_MM
    bottom = boards_top + board.size_mm[1]
    # One path for all that is black: boxes drawn one by one show hairs of white between them.
    path = "".join(
        f"M{MARGIN_MM + left:.4f} {bottom - top:.4f}H{MARGIN_MM + right:.4f}V{bottom - low:.4f}H{MARGIN_MM + left:.4f}z"
        for left, low, right, top in boxes.tolist()
    )
    # A letter is about 0.55 of its size wide: the longest line stays on the sheet.
    letters = max(len(line) for line in parameters(board))
    size = min(3.0, (width - 2 * MARGIN_MM) / (0.55 * letters))
    lines = "".join(
        f'<text x="{MARGIN_MM}" y="{bottom + 19 + 1.4 * size * row:.1f}" font-size="{size:.2f}">{escape(line)}</text>'
        for row, line in enumerate(parameters(board))
    )
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n'
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:g}mm" height="{height:g}mm" '
        f'viewBox="0 0 {width:g} {height:g}" font-family="sans-serif">\n'
        f"<title>{escape(parameters(board)[0])}</title>\n"
        f'<rect width="{width:g}" height="{height:g}" fill="#fff"/>\n'
        f'<path id="pattern" fill="#000" shape-rendering="crispEdges" d="{path}"/>\n'
        f"{_origin(MARGIN_MM, bottom)}\n{_ruler(board, bottom + 8)}\n{lines}\n</svg>\n"
    )


def sheet_size_mm(board: Board) -> tuple[float, float]:
    """Width and height of the sheet."""
    return board.size_mm[0] + 2 * MARGIN_MM, board.size_mm[1] + MARGIN_MM + FOOT_MM


def ruler_mm(board: Board) -> int:
    """Length of the ruler: the longest multiple of 50 mm under the board, of 10 mm where it is small."""
    room = min(board.size_mm[0], LONGEST_RULER_MM)
    return int(room // 50 * 50 if room >= 50 else max(room // 10 * 10, 10))


def parameters(board: Board) -> list[str]:
    """The title block: what a person types, and what the sheet must measure."""
    first = f"combtrace board: {board.kind}, {board.name_of_size} squares of {board.square_mm:g} mm"
    if board.kind == "charuco":
        first += f", markers {board.marker_mm:g} mm, {board.dictionary}"
    return [
        first,
        f"Print at 100 % (never 'fit to page'). The ruler must measure {ruler_mm(board)} mm, the pattern "
        f"{board.size_mm[0]:g} x {board.size_mm[1]:g} mm; else give --square-mm as measured.",
        f"combtrace calibrate {arguments(board)} --plane flat.png --output calibration.yaml *.png",
    ]


def arguments(board: Board) -> str:
    """The board's part of a command line."""
    text = f"--board {board.kind} --squares {board.name_of_size} --square-mm {board.square_mm:g}"
    return text + (f" --marker-mm {board.marker_mm:g} --dictionary {board.dictionary}" if board.marker_mm else "")


def _origin(x: float, y: float) -> str:
    """The work frame's origin and axes, in the margin, so that no corner is touched."""
    return (
        '<g stroke="#000" stroke-width="0.3" fill="none">'
        f'<path d="M{x:g} {y + 2.5:g}h12m-2 -1l2 1l-2 1"/><path d="M{x - 2.5:g} {y:g}v-12m-1 2l1 -2l1 2"/></g>'
        f'<text x="{x + 13:g}" y="{y + 3.5:g}" font-size="3">x</text>'
        f'<text x="{x - 3.3:g}" y="{y - 13:g}" font-size="3">y</text>'
        f'<text x="{x - 4:g}" y="{y + 4:g}" font-size="3">0</text>'
    )


def _ruler(board: Board, y: float) -> str:
    length = ruler_mm(board)
    ticks = "".join(f"M{MARGIN_MM + at:g} {y:g}v{3 if at % 50 == 0 else 2:g}" for at in range(0, length + 1, 10))
    labels = "".join(
        f'<text x="{MARGIN_MM + at:g}" y="{y + 6:g}" font-size="2.8" text-anchor="middle">{at}</text>'
        for at in range(0, length + 1, 50)
    )
    return f'<path id="ruler" d="M{MARGIN_MM:g} {y:g}h{length}{ticks}" stroke="#000" stroke-width="0.2"/>{labels}'
