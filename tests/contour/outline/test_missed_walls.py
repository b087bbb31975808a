"""What of the walls an outline may leave outside, and what it may not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from contour.errors import NoBlockFound
from contour.outline.fit import fit_ring
from contour.outline.missed_walls import overlooked, with_bounds
from contour.walls.wall_evidence import EdgePoints, RingEvidence, WitnessKind
from tests.support.pictures.outline_scenes import PITCH, along, circle, errors, perimeter, rectangle, witnesses

BLOCK = rectangle(900.0, 600.0, angle=0.0)
STEP = PITCH / 8
FIT = {"pitch_px": PITCH, "wall_px": 3.0, "rectifier": None}


def with_walls(evidence: RingEvidence, *chains: NDArray[np.float64]) -> RingEvidence:
    """The evidence with wall boundaries, each a chain of corners, in order."""
    points = np.concatenate([dense(chain) for chain in chains])
    total = perimeter(evidence.coarse)
    places = np.arange(0.0, total, 1.0)
    feet, normals = along(evidence.coarse, places)
    nearest = ((points[:, None] - feet[None]) ** 2).sum(axis=2).argmin(axis=1)
    return replace(evidence, walls=EdgePoints(points, places[nearest], normals[nearest]))


def dense(chain: NDArray[np.float64]) -> NDArray[np.float64]:
    """The open chain with points an eighth of a pitch apart."""
    length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(chain, axis=0).T))])
    place = np.arange(0.0, length[-1], STEP)
    return np.column_stack([np.interp(place, length, chain[:, 0]), np.interp(place, length, chain[:, 1])])


def bump(wide: float, high: float) -> NDArray[np.float64]:
    """A wall boundary that leaves the block's upper edge and comes back `wide` pitches on, `high` pitches out."""
    edge = 500.0 - 300.0
    left, right = 700.0 - 0.5 * wide * PITCH, 700.0 + 0.5 * wide * PITCH
    return np.array(
        [
            [left - PITCH, edge + 2.0],
            [left, edge + 2.0],
            [left, edge - high * PITCH],
            [right, edge - high * PITCH],
            [right, edge + 2.0],
            [right + PITCH, edge + 2.0],
        ]
    )


@pytest.mark.parametrize("wide", [0.7, 1.0, 2.0])
def test_a_wall_that_comes_back_to_the_outline_elsewhere_is_overlooked(wide: float) -> None:
    evidence = with_walls(witnesses(BLOCK, seed=1), bump(wide, 0.4))
    bounds, height = overlooked(evidence.walls.points, BLOCK, PITCH, is_hole=False)
    assert len(bounds) >= 1
    assert abs(height - 0.4) < 0.1
    assert (evidence.walls.points[bounds][:, 1] < 200.0).all()


@pytest.mark.parametrize(("wide", "high"), [(0.1, 0.4), (0.3, 2.0), (0.4, 0.3), (0.8, 1.4)])
def test_an_end_of_a_wall_or_debris_that_touches_is_not_overlooked(wide: float, high: float) -> None:
    evidence = with_walls(witnesses(BLOCK, seed=1), bump(wide, high))
    assert overlooked(evidence.walls.points, BLOCK, PITCH, is_hole=False)[1] == 0.0


def test_walls_behind_a_zigzag_edge_are_not_overlooked() -> None:
    evidence = with_walls(witnesses(BLOCK, seed=1), bump(3.0, 0.12))
    assert overlooked(evidence.walls.points, BLOCK, PITCH, is_hole=False)[1] == 0.0


def test_a_bump_is_overlooked_wherever_its_chain_begins() -> None:
    chain = dense(bump(1.0, 0.4))
    for first in range(0, len(chain), 5):
        turned = np.concatenate([chain[first:], chain[:first]])
        evidence = with_walls(witnesses(BLOCK, seed=1), turned)
        assert overlooked(evidence.walls.points, BLOCK, PITCH, is_hole=False)[1] == pytest.approx(0.4, abs=0.1)


def test_walls_in_a_hole_are_overlooked_on_the_side_of_the_opening() -> None:
    hole = with_walls(witnesses(BLOCK, seed=1, hole=True), bump(1.0, -0.4))
    assert overlooked(hole.walls.points, BLOCK[::-1], PITCH, is_hole=True)[1] == pytest.approx(0.4, abs=0.1)
    bumped = with_walls(hole, bump(1.0, 0.4))
    assert overlooked(bumped.walls.points, BLOCK[::-1], PITCH, is_hole=True)[1] == 0.0


def test_the_evidence_keeps_its_own_order_beside_its_bounds() -> None:
    evidence = with_walls(witnesses(BLOCK, seed=1), bump(1.0, 0.4))
    bounds, _ = overlooked(evidence.walls.points, BLOCK, PITCH, is_hole=False)
    more, own = with_bounds(evidence, bounds)
    assert (more.points[own] == evidence.points).all()
    assert (np.diff(more.position) >= 0.0).all()
    assert np.count_nonzero(more.kind == WitnessKind.BOUND) == len(bounds)


def test_the_outline_takes_in_a_corner_whose_cells_are_seen_though_few_walls_end_there() -> None:
    # Along the corner's 4 pitches of edge on either side only one wall end was found; the cells behind are there.
    corner = np.array([250.0, 200.0])
    length = perimeter(BLOCK)
    gaps = ((0.2, 4.5 * PITCH), (length - 4.5 * PITCH, length))
    evidence = witnesses(BLOCK, seed=3, gaps=gaps)
    blind = fit_ring(cut_corner(evidence), pitch_px=PITCH, wall_px=2.5, rectifier=None).ring
    walls = corner + PITCH * np.array([[0.2, 4.2], [0.2, 0.3], [4.2, 0.3]])
    seen = fit_ring(with_walls(cut_corner(evidence), walls), pitch_px=PITCH, wall_px=2.5, rectifier=None).ring
    assert errors(blind, BLOCK).max() > 1.5 * PITCH
    assert errors(seen, BLOCK).max() < 0.5 * PITCH


def cut_corner(evidence: RingEvidence) -> RingEvidence:
    """The evidence with ends of inner walls along a chord of the corner at (250, 200)."""
    share = np.linspace(0.1, 0.9, 6)[:, None]
    ends = (1 - share) * np.array([250.0, 200.0 + 4.5 * PITCH]) + share * np.array([250.0 + 4.5 * PITCH, 200.0])
    total = perimeter(BLOCK)
    position = np.mod(np.linspace(-3.0, 3.0, 6) * PITCH, total)
    order = np.argsort(np.concatenate([evidence.position, position]), kind="stable")
    normal = np.tile(np.array([[-0.7071, -0.7071]]), (6, 1))
    return RingEvidence(
        evidence.coarse,
        evidence.is_hole,
        np.concatenate([evidence.points, ends])[order],
        np.concatenate([evidence.position, position])[order],
        np.concatenate([evidence.normal, normal])[order],
        np.concatenate([evidence.sigma, np.full(6, 0.3)])[order],
        np.concatenate([evidence.kind, np.full(6, WitnessKind.CLEAN, np.int8)])[order],
    )


@pytest.mark.parametrize("height", [220.0, 400.0, 700.0])
@pytest.mark.parametrize("seed", range(3))
def test_an_outline_is_found_though_no_line_goes_past_all_that_it_leaves_out(height: float, seed: int) -> None:
    """Squares of a printed code were like that: 16 witnesses, and hundreds of walls outside of what goes through them.

    With nothing proposed for them all, or a curve that no witness pulls, or an arc of thousands of turns, the fit had
    ended in a fault or never.
    """
    block = rectangle(1.2 * height, height, angle=0.0)
    evidence = witnesses(block, seed=seed, spacing=perimeter(block) / 16)
    crowded = with_walls(evidence, *crags(block, seed))
    bounds, _ = overlooked(crowded.walls.points, fit_ring(evidence, **FIT).ring, PITCH, is_hole=False)
    assert len(bounds) > 5 * len(evidence.points)
    assert 3 <= len(fit_ring(crowded, **FIT).ring) < 100


def crags(block: NDArray[np.float64], seed: int) -> list[NDArray[np.float64]]:
    """Wall boundaries two pitches wide all along a block, which leave it by up to one and a half."""
    rng = np.random.default_rng(seed)
    chains = []
    for foot, normal in zip(*along(block, np.arange(0.0, perimeter(block), 2.6 * PITCH)), strict=True):
        aside, high = PITCH * np.array([-normal[1], normal[0]]), rng.uniform(0.5, 1.44) * PITCH * normal
        left, right = foot - aside, foot + aside
        inside = 3.0 * normal
        chains.append(
            np.array(
                [left - inside, left + rng.uniform(0.2, 1) * high, foot + high, right + 0.6 * high, right - inside]
            )
        )
    return chains


def test_places_that_only_bound_an_outline_make_none() -> None:
    evidence = witnesses(circle(700.0), seed=1)
    bounds = replace(evidence, kind=np.full_like(evidence.kind, WitnessKind.BOUND))
    with pytest.raises(NoBlockFound, match="lie on no line and no arc"):
        fit_ring(bounds, **FIT)
