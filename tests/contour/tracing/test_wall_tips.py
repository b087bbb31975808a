"""`wall-tips` as a whole: the outline, and that nothing moves it that should not."""

from __future__ import annotations

from functools import cache
from typing import Literal

import cv2
import numpy as np
import pytest

from contour.errors import NoBlockFound, ParameterError, PictureError
from contour.geometry.agreement import places_along
from contour.geometry.rings import oriented_contour, perimeter
from contour.geometry.signed_distance import nearest
from contour.synthetic import (
    CellGeometry,
    Clutter,
    Rendered,
    Scene,
    Table,
    camera_above,
    disc_ring,
    l_shape,
    rectangle,
    render,
    signed_distance,
    with_holes,
)
from contour.tracing.trace import Trace, TraceSettings
from contour.tracing.wall_tips import wall_tips
from contour.walls.see_block import Outline, Source

SETTINGS = TraceSettings(method="wall-tips")
CAMERA = camera_above(800, 600, 0.375, distance_mm=1500.0)
BLOCK = with_holes(l_shape((150.0, 112.0), 200.0, 160.0, 85.0, 8.0), disc_ring((105.0, 150.0), 22.0))
ABSENT = rectangle((-900.0, -900.0), 100.0, 100.0)


@cache
def block() -> Rendered:
    return render(Scene(BLOCK, CAMERA, CellGeometry(pitch_mm=8.0, wall_mm=0.6, ribbon_deg=15.0, broken=0.005), seed=3))


@cache
def traced() -> Trace:
    return wall_tips(block().picture, SETTINGS)


def along(ring: np.ndarray, step: float = 2.0) -> np.ndarray:
    following = np.roll(ring, -1, axis=0)
    pieces = [
        a + np.linspace(0, 1, max(2, int(np.linalg.norm(b - a) / step)), endpoint=False)[:, None] * (b - a)
        for a, b in zip(ring, following, strict=True)
    ]
    return np.concatenate(pieces)


def apart(one: Trace, rings: tuple[np.ndarray, ...]) -> float:
    """Mean distance of `rings` from the outline of `one`, pixels."""
    return float(np.abs(signed_distance(one.contour, np.concatenate([along(ring) for ring in rings]))).mean())


def test_the_outline_is_found_to_a_third_of_a_pixel_with_its_hole() -> None:
    trace = traced()
    off = signed_distance(block().truth_px, np.concatenate([along(ring) for ring in trace.contour.rings]))
    assert len(trace.contour.holes) == 1
    assert np.abs(off).mean() < 0.35
    assert np.abs(off).max() < 0.25 * block().pitch_px
    assert abs(off.mean()) < 0.15


def test_the_exterior_turns_counter_clockwise_as_seen_in_the_work_frame() -> None:
    for ring, sign in zip(traced().contour.rings, (-1.0, 1.0), strict=True):
        following = np.roll(ring, -1, axis=0)
        assert sign * (ring[:, 0] * following[:, 1] - following[:, 0] * ring[:, 1]).sum() > 0


def test_stages_are_told_in_order() -> None:
    heard: list[str] = []
    wall_tips(block().picture, SETTINGS, on_stage=heard.append)
    assert heard == ["mask", "trace"]


@pytest.mark.parametrize("turns", [1, 2, 3])
def test_a_quarter_turn_of_the_picture_turns_the_outline(turns: int) -> None:
    picture = block().picture
    found = wall_tips(np.ascontiguousarray(np.rot90(picture, turns)), SETTINGS)
    height, width = picture.shape
    rings = []
    for ring in found.contour.rings:
        x, y = ring[:, 0], ring[:, 1]
        back = {1: (width - 1 - y, x), 2: (width - 1 - x, height - 1 - y), 3: (y, height - 1 - x)}[turns]
        rings.append(np.stack(back, axis=1))
    assert apart(traced(), tuple(rings)) < 0.15


def test_a_mirrored_picture_gives_the_mirrored_outline() -> None:
    picture = block().picture
    found = wall_tips(np.ascontiguousarray(picture[:, ::-1]), SETTINGS)
    rings = tuple(np.stack([picture.shape[1] - 1 - ring[:, 0], ring[:, 1]], axis=1) for ring in found.contour.rings)
    assert apart(traced(), rings) < 0.15


def test_a_picture_twice_as_large_gives_the_outline_twice_as_large() -> None:
    large = cv2.resize(block().picture, None, fx=2, fy=2, interpolation=cv2.INTER_CUBIC)
    found = wall_tips(np.asarray(large, np.uint8), SETTINGS)
    assert apart(traced(), tuple((ring + 0.5) / 2 - 0.5 for ring in found.contour.rings)) < 0.2


@pytest.mark.parametrize("gain", [0.5, 1.2])
def test_more_or_less_light_leaves_the_outline_where_it_is(gain: float) -> None:
    picture = np.clip(np.rint(block().picture * gain), 0, 255).astype(np.uint8)
    assert apart(traced(), wall_tips(picture, SETTINGS).contour.rings) < 0.15


def test_added_specks_leave_the_outline_where_it_is() -> None:
    picture = block().picture.copy()
    rng = np.random.default_rng(4)
    for x, y in zip(rng.integers(5, 795, 150), rng.integers(5, 595, 150), strict=True):
        cv2.circle(picture, (int(x), int(y)), int(rng.integers(1, 3)), int(rng.integers(120, 255)), -1)
    assert apart(traced(), wall_tips(picture, SETTINGS).contour.rings) < 0.25


def test_a_neighbouring_piece_stays_out() -> None:
    clutter = Clutter(neighbours=(rectangle((283.0, 112.0), 30.0, 120.0, 0.0),), debris=8)
    rendered = render(Scene(BLOCK, CAMERA, CellGeometry(pitch_mm=8.0, wall_mm=0.6), clutter=clutter, seed=3))
    off = signed_distance(rendered.truth_px, wall_tips(rendered.picture, SETTINGS).contour.exterior)
    assert np.abs(off).max() < 0.25 * rendered.pitch_px


@pytest.mark.parametrize(
    "table",
    [Table(), Table(scratches=12), Table(level=0.6, perforation_pitch_mm=25.0), Table(level=0.3, groove_pitch_mm=15.0)],
    ids=["bare", "scratched", "perforated", "grooved"],
)
def test_an_empty_table_is_no_block(table: Table) -> None:
    rendered = render(Scene(ABSENT, CAMERA, table=table, clutter=Clutter(specks=40, debris=10)))
    with pytest.raises(NoBlockFound, match="no block found"):
        wall_tips(rendered.picture, SETTINGS)


def test_a_block_that_leaves_the_picture_is_traced_along_its_border() -> None:
    rendered = render(
        Scene(rectangle((150.0, 112.0), 400.0, 120.0, 5.0), CAMERA, CellGeometry(pitch_mm=8.0, wall_mm=0.6))
    )
    exterior = wall_tips(rendered.picture, SETTINGS).contour.exterior
    assert exterior[:, 0].min() < 2.0
    assert exterior[:, 0].max() > 797.0


def closed_lattice() -> tuple[np.ndarray, np.ndarray]:
    """Rows of closed hexagons, dark on a bright table, and the mask of all they cover."""
    factor, size = 8, 26.0
    outer = np.zeros((300 * factor, 400 * factor), np.uint8)
    inner = outer.copy()
    for row in range(6):
        for column in range(6):
            centre = np.array([60 + (column + 0.5 * (row % 2)) * size * np.sqrt(3), 50 + row * size * 1.5])
            angles = np.radians(30 + 60 * np.arange(6))
            hexagon = np.stack([np.cos(angles), np.sin(angles)], axis=1)
            for canvas, radius in ((outer, size + 2.0), (inner, size - 2.0)):
                corners = np.rint((centre + radius * hexagon + 0.5) * factor - 0.5).astype(np.int32)
                cv2.fillConvexPoly(canvas, corners, 1)
    cover = cv2.resize((outer & (1 - inner)).astype(np.float32), (400, 300), interpolation=cv2.INTER_AREA)
    picture = np.rint(cv2.GaussianBlur(210 - 170 * cover, (0, 0), 0.7)).astype(np.uint8)
    return picture, outer


def test_closed_border_cells_give_their_serrated_boundary() -> None:
    picture, outer = closed_lattice()
    trace = wall_tips(picture, TraceSettings(method="wall-tips", edge="cells"))
    found = np.zeros_like(outer)
    cv2.fillPoly(found, [np.rint((trace.contour.exterior + 0.5) * 8 - 0.5).astype(np.int32)], 1)
    assert (found & outer).sum() / (found | outer).sum() > 0.985
    assert abs(int(found.sum()) - int(outer.sum())) < 0.01 * outer.sum()


def test_an_empty_table_has_no_closed_cells_either() -> None:
    with pytest.raises(NoBlockFound, match="no block found"):
        wall_tips(render(Scene(ABSENT, CAMERA)).picture, TraceSettings(method="wall-tips", edge="cells"))


NOISE = np.random.default_rng(7)


@pytest.mark.parametrize("edge", ["cut", "cells"])
@pytest.mark.parametrize(
    "picture",
    [
        np.full((600, 800), 30),
        np.zeros((600, 800)),
        np.full((600, 800), 255),
        np.full((300, 400, 3), 77),
        NOISE.integers(0, 256, (600, 800)),
        np.clip(NOISE.normal(100.0, 8.0, (600, 800)), 0, 255),
        NOISE.integers(0, 256, (300, 400, 3)),
        np.hstack([np.zeros((600, 400)), np.full((600, 400), 255)]),
        np.tile(np.repeat([0, 255], 8), (600, 50)),
        np.tile(np.linspace(0, 255, 800), (600, 1)),
        NOISE.integers(0, 256, (16, 16)),
        NOISE.integers(0, 256, (20, 3000)),
    ],
    ids=[
        "grey",
        "black",
        "white",
        "colour",
        "noise",
        "faint",
        "colour-noise",
        "halves",
        "bars",
        "ramp",
        "tiny",
        "strip",
    ],
)
def test_a_picture_without_a_block_is_no_block(picture: np.ndarray, edge: Literal["cut", "cells"]) -> None:
    with pytest.raises(NoBlockFound, match="no block found"):
        wall_tips(picture.astype(np.uint8), TraceSettings(method="wall-tips", edge=edge))


@pytest.mark.parametrize("shape", [(1, 1), (3, 3000), (0, 0), (0, 5, 3)])
def test_a_picture_too_small_for_any_block_is_an_error(shape: tuple[int, ...]) -> None:
    with pytest.raises(PictureError, match="expected at least"):
        wall_tips(np.zeros(shape, np.uint8), SETTINGS)


@pytest.mark.parametrize("binarize", ["otsu", 120])
def test_a_threshold_of_ones_own_is_refused(binarize: Literal["otsu"] | int) -> None:
    with pytest.raises(ParameterError, match="binarize"):
        wall_tips(block().picture, TraceSettings(method="wall-tips", binarize=binarize))


def test_the_outline_comes_with_a_bound_that_it_keeps() -> None:
    found = traced()
    assert found.uncertainty_px is not None
    assert apart(found, block().truth_px.rings) < 3 * found.uncertainty_px < 3.0


def test_of_closed_cells_there_is_a_bound_too() -> None:
    picture, _ = closed_lattice()
    bound_px = wall_tips(picture, TraceSettings(method="wall-tips", edge="cells")).uncertainty_px
    assert bound_px is not None
    blurred = np.asarray(cv2.GaussianBlur(picture, (0, 0), 2.5), np.uint8)
    wider_px = wall_tips(blurred, TraceSettings(method="wall-tips", edge="cells")).uncertainty_px
    assert wider_px is not None
    assert 0.5 < bound_px < 0.8 * wider_px


def test_where_comb_is_known_to_end_ends_of_walls_tell_nothing() -> None:
    rendered = block()
    ring = places_along(rendered.truth_px, 0.5 * rendered.pitch_px)
    rng = np.random.default_rng(2)
    for away in (0.0, 0.4):
        middle = rendered.truth_px.exterior.mean(axis=0)
        outwards = (ring - middle) / np.hypot(*(ring - middle).T)[:, None]
        border = ring + rng.normal(0.0, 0.2, ring.shape) + away * rendered.pitch_px * outwards
        found = wall_tips(rendered.picture, SETTINGS, source=Source(rendered.picture, border))
        off = nearest(border, places_along(found.contour, 0.5))
        assert np.quantile(off, 0.95) < 1.0, away


@pytest.mark.parametrize(("level", "refused"), [(220, True), (None, False)])
def test_where_what_lies_beside_drawn_comb_is_no_table_nothing_is_traced(level: int | None, refused: bool) -> None:
    scene = Scene(rectangle((150.0, 112.0), 200.0, 160.0), CAMERA, CellGeometry(pitch_mm=8.0, wall_mm=0.6), seed=4)
    rendered = render(scene)
    truth, pitch = rendered.truth_px, rendered.pitch_px
    half = int(truth.exterior[:, 0].mean())
    table = int(np.median(rendered.picture[:40]))
    left, taken = rendered.picture.copy(), rendered.picture.copy()
    left[:, half:] = table
    taken[:, half:] = table
    if level is not None:
        reach = np.ptp(truth.exterior[:, 1])
        middle = truth.exterior[:, 1].mean()
        taken[int(middle - 0.6 * reach) : int(middle + 0.6 * reach), half : half + int(6 * pitch)] = level
    places = places_along(truth, 0.25 * pitch)
    across = places[:, 1][np.abs(places[:, 0] - half) < pitch]
    cut = np.arange(across.min(), across.max(), 0.25 * pitch)
    border = np.concatenate([places[places[:, 0] < half], np.column_stack([np.full(len(cut), half - 0.5), cut])])
    source = Source(taken, border)
    if refused:
        with pytest.raises(NoBlockFound, match="something lies beside it"):
            wall_tips(left, SETTINGS, source=source)
    else:
        assert wall_tips(left, SETTINGS, source=source).contour.exterior[:, 0].max() < half + 0.5 * pitch


def test_an_outline_that_was_told_is_the_contour_all_seen() -> None:
    rendered = block()
    outline = Outline(rendered.truth_px, rendered.pitch_px, 1.5)
    found = wall_tips(rendered.picture, SETTINGS, source=Source(rendered.picture, outline=outline))
    assert found.contour == oriented_contour(rendered.truth_px, counter_clockwise=False)
    assert (found.uncertainty_px, found.pitch_px, found.edge) == (1.5, rendered.pitch_px, "cut")
    told = [(part.ring, part.from_px, part.to_px, part.state, part.bound_px) for part in found.evidence or ()]
    lengths = [perimeter(ring) for ring in found.contour.rings]
    assert told == [(number, 0.0, length, "seen", 1.5) for number, length in enumerate(lengths)]


def test_an_outline_that_was_told_beside_what_is_no_table_is_refused() -> None:
    rendered = block()
    outline = Outline(rendered.truth_px, rendered.pitch_px, 1.5)
    left, top = rendered.truth_px.exterior.min(axis=0)
    sheet = rendered.picture.copy()
    sheet[int(top) : int(top) + 200, : int(left)] = 230
    with pytest.raises(NoBlockFound, match="something lies beside it"):
        wall_tips(sheet, SETTINGS, source=Source(sheet, outline=outline))
