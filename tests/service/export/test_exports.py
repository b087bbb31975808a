"""Exports read back by programs that others wrote: GDAL reads DXF and GeoJSON, librsvg draws SVG, ezdxf audits."""

from __future__ import annotations

import io
import json
import subprocess
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import cv2
import ezdxf
import numpy as np
import pyogrio
import pytest
import shapely

from contour.geometry.rings import Contour, area
from service.cli.main import main
from service.export.document import ExportDocument, ExportError
from service.export.dxf import to_dxf
from service.export.files import write_export
from service.export.geojson import to_geojson
from service.export.svg import LINE_MM, MARGIN_MM, to_svg
from tests.support.real_parts import need_program

EXTERIOR = np.array([[-10.0, 5.0], [90.1234, 5.0], [90.0, 65.0], [40.0, 50.5], [-10.0, 60.0]])
HOLES = (
    np.array([[10.0, 20.0], [10.0, 30.0], [25.0, 30.0]]),
    np.array([[60.0, 20.0], [55.0, 25.0], [60.0, 30.0], [65.0, 25.0]]),
)
CONTOUR = Contour(EXTERIOR, HOLES)
DOCUMENT = ExportDocument(CONTOUR, "block (7).png", 20.0, 0.123)
PART = Contour(
    np.array([[30.0, 10.0], [50.0, 10.0], [50.0, 40.0], [30.0, 40.0]]),
    (np.array([[35.0, 20.0], [35.0, 30.0], [45.0, 30.0]]),),
)
LAID = replace(DOCUMENT, parts=(PART,))


def rings_of(polygon):
    return [np.array(ring.coords)[:-1] for ring in (polygon.exterior, *polygon.interiors)]


def same_ring(a, b, within=1e-6):
    """The same vertices in the same turn, wherever each begins."""
    assert len(a) == len(b)
    start = int(np.argmin(np.hypot(*(b - a[0]).T)))
    np.testing.assert_allclose(np.roll(b, -start, axis=0), a, atol=within)


def test_dxf_has_no_fault_that_the_auditor_finds_and_states_millimetres():
    drawing = ezdxf.read(io.StringIO(to_dxf(DOCUMENT).decode()))
    assert not drawing.audit().has_issues
    assert drawing.header["$INSUNITS"] == 4
    assert drawing.header["$MEASUREMENT"] == 1
    rings = list(drawing.modelspace())
    assert [(ring.dxftype(), ring.dxf.layer, ring.closed) for ring in rings] == [
        ("LWPOLYLINE", "EXTERIOR", True),
        ("LWPOLYLINE", "HOLES", True),
        ("LWPOLYLINE", "HOLES", True),
    ]


def test_a_part_is_on_layers_of_its_own_for_another_reader(tmp_path):
    path = tmp_path / "contour.dxf"
    path.write_bytes(to_dxf(LAID))
    _, _, geometries, fields = pyogrio.raw.read(path, columns=["Layer"])
    found = {
        layer: np.array(line.coords)[:-1, :2]
        for layer, line in zip(fields[0], shapely.from_wkb(geometries), strict=True)
    }
    assert list(fields[0]) == ["EXTERIOR", "HOLES", "HOLES", "PART", "PART_HOLES"]
    same_ring(PART.exterior, found["PART"])
    same_ring(PART.holes[0], found["PART_HOLES"])
    assert not ezdxf.read(io.StringIO(to_dxf(LAID).decode())).audit().has_issues


def test_block_and_part_are_two_polygons_for_another_reader(tmp_path):
    path = tmp_path / "contour.geojson"
    path.write_bytes(to_geojson(LAID))
    _, _, geometries, fields = pyogrio.raw.read(path, columns=["role"])
    block, part = shapely.from_wkb(geometries)
    assert list(fields[0]) == ["block", "part"]
    assert block.contains(part)
    for ring, found in zip(PART.rings, rings_of(part), strict=True):
        same_ring(ring, found)


def test_svg_names_the_parts_paths():
    root = ElementTree.fromstring(to_svg(LAID))
    paths = [path.get("id") for path in root.iter("{http://www.w3.org/2000/svg}path")]
    assert paths == ["EXTERIOR", "HOLES-1", "HOLES-2", "PART", "PART_HOLES-1"]


def test_dxf_holds_the_same_rings_for_another_reader(tmp_path):
    path = tmp_path / "contour.dxf"
    path.write_bytes(to_dxf(DOCUMENT))
    _, _, geometries, fields = pyogrio.raw.read(path, columns=["Layer"])
    found = [np.array(line.coords) for line in shapely.from_wkb(geometries)]
    assert list(fields[0]) == ["EXTERIOR", "HOLES", "HOLES"]
    for ring, line in zip(CONTOUR.rings, found, strict=True):
        np.testing.assert_array_equal(line[0], line[-1])
        same_ring(ring, line[:-1, :2])


def test_geojson_is_a_polygon_with_holes_for_another_reader(tmp_path):
    path = tmp_path / "contour.geojson"
    path.write_bytes(to_geojson(DOCUMENT))
    _, _, geometries, _ = pyogrio.raw.read(path)
    (polygon,) = shapely.from_wkb(geometries)
    assert polygon.is_valid
    for ring, found in zip(CONTOUR.rings, rings_of(polygon), strict=True):
        same_ring(ring, found)
    properties = json.loads(path.read_text())["properties"]
    assert properties["unit"] == "mm"
    assert properties["uncertainty_mm"] == 0.123


def test_svg_is_drawn_in_true_millimetres(tmp_path):
    """Ten pixels a millimetre: where librsvg draws black is where the rings are, y upwards."""
    program = need_program("rsvg-convert", "apt-get install librsvg2-bin")
    source, picture = tmp_path / "contour.svg", tmp_path / "contour.png"
    source.write_bytes(to_svg(DOCUMENT))
    command = [program, "--dpi-x=254", "--dpi-y=254", "--background-color=white", "-o", str(picture), str(source)]
    subprocess.run(command, check=True)
    drawn = cv2.imread(str(picture), cv2.IMREAD_GRAYSCALE)
    low = EXTERIOR.min(axis=0) - MARGIN_MM
    size = EXTERIOR.max(axis=0) + MARGIN_MM - low
    assert np.abs(np.array(drawn.shape[::-1]) - 10 * size).max() <= 1
    expected = np.full_like(drawn, 255)
    for ring in CONTOUR.rings:
        pixels = np.stack([(ring[:, 0] - low[0]) * 10, (low[1] + size[1] - ring[:, 1]) * 10], axis=1) - 0.5
        cv2.polylines(expected, [np.round(pixels * 16).astype(np.int32)], True, 0, round(LINE_MM * 10), cv2.LINE_8, 4)
    near = cv2.erode(expected, np.ones((5, 5), np.uint8))
    assert (near[drawn < 128] == 0).all()
    assert (cv2.erode(drawn, np.ones((5, 5), np.uint8))[expected == 0] < 128).mean() > 0.995


def test_rings_are_turned_as_everywhere_whatever_turn_they_come_in():
    turned = Contour(EXTERIOR[::-1], tuple(hole[::-1] for hole in HOLES))
    document = ExportDocument(turned, "turned", 20.0)
    coordinates = json.loads(to_geojson(document))["geometry"]["coordinates"]
    assert [ring[0] == ring[-1] for ring in coordinates] == [True] * 3
    polygon = shapely.Polygon(coordinates[0], coordinates[1:])
    assert shapely.is_ccw(polygon.exterior)
    assert not any(shapely.is_ccw(hole) for hole in polygon.interiors)
    assert polygon.area == pytest.approx(area(CONTOUR), abs=1e-2)


def test_a_file_that_cannot_be_written_is_told_and_nothing_is_left_beside_it(tmp_path):
    (tmp_path / "x.dxf").mkdir()
    with pytest.raises(ExportError, match=r"x\.dxf: cannot be written: Is a directory"):
        write_export(tmp_path / "x.dxf", b"0")
    assert [path.name for path in tmp_path.iterdir()] == ["x.dxf"]


# --- the command -----------------------------------------------------------------------------------------------------

SAMPLES = Path(__file__).parents[3] / "service" / "samples"
FORMS = ("dxf", "svg", "geojson", "gcode")


def options(folder, *forms):
    return [word for form in forms for word in (f"--{form}", str(folder / f"out.{form}"))]


def test_trace_exports_the_polygon_that_its_json_shows(tmp_path, capsys):
    picture = str(SAMPLES / "4-with-holes.jpg")
    calibration = ["--calibration", str(SAMPLES / "calibration.yaml")]
    assert main(["trace", picture, *calibration, "--json", "-", *options(tmp_path, *FORMS)]) == 0
    told = json.loads(capsys.readouterr().out)["millimetres"]
    polygon = json.loads((tmp_path / "out.geojson").read_text())["geometry"]["coordinates"]
    for ring, written in zip([told["exterior"], *told["holes"]], polygon, strict=True):
        np.testing.assert_allclose(written[:-1], ring, atol=6e-5)
    assert (tmp_path / "out.gcode").read_bytes().count(b"(hole ") == len(told["holes"]) > 0


def test_trace_of_several_pictures_exports_into_a_folder(tmp_path):
    pictures = [str(SAMPLES / name) for name in ("1-rectangle.jpg", "2-l-shape.jpg")]
    calibration = ["--calibration", str(SAMPLES / "calibration.yaml")]
    assert main(["trace", *pictures, *calibration, "--gcode", str(tmp_path / "programs")]) == 0
    assert sorted(path.name for path in (tmp_path / "programs").iterdir()) == ["1-rectangle.ngc", "2-l-shape.ngc"]


def test_a_refused_picture_is_not_exported_and_says_so(tmp_path, capsys):
    empty = tmp_path / "empty.png"
    cv2.imwrite(str(empty), np.zeros((1200, 1600), np.uint8))
    (tmp_path / "out.dxf").write_text("of before")
    calibration = ["--calibration", str(SAMPLES / "calibration.yaml")]
    assert main(["trace", str(empty), *calibration, *options(tmp_path, "dxf")]) == 3
    assert "nothing exported, files of before are as they were" in capsys.readouterr().out
    assert (tmp_path / "out.dxf").read_text() == "of before"


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["--dxf", "x.dxf"], "exports are in mm; name the calibration"),
        (["--dxf", "x", "--svg", "x", "--calibration", "CALIBRATION"], "--dxf has the same file"),
        (["--svg", "no/such/folder/x.svg", "--calibration", "CALIBRATION"], "cannot be written: No such file"),
    ],
)
def test_exports_that_cannot_be_are_told(words, text, tmp_path, monkeypatch, capsys):
    picture = str(SAMPLES / "1-rectangle.jpg")
    words = [str(SAMPLES / "calibration.yaml") if word == "CALIBRATION" else word for word in words]
    monkeypatch.chdir(tmp_path)
    assert main(["trace", picture, *words]) == 2
    assert text in capsys.readouterr().err
