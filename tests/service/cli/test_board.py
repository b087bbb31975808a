"""The drawn board is the board that is found: at true scale, with its parameters, and a ruler."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree as Xml

import cv2
import numpy as np
import pytest

from contour.camera_calibration.board import Board
from contour.camera_calibration.board_detection import find_board
from contour.synthetic.coverage import area_coverage
from service.cli.main import main
from service.measuring.board_svg import MARGIN_MM, board_svg, ruler_mm
from tests.support.pictures.board_scenes import CHARUCO, CHESSBOARD

SVG = "{http://www.w3.org/2000/svg}"


def drawn(text: str, px_per_mm: float) -> np.ndarray:
    """What a printer makes of the pattern, from the file alone."""
    sheet = Xml.fromstring(text.encode())
    width, height = (float(sheet.attrib[name].removesuffix("mm")) for name in ("width", "height"))
    assert sheet.attrib["viewBox"] == f"0 0 {width:g} {height:g}"
    path = next(one for one in sheet.iter(f"{SVG}path") if one.attrib.get("id") == "pattern").attrib["d"]
    boxes = [tuple(map(float, found)) for found in re.findall(r"M(\S+) (\S+)H(\S+)V(\S+)H\S+z", path)]
    rings = [np.array([(x0, y0), (x0, y1), (x1, y1), (x1, y0)]) * px_per_mm - 0.5 for x0, y0, x1, y1 in boxes]
    black = area_coverage(rings, int(width * px_per_mm), int(height * px_per_mm))
    return cv2.GaussianBlur((230 - 210 * black).astype(np.uint8), (0, 0), 0.8)


@pytest.mark.parametrize("board", [CHARUCO, CHESSBOARD], ids=lambda board: board.kind)
def test_the_drawn_board_is_found_at_true_scale(board: Board) -> None:
    view = find_board(drawn(board_svg(board), 2.0), board)
    bottom = MARGIN_MM + board.size_mm[1]
    mm = (view.pixels + 0.5) / 2.0
    expected = board.corners_mm()[view.ids] * [1, -1] + [MARGIN_MM, bottom]
    assert len(view.ids) == 70
    np.testing.assert_allclose(mm, expected, atol=0.05)


def test_the_sheet_says_its_parameters_and_has_a_ruler(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "board.svg"
    assert main(["board", "--squares", "9x6", "--square-mm", "25", "--output", str(path)]) == 0
    text = path.read_text()
    assert "charuco, 9x6 squares of 25 mm, markers 17.5 mm, DICT_5X5_250" in text
    assert "The ruler must measure 200 mm, the pattern 225 x 150 mm" in text
    assert re.search(r'id="ruler" d="M12 \S+h200M12', text)
    assert "fits A4" in capsys.readouterr().out
    assert ruler_mm(Board("chessboard", 4, 3, 9.0)) == 30


def test_a_board_that_would_be_ambiguous_is_not_drawn(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "board.svg"
    assert main(["board", "--board", "chessboard", "--squares", "8x6", "--output", str(path)]) == 2
    assert "ambiguous: both counts are even" in capsys.readouterr().err
    assert not path.exists()
