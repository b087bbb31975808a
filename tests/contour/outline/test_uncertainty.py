"""The bound on an outline's position: it grows with what makes an outline worse, and follows the picture's scale."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from contour.geometry.agreement import distances_to, places_along
from contour.geometry.ring_lengths import RingLengths
from contour.outline.fit import FittedRing, fit_ring
from contour.outline.uncertainty import LEAST_PX, Coefficients, bound, ring_stretches, uncertainty
from contour.tracing.trace import TraceSettings
from contour.tracing.wall_tips import wall_tips
from contour.walls.wall_evidence import EdgePoints, RingEvidence, WitnessKind
from tests.support.pictures.outline_scenes import PITCH, blob, circle, perimeter, rectangle, witnesses
from tests.support.pictures.small_scenes import block

WIDE = rectangle(500.0, 320.0)
shapes = st.sampled_from([WIDE, circle(180.0), blob(170.0)])
seeds = st.integers(0, 50)
few = settings(max_examples=12)
"""Each example is a fit or two."""


def stated(*rings: RingEvidence, blur_px: float = 0.9, pitch_px: float = PITCH) -> float:
    fitted = [fit_ring(ring, pitch_px=pitch_px, wall_px=pitch_px / 7, rectifier=None) for ring in rings]
    return uncertainty(list(zip(rings, fitted, strict=True)), pitch_px=pitch_px, blur_px=blur_px)[0].whole_px


def without(evidence: RingEvidence, begin: float, end: float) -> RingEvidence:
    """The evidence without its witnesses between two arc lengths."""
    keep = (evidence.position < begin) | (evidence.position > end)
    parts = ("points", "position", "normal", "sigma", "kind")
    return replace(evidence, **{part: getattr(evidence, part)[keep] for part in parts})


def with_two_inside(
    evidence: RingEvidence, fitted: FittedRing, corner: NDArray[np.float64], off_pitches: float
) -> FittedRing:
    """The fit with the two witnesses nearest to a corner so far off it, negative inside, and left out."""
    beside = np.argsort(np.hypot(*(evidence.points - corner).T))[:2]
    residual, inlier = fitted.residual.copy(), fitted.inlier.copy()
    residual[beside], inlier[beside] = off_pitches * PITCH, False
    return replace(fitted, residual=residual, inlier=inlier)


def octagon() -> tuple[NDArray[np.float64], RingEvidence, FittedRing]:
    """A ring with eight corners, its witnesses, and the fit."""
    angle = 0.25 * np.pi * np.arange(8)
    ring = 250.0 * np.column_stack([np.cos(angle), np.sin(angle)]) + np.array([700.0, 500.0])
    evidence = witnesses(ring, seed=3, sigma=0.05)
    return ring, evidence, fit_ring(evidence, pitch_px=PITCH, wall_px=PITCH / 7, rectifier=None)


def moved(evidence: RingEvidence, scale: float, angle: float) -> RingEvidence:
    """The same evidence in a picture turned by `angle` and enlarged."""
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    return replace(
        evidence,
        coarse=evidence.coarse @ turn * scale,
        points=evidence.points @ turn * scale,
        position=evidence.position * scale,
        normal=evidence.normal @ turn,
        sigma=evidence.sigma * scale,
    )


@few
@given(shapes, seeds, st.floats(1.05, 5.0))
def test_it_grows_with_the_witnesses_scatter_about_the_fit(
    shape: NDArray[np.float64], seed: int, factor: float
) -> None:
    evidence = witnesses(shape, seed=seed)
    fitted = fit_ring(evidence, pitch_px=PITCH, wall_px=PITCH / 7, rectifier=None)
    looser = replace(
        fitted,
        residual=fitted.residual * factor,
        spread_px=fitted.spread_px * factor,
        vertex_sigma_px=fitted.vertex_sigma_px * factor,
    )
    one, other = (uncertainty([(evidence, fit)], pitch_px=PITCH, blur_px=0.9)[0].whole_px for fit in (fitted, looser))
    assert other > one


@few
@given(st.sampled_from([WIDE, circle(180.0)]), seeds)
def test_it_grows_with_noise(shape: NDArray[np.float64], seed: int) -> None:
    """The same witnesses, each six times farther off, and the fit's own choice of what lies on the line."""
    quiet, noisy = (witnesses(shape, seed=seed, sigma=sigma) for sigma in (0.15, 0.9))
    assert stated(noisy) > stated(quiet)


@few
@given(shapes, seeds, st.floats(0.5, 2.0), st.floats(1.05, 3.0))
def test_it_grows_with_blur(shape: NDArray[np.float64], seed: int, blur_px: float, factor: float) -> None:
    evidence = witnesses(shape, seed=seed)
    assert stated(evidence, blur_px=factor * blur_px) > stated(evidence, blur_px=blur_px)


@few
@given(shapes, seeds, st.floats(0.0, 0.7))
def test_it_grows_with_a_gap_and_with_the_gaps_length(shape: NDArray[np.float64], seed: int, begin: float) -> None:
    around = perimeter(shape)
    evidence = witnesses(shape, seed=seed)
    short, long = (without(evidence, begin * around, (begin + share) * around) for share in (0.12, 0.3))
    assert stated(evidence) < stated(short) < stated(long)


@few
@given(seeds)
def test_fewer_witnesses_all_around_leave_it_less_sure(seed: int) -> None:
    many, few = (witnesses(WIDE, seed=seed, spacing=spacing * PITCH) for spacing in (0.4, 1.6))
    assert stated(few) > stated(many)


@pytest.mark.parametrize(("radius", "spacing", "seed"), [(200, 0.6, 10), (100, 1.0, 7), (100, 1.0, 1)])
def test_a_segment_of_one_witness_does_not_make_the_outline_unknown(radius: float, spacing: float, seed: int) -> None:
    evidence = witnesses(blob(radius), seed=seed, spacing=spacing * PITCH)
    assert stated(evidence) < 0.5 * PITCH


@few
@given(shapes, seeds, st.floats(0.5, 4.0), st.floats(-3.0, 3.0))
def test_a_picture_enlarged_and_turned_has_the_bound_enlarged(
    shape: NDArray[np.float64], seed: int, scale: float, angle: float
) -> None:
    """The fit itself has limits in pixels, so the law holds for the bound of one and the same fit."""
    evidence = witnesses(shape, seed=seed)
    fitted = fit_ring(evidence, pitch_px=PITCH, wall_px=PITCH / 7, rectifier=None)
    turned = moved(evidence, scale, angle)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    larger = replace(
        fitted,
        ring=fitted.ring @ turn * scale,
        residual=fitted.residual * scale,
        spread_px=fitted.spread_px * scale,
        vertex_sigma_px=fitted.vertex_sigma_px * scale,
    )
    one = uncertainty([(evidence, fitted)], pitch_px=PITCH, blur_px=1.0)[0].whole_px
    other = uncertainty([(turned, larger)], pitch_px=PITCH * scale, blur_px=scale)[0].whole_px
    assert other == pytest.approx(max(one * scale, LEAST_PX), rel=1e-3)


def test_neighbours_off_on_one_side_and_material_left_outside_are_seen() -> None:
    """Both say that the outline runs elsewhere, and both in their own stretches only."""
    evidence = witnesses(WIDE, seed=1, sigma=0.05)
    fitted = fit_ring(evidence, pitch_px=PITCH, wall_px=PITCH / 7, rectifier=None)
    calm = ring_stretches(evidence, fitted, pitch_px=PITCH, blur_px=1.0)
    assert max(calm.misfit.max(), calm.outside.max()) < 0.3
    residual, inlier = fitted.residual.copy(), fitted.inlier.copy()
    residual[10:15], inlier[10:15] = -6.0, False
    residual[30], inlier[30] = 9.0, False
    kind = np.full_like(evidence.kind, WitnessKind.CLEAN)
    off = replace(fitted, residual=residual, inlier=inlier)
    seen = ring_stretches(replace(evidence, kind=kind), off, pitch_px=PITCH, blur_px=1.0)
    assert seen.misfit.max() == pytest.approx(6.0, abs=0.01)
    assert seen.outside.max() == 9.0
    assert np.count_nonzero(seen.misfit > 1.0) <= 3
    assert np.count_nonzero(seen.outside > 1.0) == 1


def test_ends_of_walls_left_inside_make_their_own_place_less_sure_and_nothing_else() -> None:
    """Two of a row do, a single one is an inner wall; what lies half a cell deep is one, too."""
    evidence = witnesses(WIDE, seed=1, sigma=0.05)
    fitted = fit_ring(evidence, pitch_px=PITCH, wall_px=PITCH / 7, rectifier=None)
    evidence = replace(evidence, kind=np.full_like(evidence.kind, WitnessKind.CLEAN))
    for depths, told in (((6.0,), 0.0), ((7.0, 6.0), 6.0), ((7.0, 0.6 * PITCH), 0.0)):
        residual, inlier = fitted.residual.copy(), fitted.inlier.copy()
        place = slice(10, 10 + len(depths))
        residual[place], inlier[place] = -np.array(depths), False
        seen = ring_stretches(evidence, replace(fitted, residual=residual, inlier=inlier), pitch_px=PITCH, blur_px=1.0)
        assert seen.inside.max() == told
        assert np.count_nonzero(seen.inside) == (told > 0.0)
        (sure,) = uncertainty(
            [(evidence, replace(fitted, residual=residual, inlier=inlier))], pitch_px=PITCH, blur_px=1.0
        )
        assert sure.own_px.min() == sure.whole_px
        here = sure.at(evidence.points[place])
        assert (here >= sure.whole_px + told).all()
        assert here.max() < sure.whole_px + 1.2 * told + 0.5


@pytest.mark.parametrize(("corners", "deep", "blunt"), [(8, 0.06, True), (4, 0.06, False), (4, 0.25, True)])
def test_a_corner_that_leaves_witnesses_inside_may_be_a_round_one(corners: int, deep: float, blunt: bool) -> None:
    """A right one only where they lie deep: cells at a sharp corner lose walls."""
    angle = 2.0 * np.pi * np.arange(corners) / corners
    ring = 250.0 * np.column_stack([np.cos(angle), np.sin(angle)]) + np.array([700.0, 500.0])
    evidence = witnesses(ring, seed=3, sigma=0.05)
    fitted = fit_ring(evidence, pitch_px=PITCH, wall_px=PITCH / 7, rectifier=None)
    calm = ring_stretches(evidence, fitted, pitch_px=PITCH, blur_px=1.0)
    off = with_two_inside(evidence, fitted, ring[1], -deep)
    seen = ring_stretches(evidence, off, pitch_px=PITCH, blur_px=1.0)
    assert max(calm.misfit.max(), calm.blunt.max()) < 0.3
    assert np.count_nonzero(seen.blunt > 1.0) == (1 if blunt else 0)
    if blunt:  # the two that are left lie some 1.3 pitches from the corner
        assert seen.blunt.max() == pytest.approx(1.3 * PITCH * np.tan(0.5 * np.pi / corners), rel=0.4)


def test_a_corner_that_may_be_round_makes_its_own_place_unsure_and_the_outline_little_less_sure() -> None:
    ring, evidence, fitted = octagon()
    off = with_two_inside(evidence, fitted, ring[1], -0.06)
    (calm,) = uncertainty([(evidence, fitted)], pitch_px=PITCH, blur_px=0.2)
    (sure,) = uncertainty([(evidence, off)], pitch_px=PITCH, blur_px=0.2)
    blunt = ring_stretches(evidence, off, pitch_px=PITCH, blur_px=0.2).blunt.max()
    assert sure.own_px.max() > 1.9 * 1.2 * blunt
    assert calm.whole_px < sure.whole_px < 0.5 * blunt


NOWHERE = np.empty((0, 2))


@pytest.mark.parametrize(("wall", "known", "passed"), [(0.1, False, 1.0), (0.1, True, 0.3), (1.0, True, 1.0)])
def test_on_a_known_table_a_round_corner_leaves_no_walls_outside(wall: float, known: bool, passed: float) -> None:
    """Of a wall `wall` pitches from the corner of a block, and of how far the roundest corner passes it."""
    ring, evidence, fitted = octagon()
    off = with_two_inside(evidence, fitted, ring[1], -0.06)
    inwards = (np.array([700.0, 500.0]) - ring[1]) / 250.0
    seen = replace(evidence, walls=EdgePoints(ring[1] + wall * PITCH * inwards[None]))
    before = ring_stretches(evidence, off, pitch_px=PITCH, blur_px=1.0).blunt.max()
    after = ring_stretches(seen, off, pitch_px=PITCH, blur_px=1.0, unreached=NOWHERE if known else None)
    assert before > 0.2 * PITCH
    if passed == 1.0:
        assert max(after.blunt.max(), after.corner.max()) == pytest.approx(before, rel=0.05)
    else:
        assert after.corner.max() < 0.15 * PITCH < before


def test_on_a_known_table_a_round_corner_leaves_no_end_outside_and_is_passed_by_no_more_than_it_can_be() -> None:
    """Of two ends beside a corner, one on the outline tells as much as two."""
    ring, evidence, fitted = octagon()
    lengths = RingLengths.of(fitted.ring)
    ahead = (lengths.feet(evidence.points) - lengths.feet(ring[1:2])) % lengths.length
    after, before = int(ahead.argmin()), int(ahead.argmax())
    passed = []
    for inside in ([after], [after, before]):
        residual, inlier = fitted.residual.copy(), fitted.inlier.copy()
        residual[inside], inlier[inside] = -0.06 * PITCH, False
        off = replace(fitted, residual=residual, inlier=inlier)
        passed.append(ring_stretches(evidence, off, pitch_px=PITCH, blur_px=0.2, unreached=NOWHERE).corner.max())
        (sure,) = uncertainty([(evidence, off)], pitch_px=PITCH, blur_px=0.2, unreached=[NOWHERE])
        assert sure.own_px.max() == pytest.approx(sure.whole_px + 1.1 * passed[-1], rel=0.1)
    assert 0.0 < passed[0] < 0.75 * passed[1]


def test_on_a_known_table_ends_inside_of_what_walls_reach_make_nothing_less_sure() -> None:
    evidence = witnesses(WIDE, seed=1, sigma=0.05)
    fitted = fit_ring(evidence, pitch_px=PITCH, wall_px=PITCH / 7, rectifier=None)
    evidence = replace(evidence, kind=np.full_like(evidence.kind, WitnessKind.CLEAN))
    residual, inlier = fitted.residual.copy(), fitted.inlier.copy()
    residual[10:14], inlier[10:14] = -0.3 * PITCH, False
    off = replace(fitted, residual=residual, inlier=inlier)
    foot = RingLengths.of(fitted.ring).feet(evidence.points[[11, 12]])
    for unreached, doubted in ((NOWHERE, False), (np.sort(foot)[None], True)):
        seen = ring_stretches(evidence, off, pitch_px=PITCH, blur_px=1.0, unreached=unreached)
        assert bool(seen.misfit.max() > 0.2 * PITCH) == bool(seen.inside.max() > 0.2 * PITCH) == doubted


def test_on_a_known_table_ends_deep_in_the_comb_beside_a_notch_say_nothing_of_its_roundness() -> None:
    """A round one would have material where the corner is, and ends out there."""
    notch = np.array([[300, 200], [800, 200], [800, 450], [550, 450], [550, 600], [300, 600]], dtype=np.float64)
    evidence = witnesses(notch, seed=3, sigma=0.05)
    fitted = fit_ring(evidence, pitch_px=PITCH, wall_px=PITCH / 7, rectifier=None)
    off = with_two_inside(evidence, fitted, notch[3], -0.25)
    assert ring_stretches(evidence, off, pitch_px=PITCH, blur_px=1.0).blunt.max() > 0.3
    assert ring_stretches(evidence, off, pitch_px=PITCH, blur_px=1.0, unreached=NOWHERE).corner.max() == 0.0


@given(st.floats(0.1, 3.0), st.integers(1, 40))
def test_equal_errors_give_the_normal_laws_own_bound(sigma: float, count: int) -> None:
    assert bound(np.full(count, sigma), np.ones(count)) == pytest.approx(1.95996 * sigma, rel=1e-3)


def test_a_twentieth_of_the_outline_may_be_unknown() -> None:
    """Between the bound of the sure part and that of the whole taken as unsure."""
    sigma, length = np.array([0.2, 5.0]), np.array([0.97, 0.03])
    assert 0.2 * 1.96 < bound(sigma, length) < 0.6


def test_a_hole_counts_by_its_length() -> None:
    """A noisy hole pulls the bound of both from the outer ring's towards its own, the longer it is the farther."""
    outer = witnesses(WIDE, seed=3, sigma=0.15)
    noisy = witnesses(circle(100.0), seed=4, sigma=1.6, hole=True)
    alone, both, hole = stated(outer), stated(outer, noisy), stated(noisy)
    assert alone < both < hole
    fitted = [fit_ring(ring, pitch_px=PITCH, wall_px=PITCH / 7, rectifier=None) for ring in (outer, noisy)]
    calm, rough = (
        ring_stretches(*ring, pitch_px=PITCH, blur_px=0.9) for ring in zip((outer, noisy), fitted, strict=True)
    )
    sigma = np.concatenate([calm.sigma(Coefficients()), rough.sigma(Coefficients())])
    bounds = [bound(sigma, np.concatenate([calm.length, share * rough.length])) for share in (0.1, 0.5, 1.0, 3.0)]
    assert bounds == sorted(bounds)
    assert bounds[2] == pytest.approx(both)
    assert bounds[3] > 1.1 * bounds[0]


def test_the_bound_weighs_rings_by_length_alone() -> None:
    """The same stretch cut in two, or written as a second ring, changes nothing; twice its length does."""
    sigma, length = np.array([0.2, 1.5]), np.array([900.0, 60.0])
    halved = bound(np.array([0.2, 1.5, 1.5]), np.array([900.0, 30.0, 30.0]))
    assert halved == pytest.approx(bound(sigma, length))
    assert bound(sigma, length * [1.0, 2.0]) > bound(sigma, length) * 1.1
    assert bound(sigma, length * 7.0) == pytest.approx(bound(sigma, length))


def test_walls_at_full_scale_leave_it_less_sure() -> None:
    evidence = witnesses(WIDE, seed=1)
    fitted = fit_ring(evidence, pitch_px=PITCH, wall_px=PITCH / 7, rectifier=None)
    clear, clipped = (
        uncertainty([(evidence, fitted)], pitch_px=PITCH, blur_px=1.0, clipped=share)[0].whole_px
        for share in (0.0, 1.0)
    )
    assert clipped > clear


@pytest.mark.parametrize("kind", ["easy", "shop", "dim", "dark"])
def test_the_true_outline_lies_within_it(kind: str) -> None:
    """Of blocks rendered, through pictures; how well in general, `python -m benchmarks.accuracy.uncertainty` tells."""
    scene = block("rectangle", kind)
    found = wall_tips(scene.picture, TraceSettings())
    assert found.uncertainty_px is not None
    off = distances_to(places_along(scene.truth_px, 1.0), found.contour)
    assert np.mean(off <= found.uncertainty_px) >= 0.95
    assert found.uncertainty_px < 0.2 * scene.pitch_px
