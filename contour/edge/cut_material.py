"""Where filled cells end: potting compound, adhesive and crushed cells, cut with the walls around them.

What lies over the edge sticks out of it. What was cut with the block ends on the line of the edges on its two sides, or
inside of both where these meet in a corner.
"""

from __future__ import annotations

import cv2
import numpy as np

from contour.edge.flanks import out_of_flanks
from contour.edge.ring_places import runs_of
from contour.edge.table_look import TableLook
from contour.geometry.arrays import Bools, Bytes, Float64s, Indices
from contour.geometry.ring_lengths import RingLengths
from contour.geometry.rings import Ring, oriented
from contour.geometry.signed_distance import depth_inside
from contour.image.pixel_grid import pixels_of, samples_of
from contour.image.pixel_sampling import planes_of, sample_at
from contour.walls.wall_evidence import EdgePoints, RingEvidence

# How near to its border on the map the material's edge lies, and how far beyond the table may begin: in between is the
# block's shadow.
_EDGE_PITCHES = 0.5
_TABLE_PITCHES = (0.5, 0.75, 1.0, 1.25)
# Ends of walls that belong to a thing lie this near to it.
_TOUCHES_PITCHES = 1.0
# What sticks out of the edge by more than this was not cut with it, nor was what ends so far inside of its two sides'
# lines, as on a curve. So much of a border must be cut.
_FLUSH_PITCHES, _SUNK_PITCHES = 0.18, 0.5
_CUT_SHARE = 0.8
_STEP_PX = 0.5
_LEAST_CONTRAST = 6.0


def cut_material(
    picture: Bytes, clear: RingEvidence, fitted: Ring, distrusted: Float64s, look: TableLook, *, dark: bool = False
) -> EdgePoints:
    """The ends of what fills cells up to the edge, in a picture, grey (H, W) or BGR (H, W, 3), uint8.

    `clear`: the ring's witnesses that lie at nothing foreign; `fitted`: the outline through them, pixels. `distrusted`:
    ends of walls at something foreign, (N, 2). `dark`: what is darker than the table counts, too.
    """
    ring = _with_things(clear, distrusted, look)
    at_thing = look.foreign_at(ring) < _EDGE_PITCHES * look.pitch_px + look.step
    if at_thing.all() or not at_thing.any():
        return EdgePoints()
    border = ring, _normals(ring, max(1, round(0.5 * look.pitch_px / look.step)))
    found = [_cut(picture, (clear, fitted), border, run, look, dark) for run in runs_of(at_thing)]
    return EdgePoints(
        np.concatenate([one.points for one in found]),
        np.concatenate([one.position for one in found]),
        np.concatenate([one.normal for one in found]),
    )


def _cut(
    picture: Bytes,
    seen: tuple[RingEvidence, Ring],
    border: tuple[Ring, Float64s],
    run: Indices,
    look: TableLook,
    dark: bool,
) -> EdgePoints:
    """The run of a border where it is cut material, flush with the edges on its two sides, which go on straight or as
    the outline does that was fitted to what is `seen` of them; none of it where not.
    """
    clear, fitted = seen
    place, normal = border[0][run], border[1][run]
    pitch_px = look.pitch_px
    off, sure = _steps(picture, place, normal, _EDGE_PITCHES * pitch_px)
    ends = place + off[:, None] * normal
    beyond = np.any([look.table_at(place + reach * pitch_px * normal) for reach in _TABLE_PITCHES], axis=0)
    lengths = RingLengths.of(clear.coarse)
    nearest = [int(((clear.coarse - place[end]) ** 2).sum(axis=1).argmin()) for end in (0, -1)]
    first, last = lengths.starts[nearest].tolist()
    curved = (1.0 if clear.is_hole else -1.0) * depth_inside(fitted, ends)
    straight = out_of_flanks(clear, (first, last), ends, pitch_px)
    # What is darker than the table may as well be a shadow beside the block.
    lit = dark | look.lighter_at(place - _EDGE_PITCHES * pitch_px * normal)
    cuts = [
        sure & beyond & lit & (out < _FLUSH_PITCHES * pitch_px) & (out > -_SUNK_PITCHES * pitch_px)
        for out in (straight, curved)
        if out is not None
    ]
    cut = max(cuts, key=np.count_nonzero)
    if np.count_nonzero(cut) < _CUT_SHARE * len(run):
        return EdgePoints()
    share = np.linspace(0.0, 1.0, len(run))[cut]
    position = (first + share * ((last - first) % lengths.length)) % lengths.length
    return EdgePoints(ends[cut], position, normal[cut])


def _with_things(clear: RingEvidence, distrusted: Float64s, look: TableLook) -> Ring:
    """The border of the coarse block together with the things that its walls end at, pixels, positive shoelace."""
    count, parts = cv2.connectedComponents(look.foreign.astype(np.uint8), connectivity=8)
    touching = np.zeros(count, np.bool_)
    grid = np.rint(samples_of(distrusted, look.step)).astype(int)
    reach = round(_TOUCHES_PITCHES * look.pitch_px / look.step)
    for x, y in grid:
        near = parts[max(0, y - reach) : y + reach + 1, max(0, x - reach) : x + reach + 1]
        touching[near] = True
    touching[0] = False
    union = touching[parts].astype(np.uint8)
    cv2.fillPoly(union, [np.rint(samples_of(clear.coarse, look.step)).astype(np.int32)], 1)
    size = 2 * round(0.5 * look.pitch_px / look.step) + 1
    union = np.asarray(
        cv2.morphologyEx(union, cv2.MORPH_CLOSE, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))), np.uint8
    )
    chains, _ = cv2.findContours(union, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    chain = max(chains, key=len)[:, 0, :].astype(np.float64)
    return pixels_of(oriented(chain, counter_clockwise=True), look.step)


def _normals(ring: Ring, half: int) -> Float64s:
    """Outward unit normals of a ring with positive shoelace, over `half` vertices to each side, shape (N, 2)."""
    along = np.roll(ring, -half, axis=0) - np.roll(ring, half, axis=0)
    along = along / np.maximum(np.hypot(*along.T)[:, None], 1e-9)
    return np.stack([along[:, 1], -along[:, 0]], axis=1)


def _steps(picture: Bytes, place: Float64s, normal: Float64s, reach: float) -> tuple[Float64s, Bools]:
    """Distance from each place along its normal to the step in the picture there, shape (N,), pixels, and whether the
    two sides of it differ.
    """
    along = np.arange(-reach, reach + _STEP_PX, _STEP_PX)
    x, y = (place[:, axis, None] + along * normal[:, axis, None] for axis in (0, 1))
    profiles = np.stack([sample_at(plane, x, y) for plane in planes_of(picture)])
    count = np.arange(1, len(along))
    total = np.cumsum(profiles, axis=2)
    low = total[:, :, :-1] / count
    high = (total[:, :, -1:] - total[:, :, :-1]) / count[::-1]
    # The split that leaves the least variance has the most between its sides.
    between = (high - low) ** 2 * (count * count[::-1])
    best = between.max(axis=2).argmax(axis=0)
    row = np.arange(len(place))
    split = between[best, row].argmax(axis=1)
    one, other = low[best, row, split], high[best, row, split]
    return along[split] + 0.5 * _STEP_PX, np.abs(one - other) > _LEAST_CONTRAST
