"""Contours from files and by name: what is read, what is not, and what the limits say of them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from contour.geometry.rings import Contour, area, signed_area
from service.cli.controller.simulate_service import SHAPES as OFFERED
from service.cli.main import main
from service.commissioning.given_contours import GivenContour, GivenContours, GivenContoursError, read_contours
from service.commissioning.given_shapes import SHAPES, shape
from service.config.config_file import SAMPLES
from service.config.recipes import Recipe
from service.export.document import ExportDocument
from service.export.geojson import to_geojson
from service.reasons import Reason

SQUARE = [[0, 0], [100, 0], [100, 100], [0, 100]]
HOLE = [[10, 10], [10, 20], [20, 20], [20, 10]]
PICTURE = np.zeros((1, 1), np.uint8)


def read(folder: Path, text: str):
    path = folder / "contours.json"
    path.write_text(text)
    return read_contours(path)


def measured(*contours: GivenContour, recipe: Recipe | None = None, **options):
    given = GivenContours(contours, aligned=False, **options)
    return [given.measure(PICTURE, recipe or Recipe(number=1, name="a"), 20.0) for _ in range(len(contours) + 1)]


@pytest.mark.parametrize(
    "text",
    [
        json.dumps({"exterior": SQUARE, "holes": [HOLE]}),
        json.dumps({"millimetres": {"exterior": SQUARE, "holes": [HOLE]}, "job_id": 7}),
        json.dumps({"type": "Polygon", "coordinates": [[*SQUARE, SQUARE[0]], [*HOLE, HOLE[0]]]}),
        json.dumps({"exterior": SQUARE[::-1], "holes": [HOLE[::-1]]}, indent=1),
        json.dumps([{"exterior": SQUARE, "holes": [HOLE]}]),
    ],
    ids=["rings", "log of the controller", "GeoJSON, closed", "the other way round", "a list"],
)
def test_every_form_gives_the_same_rings_in_their_directions(tmp_path, text):
    (given,) = read(tmp_path, text)
    assert area(given.contour) == 100 * 100 - 100
    assert signed_area(given.contour.exterior) > 0 > signed_area(given.contour.holes[0])
    assert [len(ring) for ring in given.contour.rings] == [4, 4]


def test_what_trace_writes_is_read_with_its_uncertainty_line_by_line(tmp_path):
    lines = [
        {"image": "a.png", "millimetres": {"exterior": SQUARE, "holes": []}, "uncertainty_mm": u} for u in (0.3, None)
    ]
    first, second = read(tmp_path, "\n".join(map(json.dumps, lines)) + "\n")
    assert (first.uncertainty_mm, second.uncertainty_mm) == (0.3, None)


def test_what_the_trace_command_writes_is_what_is_sent(tmp_path):
    written = tmp_path / "traced.jsonl"
    picture, calibration = SAMPLES / "4-with-holes.jpg", SAMPLES / "calibration.yaml"
    assert main(["trace", str(picture), "--calibration", str(calibration), "--json", str(written)]) == 0
    traced = json.loads(written.read_text())
    (given,) = read_contours(written)
    assert given.uncertainty_mm == traced["uncertainty_mm"] > 0
    assert np.array_equal(given.contour.exterior, traced["millimetres"]["exterior"])
    assert len(given.contour.holes) == len(traced["millimetres"]["holes"]) == 2
    assert measured(given)[0].reasons == ()


def test_our_own_export_is_read_back(tmp_path):
    contour = Contour(np.array(SQUARE, float), (np.array(HOLE, float),))
    (given,) = read(tmp_path, to_geojson(ExportDocument(contour, "a", 20.0, 0.25)).decode())
    assert all(np.array_equal(a, b) for a, b in zip(given.contour.rings, contour.rings, strict=True))
    assert given.uncertainty_mm == 0.25


def test_a_bare_ring_and_a_feature_collection_are_read(tmp_path):
    assert len(read(tmp_path, json.dumps(SQUARE))) == 1
    feature = {"type": "Feature", "properties": None, "geometry": {"type": "Polygon", "coordinates": [SQUARE]}}
    assert len(read(tmp_path, json.dumps({"type": "FeatureCollection", "features": [feature, feature]}))) == 2


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "is no JSON"),
        ("{\n}\nx", "line 1"),
        ("[]", "holds no contour"),
        ("7", "contour 1: is 7; expected"),
        ("{}", "an object with nothing"),
        ('{"rings": []}', "an object with 'rings'"),
        ('{"millimetres": null}', "Trace it with a calibration"),
        ('{"exterior": [[0, 0], [1, 0], [0, 0]]}', "the exterior has 2 vertices"),
        ('{"exterior": [[0, 0], [1, 0], [1, NaN]]}', "not finite"),
        ('{"exterior": [[0, 0], [1, 0], [1, 3e9]]}', "beyond ±2147483.647 mm"),
        ('{"exterior": [[0, 0], [1], [1, 1]]}', "no list of pairs"),
        ('{"exterior": [[0, 0, 0], [1, 0, 0], [1, 1, 0]]}', "shape \\(3, 3\\)"),
        ('{"exterior": [[0, 0], [1, 0], [1, 1]], "holes": [[]]}', "hole 1 has shape"),
        ('{"type": "Polygon", "coordinates": []}', "has no rings"),
        ('{"type": "Feature", "properties": {"unit": "inch"}, "geometry": {}}', "unit is 'inch'"),
        ('{"millimetres": {"exterior": [[0, 0], [1, 0], [1, 1]]}, "uncertainty_mm": -1}', "uncertainty_mm is -1"),
    ],
)
def test_what_is_no_contour_is_told_with_its_place(tmp_path, text, why):
    with pytest.raises(GivenContoursError, match=why):
        read(tmp_path, text)


def test_contours_come_in_turn_and_begin_again():
    methods = [m.method for m in measured(shape("rectangle"), shape("holes"))]
    assert methods == ["given: rectangle", "given: holes", "given: rectangle"]


def test_the_page_shows_every_shape():
    page = (Path(__file__).parents[3] / "docs" / "reference" / "simulated-service.md").read_text(encoding="utf-8")
    shown = [line.split("`")[1] for line in page.splitlines() if line.startswith("| `")]
    assert shown == list(SHAPES)


def test_every_shape_is_offered_and_sound_but_the_one_that_crosses_itself():
    assert tuple(SHAPES) == OFFERED
    for name in SHAPES:
        reasons = measured(shape(name, (-300.0, 40.0)))[0].reasons
        assert reasons == ((Reason.SELF_INTERSECTING,) if name == "crossing" else ()), name
        assert np.allclose(shape(name, (-300.0, 40.0)).contour.exterior.min(axis=0), (-300, 40))


@pytest.mark.parametrize(
    ("recipe", "options", "reason"),
    [
        ({"max_vertices": 399}, {}, Reason.TOO_MANY_POINTS),
        ({"max_area_mm2": 20_000}, {}, Reason.AREA_OUT_OF_LIMITS),
        ({"max_uncertainty_mm": 0.1}, {}, Reason.UNCERTAINTY_TOO_LARGE),
        (
            {},
            {"work_area_mm": np.array([[1.0, 0.0], [300.0, 0.0], [300.0, 300.0], [1.0, 300.0]])},
            Reason.OUTSIDE_WORK_AREA,
        ),
    ],
)
def test_limits_refuse_a_given_contour_as_they_refuse_a_traced_one(recipe, options, reason):
    seen = measured(shape("circle"), recipe=Recipe(number=1, name="a", **recipe), **options)[0]
    assert seen.reasons == (reason,)
    assert seen.summary()["vertices"] == 400


def test_an_uncertainty_that_is_not_known_stays_so():
    given = GivenContour("a", shape("circle").contour)
    assert measured(given)[0].uncertainty_mm is None
    limited = Recipe(number=1, name="a", max_uncertainty_mm=1)
    assert measured(given, recipe=limited)[0].reasons == (Reason.UNCERTAINTY_TOO_LARGE,)
