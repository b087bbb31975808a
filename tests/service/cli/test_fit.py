"""`combtrace fit`: a picture and a part in, whether it fits and where it lies best out."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import shapely

from service.cli.main import main
from service.parts.part import Asked
from service.parts.part_file import load_part
from service.records.remnants import Remnants

SAMPLES = Path(__file__).parents[3] / "service" / "samples"
PICTURE = str(SAMPLES / "4-with-holes.jpg")
CALIBRATION = str(SAMPLES / "calibration.yaml")


@pytest.fixture
def part(tmp_path: Path) -> Path:
    return drawn(tmp_path, 120.0, 80.0)


def drawn(folder: Path, width: float, height: float, unit: str | None = "mm") -> Path:
    path = folder / f"part-{width:g}.geojson"
    ring = [[10.0, 5.0], [10.0 + width, 5.0], [10.0 + width, 5.0 + height], [10.0, 5.0 + height], [10.0, 5.0]]
    feature = {"type": "Feature", "geometry": {"type": "Polygon", "coordinates": [ring]}, "properties": {"unit": unit}}
    if unit is None:
        feature["properties"] = {}
    path.write_text(json.dumps(feature))
    return path


def fit(*words: object) -> int:
    return main(["fit", PICTURE, "--calibration", CALIBRATION, *map(str, words)])


def told(capsys: pytest.CaptureFixture[str]) -> dict[str, Any]:
    return dict(json.loads(capsys.readouterr().out))


def test_a_part_that_fits_is_told_with_its_pose(part: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert fit("--part", part, "--margin-mm", 2, "--json", "-") == 0
    record = told(capsys)
    assert main(["trace", PICTURE, "--calibration", CALIBRATION, "--json", "-"]) == 0
    traced = told(capsys)
    block = shapely.Polygon(traced["millimetres"]["exterior"], traced["millimetres"]["holes"])
    placed = shapely.Polygon(record["part_mm"]["exterior"], record["part_mm"]["holes"])
    assert record["fits"] is True
    assert (record["status"], record["reasons"], record["short_by_mm"]) == ("ok", [], None)
    assert block.contains(placed)
    assert record["margin_mm"] == pytest.approx(placed.distance(block.boundary), abs=1e-6)
    assert record["needed_mm"] >= 2.0 + 2 * traced["uncertainty_mm"] + 0.005 - 1e-9
    assert placed.exterior.distance(shapely.Point(record["tightest_mm"])) < 1e-6
    # The pose moves the part as drawn: first the turn, then the shift.
    pose = record["pose"]
    angle = math.radians(pose["angle_deg"])
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    corner = turn @ [10.0, 5.0] + [pose["x_mm"], pose["y_mm"]]
    assert placed.exterior.distance(shapely.Point(corner)) < 1e-6


def test_a_part_that_does_not_fit_is_told_by_how_much_and_where(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    large = drawn(tmp_path, 400.0, 200.0)
    assert fit("--part", large, "--json", "-") == 3
    captured = capsys.readouterr()
    record = json.loads(captured.out)
    assert (record["fits"], record["reasons"]) == (False, ["part_does_not_fit"])
    assert record["short_by_mm"] == pytest.approx(record["needed_mm"] - record["margin_mm"])
    assert record["pose"] is not None
    assert "119 part_does_not_fit: The part part-400.geojson does not fit: where it lies best it" in captured.err
    assert "short by" in captured.err


def test_margin_and_rotation_are_those_asked_for(part: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert fit("--part", part, "--rotation", "fixed", "--json", "-") == 0
    fixed = told(capsys)
    assert fixed["pose"]["angle_deg"] == 0.0
    assert fit("--part", part, "--rotation", 8, "--json", "-") == 0
    stepped = told(capsys)
    assert stepped["pose"]["angle_deg"] % 45.0 == pytest.approx(0.0, abs=1e-9)
    assert stepped["margin_mm"] >= fixed["margin_mm"] - 1e-3
    assert fit("--part", part, "--ribbon-angle-deg", 30, "--ribbon-tolerance-deg", 1, "--json", "-") == 0
    along = told(capsys)
    assert abs(math.remainder(along["pose"]["angle_deg"] - 30.0, 180.0)) <= 1.0 + 1e-6
    assert fit("--part", part, "--margin-mm", 100, "--json", "-") == 3
    assert told(capsys)["needed_mm"] > 100


def test_the_ribbon_is_read_from_the_picture(part: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Drawn at 85 degrees, in walls as they are warped."""
    plain, seen = tmp_path / "plain.png", tmp_path / "seen.png"
    assert fit("--part", part, "--ribbon-from-picture", "--json", "-", "--overlay", seen) == 0
    captured = capsys.readouterr()
    record = json.loads(captured.out)
    ribbon = record["ribbon"]
    assert (ribbon["told_by"], ribbon["why"]) == ("walls", None)
    assert ribbon["angle_deg"] == pytest.approx(85.0, abs=ribbon["bound_deg"])
    turned = math.remainder(record["pose"]["angle_deg"] - ribbon["angle_deg"], 180.0)
    assert abs(turned) <= 2.0 - ribbon["bound_deg"] + 1e-6
    assert "ribbon at 85." in captured.err
    assert fit("--part", part, "--ribbon-angle-deg", 85, "--json", "-", "--overlay", plain) == 0
    assert "ribbon" not in told(capsys)
    white = [(cv2.imread(str(path)) == 235).all(axis=2).sum() for path in (plain, seen)]
    assert white[1] > white[0] + 300
    assert fit("--part", part, "--ribbon-from-picture", "--ribbon-tolerance-deg", 0.1, "--json", "-") == 3
    refused = told(capsys)
    assert (refused["reasons"], refused["ribbon"]["told_by"]) == (["part_does_not_fit"], "walls")
    assert "degrees only, 0.1 are allowed" in refused["details"][0]


def test_the_overlay_shows_the_part(part: Path, tmp_path: Path) -> None:
    plain, seen = tmp_path / "plain.png", tmp_path / "seen.png"
    assert main(["trace", PICTURE, "--calibration", CALIBRATION, "--overlay", str(plain)]) == 0
    assert fit("--part", part, "--overlay", seen) == 0
    pictures = [cv2.imread(str(path)) for path in (plain, seen)]
    assert pictures[0] is not None
    assert pictures[1] is not None
    violet = (np.abs(pictures[1].astype(int) - (240, 110, 220)).max(axis=2) < 30).sum()
    assert violet > 1000
    assert (np.abs(pictures[0].astype(int) - (240, 110, 220)).max(axis=2) < 30).sum() == 0


def test_a_part_that_fits_is_exported_in_place(part: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = {form: tmp_path / f"laid.{form}" for form in ("dxf", "geojson", "gcode")}
    words = [word for form, file in files.items() for word in (f"--{form}", file)]
    assert fit("--part", part, *words, "--json", "-") == 0
    placed = shapely.Polygon(told(capsys)["part_mm"]["exterior"])
    block, laid = (
        shapely.geometry.shape(one["geometry"]) for one in json.loads(files["geojson"].read_text())["features"]
    )
    assert block.contains(laid)
    assert shapely.hausdorff_distance(laid.exterior, placed.exterior) < 1e-3
    # What was exported is a drawing, too: its layer has the part where it lies.
    again = load_part(files["dxf"], Asked(layer="PART"))
    assert shapely.hausdorff_distance(shapely.Polygon(again.contour.exterior).exterior, placed.exterior) < 1e-3
    assert "(part's exterior, 4 vertices)" in files["gcode"].read_text()
    before = files["dxf"].read_bytes()
    assert fit("--part", part, "--margin-mm", 200, *words) == 3
    assert files["dxf"].read_bytes() == before


def test_a_recipes_part_is_taken_and_changed_by_options(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    drawn(tmp_path, 120.0, 80.0)
    config = tmp_path / "config.yaml"
    config.write_text(
        f"camera: {{kind: files, path: {SAMPLES}}}\ncalibration: {{file: {CALIBRATION}}}\n"
        "controller: {kind: none}\n"
        "recipes: [{number: 1, name: one, part: {file: part-120.geojson, margin_mm: 3, rotation: fixed}}]\n"
    )
    assert main(["fit", PICTURE, "--config", str(config), "--json", "-"]) == 0
    record = told(capsys)
    assert record["pose"]["angle_deg"] == 0.0
    assert record["needed_mm"] > 3.0
    assert main(["fit", PICTURE, "--config", str(config), "--margin-mm", "90", "--json", "-"]) == 3
    capsys.readouterr()
    assert main(["trace", PICTURE, "--config", str(config), "--json", "-"]) == 0
    assert told(capsys)["part"]["pose"] == record["pose"]


def test_a_refused_block_has_no_pose(tmp_path: Path, part: Path, capsys: pytest.CaptureFixture[str]) -> None:
    empty = tmp_path / "empty.png"
    cv2.imwrite(str(empty), np.full((1200, 1600), 40, np.uint8))
    assert main(["fit", str(empty), "--part", str(part), "--calibration", CALIBRATION, "--json", "-"]) == 3
    record = told(capsys)
    assert (record["fits"], record["pose"], record["part_mm"], record["short_by_mm"]) == (False, None, None, None)
    assert record["status"] == "refused"


@pytest.mark.parametrize(
    ("words", "text"),
    [
        ([], "which part? Name its drawing by --part"),
        (["--part", "none.dxf"], "none.dxf: cannot be read: No such file or directory"),
        (["--part", "{part}", "--rotation", "0"], "part: rotation"),
        (["--part", "{part}", "--rotation", "fixed", "--ribbon-angle-deg", "45"], "none of its 1 angles leaves"),
        (["--part", "{part}", "--part-units", "in"], "says that it is drawn in mm, part.units says in"),
        (["--part", "{part}", "--json", "{part}"], "is a file that is read"),
        (["--part", "{part}", "--margin-mm", "-1"], "part: margin_mm"),
    ],
)
def test_what_cannot_be_asked_is_told(
    part: Path, words: list[str], text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert fit(*(word.format(part=part) for word in words)) == 2
    assert text in capsys.readouterr().err


def test_a_part_needs_millimetres(part: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fit", PICTURE, "--part", str(part)]) == 2
    assert "a part is in millimetres: name the calibration" in capsys.readouterr().err


def test_a_picture_that_is_not_there_is_told_once(part: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fit", "none.png", "--part", str(part), "--calibration", CALIBRATION, "--json", "-"]) == 2
    captured = capsys.readouterr()
    assert json.loads(captured.out)["status"] == "error"
    assert captured.err.startswith("combtrace fit: none.png: cannot be read")


def test_a_unit_that_the_drawing_does_not_say(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    unsaid = drawn(tmp_path, 12.0, 8.0, None)
    assert fit("--part", unsaid) == 2
    assert "does not say its unit, and none is guessed" in capsys.readouterr().err
    assert fit("--part", unsaid, "--part-units", "cm", "--json", "-") == 0
    exterior = np.array(told(capsys)["part_mm"]["exterior"])
    assert np.hypot(*(exterior[1] - exterior[0])) == pytest.approx(120.0)


def test_what_is_left_of_the_block_is_noted_and_holds_the_next_part(
    part: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    remnants = tmp_path / "remnants.sqlite"
    assert fit("--part", part, "--margin-mm", 2, "--remnants", remnants, "--kerf-mm", 3, "--json", "-") == 0
    told_of_it = capsys.readouterr()
    first = json.loads(told_of_it.out)
    assert "[remnants 1" in told_of_it.err
    assert main(["remnants", "--file", str(remnants), "--fits", str(drawn(tmp_path, 60.0, 30.0)), "--json"]) == 0
    second = json.loads(capsys.readouterr().out.splitlines()[0])["fit"]
    one, two = (shapely.Polygon(of["part_mm"]["exterior"], of["part_mm"]["holes"]) for of in (first, second))
    assert one.distance(two) >= 3.0 - 0.02
    remnant = cv2.imdecode(np.frombuffer(Remnants(remnants).picture(1), np.uint8), cv2.IMREAD_COLOR)
    assert remnant.shape[2] == 3
