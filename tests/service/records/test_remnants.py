"""What is left of a block is kept with a number, whole and with its bound, and found again by a part that it holds."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import shapely

from contour.geometry.rings import Contour, contour_defect, signed_area
from contour.synthetic import rectangle
from service.cli.main import main
from service.measuring.measurement import Measurement
from service.parts.remnant import Worth, remnants_of
from service.records.remnants import Remnants, RemnantsError
from tests.support.service.cut_block import BLOCK, PART, measured

WORTH = Worth(kerf_mm=3.0, min_area_mm2=1000.0, min_width_mm=15.0)


def shape_of(contour: Contour) -> shapely.Polygon:
    return shapely.Polygon(contour.exterior, list(contour.holes))


def test_what_is_left_is_clear_of_the_parts_by_the_kerf_and_within_the_block() -> None:
    pieces = remnants_of(BLOCK, [PART], WORTH)
    assert len(pieces) == 2, "around the part, and out of its hole"
    block, part = shape_of(BLOCK), shape_of(PART)
    for piece in pieces:
        assert contour_defect(piece) is None
        assert signed_area(piece.exterior) > 0 > max((signed_area(hole) for hole in piece.holes), default=-1.0)
        assert shape_of(piece).difference(block.buffer(2e-2)).is_empty
        assert shape_of(piece).distance(part) >= 3.0 - 2e-2
    around, inner = pieces
    assert shapely.Point(0.0, 0.0).distance(shape_of(around)) < 0.02, "its corners are as they were"
    assert len(around.holes) == 2, "the block's own hole, and where the part was"
    assert shape_of(inner).area == pytest.approx(np.pi * 57.0**2, rel=0.01)


def test_slivers_and_crumbs_are_not_kept() -> None:
    almost_all = rectangle((150.0, 100.0), 286.0, 190.0)  # leaves 4 mm and 2 mm around
    assert remnants_of(BLOCK, [almost_all], WORTH) == ()
    assert remnants_of(BLOCK, [PART], Worth(3.0, 60_000.0, 15.0)) == ()


def test_a_remnant_is_kept_once_and_taken_once(tmp_path: Path) -> None:
    remnants = Remnants(tmp_path / "var" / "remnants.sqlite")
    numbers = remnants.keep("job 7", measured(), WORTH, b"picture")
    assert remnants.keep("job 7", measured(), WORTH, b"picture") == numbers == [1, 2]
    first, second = remnants.all()
    assert (first.source, first.thickness_mm, first.bound_mm, first.used_at) == ("job 7", 25.0, 0.4, None)
    assert first.area_mm2 > second.area_mm2
    assert remnants.picture(2) == b"picture"
    remnants.take(1)
    assert [one.number for one in remnants.all()] == [2]
    assert [one.number for one in remnants.all(used=True)] == [1, 2]
    assert remnants.keep("job 7", measured(), WORTH, b"picture") == [1, 2], "taken, and not there anew"
    assert [one.number for one in remnants.all()] == [2]
    with pytest.raises(RemnantsError, match="no remnant 1, or it was taken before"):
        remnants.take(1)
    with pytest.raises(RemnantsError, match="no picture of a remnant 9"):
        remnants.picture(9)


def test_a_block_without_a_part_leaves_no_remnant(tmp_path: Path) -> None:
    remnants = Remnants(tmp_path / "remnants.sqlite")
    assert remnants.keep("job 8", Measurement("wall-tips", millimetres=BLOCK), WORTH, None) == []
    assert remnants.all() == []


def test_a_file_that_is_no_list_is_told(tmp_path: Path) -> None:
    path = tmp_path / "remnants.sqlite"
    path.write_bytes(b"something else, and long enough to be taken for no database at all " * 20)
    with pytest.raises(RemnantsError, match="cannot be used as list of remnants"):
        Remnants(path).all()
    assert path.read_bytes().startswith(b"something else"), "nothing of it is lost"


# --- the command ------------------------------------------------------------------------------------------------------


@pytest.fixture
def kept(tmp_path: Path) -> Path:
    path = tmp_path / "remnants.sqlite"
    Remnants(path).keep("job 7", measured(), WORTH, b"picture")
    return path


def drawn(folder: Path, side_mm: float) -> Path:
    path = folder / f"square-{side_mm:g}.json"
    ring = [[0, 0], [side_mm, 0], [side_mm, side_mm], [0, side_mm], [0, 0]]
    path.write_text(json.dumps({"type": "Polygon", "coordinates": [ring]}))
    return path


def test_the_smallest_remnant_that_holds_a_part_comes_first(kept: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["remnants", "--file", str(kept), "--part-units", "mm", "--json"]
    assert main([*words, "--fits", str(drawn(kept.parent, 60.0)), "--margin-mm", "5"]) == 0
    found = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [one["number"] for one in found] == [2, 1]
    pieces = [shapely.Polygon(one["millimetres"]["exterior"], one["millimetres"]["holes"]) for one in found]
    for one, piece in zip(found, pieces, strict=True):
        placed = shapely.Polygon(one["fit"]["part_mm"]["exterior"])
        assert piece.contains(placed)
        assert piece.boundary.distance(placed) >= 5.0 + 0.4
    assert main([*words, "--fits", str(drawn(kept.parent, 118.0))]) == 3
    assert capsys.readouterr().out == ""


def test_the_list_is_told_shown_and_taken_from(kept: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["remnants", "--file", str(kept)]
    assert main(words) == 0
    told = capsys.readouterr().out.splitlines()
    assert len(told) == 2
    assert "25 mm high, of job 7" in told[0]
    assert main([*words, "--picture", "1", str(kept.parent / "seen.jpg")]) == 0
    assert (kept.parent / "seen.jpg").read_bytes() == b"picture"
    assert main([*words, "--used", "1"]) == 0
    assert main([*words, "--used", "1"]) == 2
    assert main(words) == 0
    assert "1 " not in capsys.readouterr().out.splitlines()[0][:6]


def test_without_a_list_it_says_what_to_set(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["remnants", "--file", str(tmp_path / "none.sqlite")]) == 2
    assert "there is no such list" in capsys.readouterr().err
