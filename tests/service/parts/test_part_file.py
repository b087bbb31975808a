"""Parts are read from DXF, SVG and GeoJSON as they are drawn; what is wrong with one is told by name and place."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from ezdxf.document import Drawing

from contour.geometry.rings import Contour
from service.export.document import ExportDocument
from service.export.dxf import to_dxf
from service.export.geojson import to_geojson
from service.export.svg import to_svg
from service.parts.part import CHORD_MM, LARGEST_FILE, Asked, PartFileError
from service.parts.part_file import load_part

SQUARE = [(0.0, 0.0), (40.0, 0.0), (40.0, 30.0), (0.0, 30.0)]
Draw = Callable[[Any], object]


def drawing(path: Path, draw: Draw, units: int = 4) -> Path:
    document = Drawing.new()
    document.header["$INSUNITS"] = units
    draw(document.modelspace())
    document.saveas(path)
    return path


def shape_of(contour: Contour) -> shapely.Polygon:
    return shapely.Polygon(contour.exterior, list(contour.holes))


def refusal(path: Path, asked: Asked | None = None) -> str:
    with pytest.raises(PartFileError) as told:
        load_part(path, asked)
    assert str(told.value).startswith(f"{path}: ")
    return str(told.value).removeprefix(f"{path}: ")


def lines(space: Any, points: list[tuple[float, float]]) -> None:
    for start, end in zip(points, [*points[1:], points[0]], strict=True):
        space.add_line(start, end)


def svg(path: Path, body: str, size: str = 'width="100mm" height="50mm" viewBox="0 0 100 50"') -> Path:
    path.write_text(f'<svg xmlns="http://www.w3.org/2000/svg" {size}>{body}</svg>', encoding="utf-8")
    return path


# --- what is read -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("to_file", "ending"), [(to_dxf, "dxf"), (to_svg, "svg"), (to_geojson, "geojson")])
def test_what_is_exported_is_read_as_it_was(tmp_path: Path, to_file: Callable[..., bytes], ending: str) -> None:
    hole = np.array([[5.0, 5.0], [5.0, 12.0], [20.0, 8.0]])
    shift = np.array([100.0, -20.0])
    contour = Contour(np.array(SQUARE) + shift, (hole + shift,))
    path = tmp_path / f"part.{ending}"
    path.write_bytes(to_file(ExportDocument(contour, "a block", 20.0, 0.2)))
    assert shape_of(load_part(path).contour).normalize().equals_exact(shape_of(contour).normalize(), 1e-4)


def test_lines_in_any_order_and_sense_are_joined(tmp_path: Path) -> None:
    def draw(space: Any) -> None:
        for start, end in ((0, 1), (3, 2), (3, 0), (2, 1)):
            space.add_line(SQUARE[start], SQUARE[end])

    part = load_part(drawing(tmp_path / "part.dxf", draw))
    assert shape_of(part.contour).equals(shapely.Polygon(SQUARE))


def test_a_slot_of_lines_and_arcs_with_a_round_hole(tmp_path: Path) -> None:
    def draw(space: Any) -> None:
        space.add_line((0, 0), (50, 0))
        space.add_arc((50, 10), 10, -90, 90)
        space.add_line((50, 20), (0, 20))
        space.add_arc((0, 10), 10, 90, 270)
        space.add_circle((25, 10), 4)
        space.add_text("PART 7")

    contour = load_part(drawing(tmp_path / "part.dxf", draw)).contour
    true = shapely.LineString([(0, 10), (50, 10)]).buffer(10, quad_segs=512) - shapely.Point(25, 10).buffer(4, 512)
    assert len(contour.holes) == 1
    assert shapely.hausdorff_distance(shape_of(contour), true, densify=0.01) < 2 * CHORD_MM + 0.002


@pytest.mark.parametrize("bulge", [1.0, -0.4])
def test_bulges_of_polylines_are_arcs(tmp_path: Path, bulge: float) -> None:
    def draw(space: Any) -> None:
        points = [(0, 0, bulge), (40, 0, 0), (40, 30, bulge / 2), (0, 30, 0)]
        space.add_lwpolyline(points, format="xyb", close=True)

    def sector(chord: float, bulge: float) -> float:
        angle = 4 * math.atan(bulge)
        radius = chord / (2 * math.sin(angle / 2))
        return radius * radius / 2 * (angle - math.sin(angle))

    contour = load_part(drawing(tmp_path / "part.dxf", draw)).contour
    # A bulge to the right of the way adds to what runs counter-clockwise.
    expected = 1200.0 + sector(40.0, bulge) + sector(40.0, bulge / 2)
    assert shape_of(contour).area == pytest.approx(expected, abs=0.5)


def test_splines_ellipses_and_old_polylines(tmp_path: Path) -> None:
    def draw(space: Any) -> None:
        space.add_polyline2d([(-50, -50), (50, -50), (50, 50), (-50, 50)], close=True)
        space.add_ellipse((20, 20), (10, 0), 0.5)
        turn = np.arange(13) * 2 * math.pi / 12
        space.add_spline(np.column_stack([-20 + 10 * np.cos(turn), -20 + 10 * np.sin(turn), 0 * turn]).tolist())

    shape = shape_of(load_part(drawing(tmp_path / "part.dxf", draw)).contour)
    areas = sorted(shapely.Polygon(ring).area for ring in shape.interiors)
    assert areas == pytest.approx([math.pi * 50, math.pi * 100], rel=0.01)


@pytest.mark.parametrize(("code", "factor"), [(1, 25.4), (4, 1.0), (5, 10.0), (6, 1000.0)])
def test_units_of_the_file_count(tmp_path: Path, code: int, factor: float) -> None:
    part = load_part(drawing(tmp_path / "part.dxf", lambda space: lines(space, SQUARE), code))
    assert np.ptp(part.contour.exterior, axis=0) == pytest.approx([40 * factor, 30 * factor])


def test_only_the_layer_that_is_asked_for(tmp_path: Path) -> None:
    def draw(space: Any) -> None:
        space.add_circle((0, 0), 5, dxfattribs={"layer": "CUT"})
        space.add_line((0, 0), (9, 9), dxfattribs={"layer": "HELP"})

    path = drawing(tmp_path / "part.dxf", draw)
    assert shape_of(load_part(path, Asked(layer="CUT")).contour).area == pytest.approx(25 * math.pi, rel=2e-3)
    assert refusal(path, Asked(layer="KUT")) == "has nothing on layer 'KUT', but on CUT, HELP"


def test_svg_is_read_as_it_is_seen(tmp_path: Path) -> None:
    body = (
        '<g id="CUT" transform="translate(10 0) rotate(90)"><rect x="5" y="-40" width="30" height="40"/></g>'
        '<circle cx="30" cy="20" r="5" transform="matrix(1 0 0 1 0 0)"/><title>a part</title>'
    )
    contour = load_part(svg(tmp_path / "part.svg", body)).contour
    assert shape_of(contour).bounds == pytest.approx((10.0, -35.0, 50.0, -5.0), abs=1e-9)
    assert shape_of(contour).area == pytest.approx(1200.0 - 25 * math.pi, abs=0.2)
    alone = load_part(tmp_path / "part.svg", Asked(layer="CUT"))
    assert alone.contour.holes == ()
    assert shape_of(alone.contour).bounds == pytest.approx((10.0, -35.0, 50.0, -5.0))


def test_curves_of_svg_paths(tmp_path: Path) -> None:
    path = svg(tmp_path / "part.svg", '<path d="M10,10 h20 a5 10 0 0 1 0 20 h-20 q-8,-10 0,-20 z"/>')
    # Half an ellipse of 5 by 10, a rectangle of 20 by 20, and a parabola's segment: 2/3 of base times height.
    expected = math.pi * 50 / 2 + 400 + 2 / 3 * 20 * 4
    assert shape_of(load_part(path).contour).area == pytest.approx(expected, abs=0.3)


def test_a_size_in_inches_and_a_view_box_make_the_scale(tmp_path: Path) -> None:
    size = 'width="2in" height="1in" viewBox="0 0 200 100"'
    part = load_part(svg(tmp_path / "part.svg", '<polygon points="0,0 100,0 100,50"/>', size))
    assert part.unit == "in"
    assert np.ptp(part.contour.exterior, axis=0) == pytest.approx([25.4, 12.7])


# --- units are never guessed ------------------------------------------------------------------------------------------


def test_a_file_without_a_unit_needs_to_be_told_one(tmp_path: Path) -> None:
    dxf = drawing(tmp_path / "part.dxf", lambda space: lines(space, SQUARE), 0)
    plain = svg(tmp_path / "part.svg", '<rect width="3" height="4"/>', 'width="100" height="100"')
    geojson = tmp_path / "part.geojson"
    geojson.write_text(json.dumps({"type": "Polygon", "coordinates": [[*SQUARE, SQUARE[0]]]}))
    for path in (dxf, plain, geojson):
        assert refusal(path).startswith("does not say its unit, and none is guessed. Set part.units (--part-units)")
        assert load_part(path, Asked(unit="cm")).unit == "cm"
    assert np.ptp(load_part(dxf, Asked(unit="cm")).contour.exterior, axis=0) == pytest.approx([400.0, 300.0])


def test_units_that_contradict_each_other_and_ones_not_known(tmp_path: Path) -> None:
    path = drawing(tmp_path / "part.dxf", lambda space: lines(space, SQUARE), 1)
    assert refusal(path, Asked(unit="mm")) == "says that it is drawn in in, part.units says mm. Correct one of them"
    assert "unit 3 of $INSUNITS" in refusal(drawing(path, lambda space: lines(space, SQUARE), 3))


# --- bad outlines -----------------------------------------------------------------------------------------------------


def test_an_open_outline_is_told_with_the_place_and_the_gap(tmp_path: Path) -> None:
    def draw(space: Any) -> None:
        space.add_lwpolyline([*SQUARE, (0.0, 0.5)])

    told = refusal(drawing(tmp_path / "part.dxf", draw))
    assert told.startswith("is open: LWPOLYLINE #")
    assert "ends at (0.000, 0.000) mm; the nearest other end is 0.5 mm away, expected 0.01 mm at most" in told


def test_ends_a_few_micrometres_apart_are_joined(tmp_path: Path) -> None:
    path = drawing(tmp_path / "part.dxf", lambda space: space.add_lwpolyline([*SQUARE, (0.0, 0.004)]))
    assert shape_of(load_part(path).contour).area == pytest.approx(1200.0, abs=0.2)


@pytest.mark.parametrize(
    ("draw", "told"),
    [
        (lambda space: [lines(space, SQUARE), space.add_line((0, 0), (40, 0))], "meets 2 other ends at"),
        (lambda space: space.add_lwpolyline([(0, 0), (9, 9), (9, 0), (0, 9)], close=True), "meets itself: edges"),
        (lambda space: space.add_lwpolyline([(0, 0), (9, 9), (0, 0)], close=True), "has 2 vertices, needs 3"),
        (lambda space: space.add_lwpolyline([(0, 0), (9, 9), (5, 5)], close=True), "meets itself"),
        (lambda space: space.add_circle((3, 4), 0.05), "encloses 0.00"),
        (lambda space: [space.add_circle((0, 0), 5), space.add_circle((20, 0), 4)], "holds more than one part: CIRCLE"),
        (lambda space: [space.add_circle((0, 0), r) for r in (9, 6, 3)], "the hole 2 lies inside the hole 1"),
        (lambda space: [space.add_circle((0, 0), 9), space.add_circle((7, 0), 4)], "the exterior and hole 1 meet near"),
        (lambda space: space.add_solid([(0, 0), (1, 0), (1, 1)]), "holds SOLID #"),
        (lambda space: space.add_lwpolyline([(1, 1), (1, 1)]), "has no length"),
        (lambda space: space.add_line((0, 0, 0), (1, 0, 5)), "is not flat: z runs over 5"),
        (lambda space: space.add_text("no part"), "holds no outline"),
        (lambda space: space.add_circle((0, 0), 3e6), "check the units"),
        (lambda space: space.add_circle((0, 2e7), 3.0), "from the drawing's origin"),
    ],
)
def test_what_is_wrong_with_a_drawing_is_told(tmp_path: Path, draw: Draw, told: str) -> None:
    assert told.lower() in refusal(drawing(tmp_path / "part.dxf", draw)).lower()


@pytest.mark.parametrize(
    ("body", "told"),
    [
        ('<path d="M0,0 L9,0 L9,9"/>', "is open: <path> ends at (0.000, 0.000) mm"),
        ('<path id="p7" d="L9,0 nonsense"/>', "<path> 'p7': cannot be drawn"),
        ('<rect width="3mm" height="4"/>', "width is '3mm', expected a number of user units"),
        ('<use href="#a"/>', "holds <use>"),
        ('<g style="display:none"><rect width="3" height="4"/></g>', "is hidden"),
        ('<rect width="3" height="4" transform="turn(3)"/>', "which is none that SVG knows"),
        ('<rect width="3" height="4" transform="scale(0)"/>', "drawn at no size"),
        ('<path d="M0,0 A4e5,4e5 0 1 1 7e5,7e5 Z"/>', "chords, expected 10000 at most"),
        ("", "holds no outline"),
    ],
)
def test_what_is_wrong_with_an_svg_is_told(tmp_path: Path, body: str, told: str) -> None:
    assert told in refusal(svg(tmp_path / "part.svg", body))


@pytest.mark.parametrize(
    ("data", "told"),
    [
        ({"type": "FeatureCollection", "features": []}, "holds 0 features, expected one"),
        ({"type": "Point", "coordinates": [1, 2]}, "a geometry of type 'Point'"),
        ({"type": "Polygon", "coordinates": [SQUARE]}, "is open: ring 0 ends at"),
        ({"type": "Polygon", "coordinates": [[1, 2]]}, "ring 0 holds no list of [x, y]"),
        ([1], "holds no GeoJSON object"),
    ],
)
def test_what_is_wrong_with_a_geojson_is_told(tmp_path: Path, data: Any, told: str) -> None:
    path = tmp_path / "part.geojson"
    path.write_text(json.dumps(data))
    assert told in refusal(path, Asked(unit="mm"))


@pytest.mark.parametrize("ending", ["dxf", "svg", "geojson"])
@pytest.mark.parametrize("data", [b"", b"\x00\xff" * 50, b"0\nSECTION\n2\nENTITIES\n0\nLINE\n", b"<svg", b"[" * 5000])
def test_what_is_no_such_file_is_told(tmp_path: Path, ending: str, data: bytes) -> None:
    path = tmp_path / f"part.{ending}"
    path.write_bytes(data)
    assert refusal(path, Asked(unit="mm"))


def test_a_file_that_is_not_there_or_of_another_form(tmp_path: Path) -> None:
    assert refusal(tmp_path / "part.dxf").startswith("cannot be read: No such file")
    (tmp_path / "part.step").write_text("ISO-10303-21;")
    assert refusal(tmp_path / "part.step") == "has the ending '.step', expected .dxf, .svg, .geojson, .json"
    (tmp_path / "folder.dxf").mkdir()
    assert refusal(tmp_path / "folder.dxf") == "is no file. Name the part's file"


# --- size -------------------------------------------------------------------------------------------------------------


def test_a_hundred_megabytes_are_told_without_being_read(tmp_path: Path) -> None:
    path = tmp_path / "part.dxf"
    with path.open("wb") as file:
        file.truncate(100_000_000)
    assert refusal(path) == f"has 100000000 bytes, expected {LARGEST_FILE} at most. Save the part's outline alone"


def test_thousands_of_lines_make_one_outline(tmp_path: Path) -> None:
    turn = np.arange(5000) * 2 * math.pi / 5000
    points = [(100 * math.cos(angle), 80 * math.sin(angle)) for angle in turn.tolist()]
    contour = load_part(drawing(tmp_path / "part.dxf", lambda space: lines(space, points))).contour
    assert len(contour.exterior) == 5000


def test_too_many_entities_and_points_are_told(tmp_path: Path) -> None:
    def many(space: Any) -> None:
        for k in range(20_001):
            space.add_line((k, 0), (k + 1, 0))

    assert refusal(drawing(tmp_path / "part.dxf", many)).startswith("has 20001 entities, expected 20000 at most")
    ring = [[float(k), float(k * k)] for k in range(20_001)]
    (tmp_path / "part.json").write_text(json.dumps({"type": "Polygon", "coordinates": [[*ring, ring[0]]]}))
    assert "has 20002 points, expected 20000 at most" in refusal(tmp_path / "part.json", Asked(unit="um"))
