"""G-code as a machine's own interpreter reads it, and as a person must be able to trust it."""

from __future__ import annotations

import re
import subprocess
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from contour.geometry.rings import Contour, signed_area
from service.export.document import ExportDocument, ExportError
from service.export.gcode import GcodeSettings, to_gcode
from tests.support.real_parts import need_program

SQUARE = np.array([[0.0, 0.0], [100.0, 0.0], [100.0, 60.0], [0.0, 60.0]])
HOLE = np.array([[40.0, 20.0], [40.0, 40.0], [60.0, 40.0], [60.0, 20.0]])
DOCUMENT = ExportDocument(Contour(SQUARE, (HOLE,)), "block", 20.0, 0.2)
CUT = GcodeSettings(cut_z_mm=1.0, lead_in_mm=5.0)
MATERIAL = shapely.Polygon(SQUARE, [HOLE])


def moves(program: bytes) -> list[tuple[str, dict[str, float]]]:
    """Each straight move: G0 or G1, and where all three axes then are."""
    here: dict[str, float] = {}
    found = []
    for line in program.decode("ascii").splitlines():
        if line.startswith(("G0 ", "G1 ")):
            here = here | {axis: float(value) for axis, value in re.findall(r"([XYZ])(-?[\d.]+)", line)}
            found.append((line[:2], here))
    return found


def cut_rings(program: bytes) -> list[np.ndarray]:
    """Positions at the height of cut, one array from each way down to the way up."""
    rings: list[list[tuple[float, float]]] = []
    for _, here in moves(program):
        if here["Z"] == 1.0:
            if not rings or rings[-1] is None:
                rings.append([])
            rings[-1].append((here["X"], here["Y"]))
        elif rings and rings[-1]:
            rings.append([])
    return [np.array(ring) for ring in rings if ring]


def test_with_a_part_the_tool_goes_around_the_part_alone():
    part = Contour(SQUARE * 0.3 + 5.0, (HOLE * 0.2 + 8.0,))
    program = to_gcode(replace(DOCUMENT, parts=(part,)), replace(CUT, lead_in_mm=1.0))
    hole, exterior = (shapely.LineString(ring) for ring in cut_rings(program))
    laid = shapely.Polygon(part.exterior, list(part.holes))
    for ring, true in ((hole, laid.interiors[0]), (exterior, laid.exterior)):
        assert shapely.hausdorff_distance(shapely.LineString(ring.coords[1:-1]), true) < 1e-4
    # Leads lie out of the part, and nothing goes nearer to the block's edge than the part does but they.
    assert all(not laid.buffer(-1e-6).intersects(ring) for ring in (hole, exterior))
    assert b"(part's hole 1, 4 vertices)" in program


def test_the_machines_interpreter_takes_the_program_and_moves_along_the_rings(tmp_path):
    """LinuxCNC's `rs274` prints canonical moves; those at the height of cut are our rings, holes first."""
    program = need_program("rs274", "apt-get install linuxcnc-uspace")
    path = tmp_path / "contour.ngc"
    path.write_bytes(to_gcode(DOCUMENT, GcodeSettings(cut_z_mm=1.0)))
    done = subprocess.run([program, "-g", str(path)], capture_output=True, text=True, check=True, cwd=tmp_path)
    feeds = re.findall(r"STRAIGHT_FEED\(([^)]*)\)", done.stdout)
    points = [tuple(float(word) for word in feed.split(",")[:3]) for feed in feeds]
    along = np.array([point[:2] for point in points if point[2] == 1.0])
    assert len(along) == 2 + 2 * 4  # down, around and closed, twice
    assert {tuple(point) for point in along[:5]} == {tuple(point) for point in HOLE}
    assert {tuple(point) for point in along[5:]} == {tuple(point) for point in SQUARE}
    assert "error" not in done.stderr.lower()


def test_holes_come_first_and_each_ring_is_closed():
    hole, exterior = cut_rings(to_gcode(DOCUMENT, GcodeSettings(cut_z_mm=1.0)))
    assert {tuple(point) for point in hole} == {tuple(point) for point in HOLE}
    assert {tuple(point) for point in exterior} == {tuple(point) for point in SQUARE}
    for ring in (hole, exterior):
        np.testing.assert_array_equal(ring[0], ring[-1])


@pytest.mark.parametrize("direction", ["climb", "conventional"])
def test_the_material_is_on_the_side_that_the_direction_says(direction):
    hole, exterior = cut_rings(to_gcode(DOCUMENT, GcodeSettings(cut_z_mm=1.0, direction=direction)))
    right = direction == "climb"
    assert (signed_area(exterior[:-1]) < 0) == right
    assert (signed_area(hole[:-1]) > 0) == right


def test_fast_moves_are_only_at_the_safe_height_or_straight_up():
    """A rapid move through the block breaks the tool."""
    fast = [
        (before, here)
        for (_, before), (kind, here) in pairwise(moves(to_gcode(DOCUMENT, CUT)))
        if kind == "G0" and "X" in before
    ]
    assert len(fast) >= 3, "up after each ring, and over to the next"
    for before, here in fast:
        is_up = (here["X"], here["Y"]) == (before["X"], before["Y"]) and here["Z"] >= before["Z"]
        assert is_up or (here["Z"] == before["Z"] == 40.0)


def test_the_lead_in_runs_through_no_material_and_meets_the_ring():
    rings = cut_rings(to_gcode(DOCUMENT, CUT))
    assert len(rings) == 2
    for ring in rings:
        lead = shapely.LineString(ring[:2])
        assert lead.length == pytest.approx(5.0, abs=1e-3)
        assert shapely.intersection(lead, MATERIAL).length < 1e-3
        np.testing.assert_array_equal(ring[0], ring[-1])
        np.testing.assert_array_equal(ring[1], ring[-2])


@given(
    angles=st.lists(st.floats(0, 6.28), min_size=3, max_size=12, unique_by=lambda angle: round(angle, 1)),
    length=st.floats(0.5, 30),
)
def test_a_lead_in_is_free_or_refused(angles, length):
    radii = [30 + 50 * ((7 * index) % 5) / 5 for index in range(len(angles))]
    ring = np.array([(r * np.cos(a), r * np.sin(a)) for a, r in zip(sorted(angles), radii, strict=True)])
    material = shapely.Polygon(ring)
    if not material.is_valid or material.area < 1:
        return
    document = ExportDocument(Contour(ring), "star", 20.0)
    try:
        (way,) = cut_rings(to_gcode(document, GcodeSettings(cut_z_mm=1.0, lead_in_mm=length)))
    except ExportError:
        assert length > 5  # a short one is always free before some edge of these
        return
    assert shapely.intersection(shapely.LineString(way[:2]), material.buffer(-1e-3)).length < 1e-3


def test_without_a_height_of_cut_it_is_a_dry_run_above_the_block():
    program = to_gcode(DOCUMENT)
    assert b"(dry run: no height of cut is set)" in program
    assert {here["Z"] for _, here in moves(program)} == {40.0}


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        (GcodeSettings(safe_z_mm=20.0), "safe_z_mm 20 is not above the block of 20 mm"),
        (GcodeSettings(cut_z_mm=50.0), "cut_z_mm 50 is above safe_z_mm 40"),
        (GcodeSettings(lead_in_mm=25.0), "hole 1: no edge has 25 mm free"),
        (GcodeSettings(feed_mm_min=0.0), "feed_mm_min 0"),
        (GcodeSettings(template="G21 $speed $rings"), r"'speed'; expected only \$cut_z_mm"),
        (GcodeSettings(template="G21"), r"no \$rings in it"),
        (GcodeSettings(template="(Контур) $rings"), "beyond ASCII"),
    ],
)
def test_what_does_not_fit_is_refused(settings, text):
    with pytest.raises(ExportError, match=text):
        to_gcode(DOCUMENT, settings)


def test_a_title_cannot_end_its_comment_or_bring_code():
    document = ExportDocument(DOCUMENT.contour, "x)\nG0 Z-100\n(блок", 20.0)
    lines = to_gcode(document).decode("ascii").splitlines()
    assert lines[0].startswith("(combtrace: x]?G0 Z-100?[????;")
    assert not any(line.startswith("G0 Z-") for line in lines)


def test_ones_own_template_is_filled_in():
    program = to_gcode(DOCUMENT, GcodeSettings(template="%\nM3 S$$1\n$rings\nM30\n%\n")).decode()
    assert program.startswith("%\nM3 S$1\n(hole 1, 4 vertices)\n")
    assert program.endswith("G0 Z40\nM30\n%\n")
