"""How far a contour is from another account of the block: where the picture is busy at the scale of a cell.

The other account knows the cell pitch and nothing else of what the tracing saw: the picture is reduced to about six
pixels a pitch, what stands out from the mean over a pitch is averaged over a pitch, and the block is where that average
is more than half of what it is in busy places nearby. Such an outline is good to about half a pitch, to one where a
scratch or a shadow lies against the block, and has no sense of edges and corners; it is no contour to cut along, but it
shows a part of the block left out, table taken for block, a spike or a notch too narrow to be either, and a contour
that is too fat everywhere. One that is a cell too lean everywhere it cannot tell from a block in a soft shadow.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import cv2
import numpy as np

from contour.acceptance.block_level import exclusive_levels, table_activity
from contour.edge.table_look import shaded_comb
from contour.geometry.arrays import Bools, Bytes, Float32s, Float64s, Int32s, median, quantile
from contour.geometry.rings import Contour, Ring, signed_area
from contour.image.channels import largest
from contour.image.opencv import fewer_vertices, pieces_and_areas, pieces_and_boxes, pieces_of, within
from contour.image.pixel_grid import pixels_of, samples_of, whole_averaged

_PITCH_PX = 6
_SHARE_OF_LEVEL = 0.5
_NEARBY_PITCHES = 8.0
# Of the busiest places in the picture: less is table, however quiet its surroundings.
_LEAST_SHARE = 0.3
_BUSIEST = 0.98
# A missing cell is no opening unless the contour has a hole there, and a scratch is no part of the block.
_OPENING_PITCHES = 2.2
_SCRATCH_PITCHES = 1.8
# How far the busy region reaches beyond the block's edge: half of the window it is averaged over.
_BLUR_PITCHES = 0.5
# So far inside walls may be faint: there they are so busy of what comb is. In the middle of holes it is 0.08 of that,
# of faded walls 0.17 or more; and nothing is a hole that is busier than the table and so much of what comb is.
_FAR_INSIDE_PITCHES, _FAINTEST, _FAINTEST_IN_HOLES = 3.0, 0.12, 0.06
# Fainter ones are none of a hole's where what lies around it, so far, is no busier than that of comb, and nearly all of
# it busier than the table: at holes walls end, elsewhere they fade.
_AROUND_PITCHES, _FADED, _NEARLY_ALL = 1.5, 0.45, 0.05
# Comb in shade is wider: so far its means reach into dark things beside it.
_SHADED_ROOM_PITCHES = 1.3
# Up to so far within a hole its walls count: two windows of a pitch reach a pitch, and half as far again aslant.
_RIM_PITCHES = 1.5
# A corner is cut off by so many edges where both turns are more than the first, and together less than the second; and
# the edges on both sides so long. A piece lies so near the tip; the contour is followed so closely.
_BEVEL, _SIDE_PITCHES, _EVEN_PITCHES = (np.radians(15.0), np.radians(125.0)), 1.5, 0.3
_BEVEL_SIDES, _TIP_PITCHES = (1, 2), 2.0
# What a step aside and down counts for in a distance.
_DIAGONAL = 1.37
_FRACTION_BITS = 4
_POINTS_A_PITCH = 3.0


@dataclass(frozen=True)
class Disagreement:
    """How far contour and busy region are apart at most, in pitches, and where, pixels (x, y).

    pitches: width of the widest place where they differ, or how far a point of the contour lies from the busy region's
    border, whichever is more. claimed: whether the contour has block there where the picture is quiet; else it leaves
    busy picture out. outside_pitches: how far outside of the busy region the contour lies on the whole, the median
    along all rings; negative inside.
    """

    pitches: float
    place_px: tuple[float, float]
    claimed: bool
    outside_pitches: float

    def moved(self, x: float, y: float) -> Disagreement:
        """The same in a picture whose first pixel lies at (-x, -y) of this one's."""
        return replace(self, place_px=(self.place_px[0] + x, self.place_px[1] + y))


def disagreement(
    picture: Bytes, contour: Contour, pitch_px: float, flat: Bytes | None = None, loose: Bytes | None = None
) -> Disagreement:
    """The widest disagreement between the contour, in pixels, and the busy part of `picture`, grey or BGR, uint8.

    `flat`, (h, w) on a grid over the picture, not 0 where something flat that is not the table fills cells or lies over
    them: no account of the edge there, inside the contour or out of it; what hides the edge is another finding.
    `loose`, on such a grid, not 0 on pieces of comb that are told from the block: busy, but none of it.

    Width is that of the largest disc that fits into the difference; a spike or a notch has little, but its tip lies far
    from the busy region's border. Busy parts that the contour does not reach do not count: several blocks are another
    finding. They do in a corner that the contour cuts off: something dark parts them from the block.
    """
    shrink = max(1, int(pitch_px / _PITCH_PX))
    small = whole_averaged(picture, shrink)
    small_pitch_px = pitch_px / shrink
    activity = _activity(small, small_pitch_px)
    holes = _drawn(contour.holes, small.shape[:2], shrink)
    busy = _without_small_gaps(_busy(activity, small_pitch_px), (_OPENING_PITCHES * small_pitch_px) ** 2, holes)
    ours = _drawn(contour.rings, busy.shape, shrink)
    if flat is not None and flat.any():
        there = cv2.resize(flat, busy.shape[::-1], interpolation=cv2.INTER_NEAREST)
        filled = cv2.dilate(there, _disc(_BLUR_PITCHES * small_pitch_px * 2)) > 0
        busy = np.asarray(np.where(filled, ours, busy), np.uint8)
    tips = [samples_of(tip, shrink) for tip in _cut_tips(contour.exterior, pitch_px)]
    in_tips = _beyond(busy, ours, tips, small_pitch_px)
    if loose is not None:
        beside = cv2.resize(loose, busy.shape[::-1], interpolation=cv2.INTER_NEAREST)
        busy = _but(busy, _but(np.asarray(beside * np.uint8(255), np.uint8), ours))
    around = np.asarray(cv2.dilate(ours, _disc(2.0 * _BLUR_PITCHES * small_pitch_px)), np.uint8)
    level = np.asarray(cv2.blur(small, (_odd(small_pitch_px), _odd(small_pitch_px))), np.uint8)
    quiet_table = _but(_inverted(busy), around)
    # Glare hides walls, and scratches crowd; but the one stays as light as the block, the other as the table.
    exclusive = exclusive_levels(level, np.asarray(cv2.bitwise_and(ours, busy), np.uint8), quiet_table)
    # Squares cost a tenth of discs.
    only_block, only_table = (_opened(mask, _square(_SCRATCH_PITCHES * small_pitch_px)) for mask in exclusive)
    theirs = _touched(_opened(_but(busy, only_table), _disc(_SCRATCH_PITCHES * small_pitch_px)), ours)
    busy = np.asarray(cv2.bitwise_or(busy, only_block), np.uint8)
    of_table, of_comb = table_activity(activity, around), median(activity[::2, ::2][ours[::2, ::2] > 0])
    fainter = (activity > max(of_table, _FAINTEST * of_comb)) & (busy == 0)
    shaded = _but(np.asarray(shaded_comb(activity, largest(level), ours, of_table) * np.uint8(255), np.uint8), busy)
    busy = np.asarray(cv2.bitwise_or(busy, _opened(shaded, _square(_SHADED_ROOM_PITCHES * small_pitch_px))), np.uint8)
    busy[_far_inside(fainter, ours, _FAR_INSIDE_PITCHES * small_pitch_px)] = 255
    busy |= _faded(activity, _but(ours, busy), ours, (of_table, _FADED * of_comb), small_pitch_px)
    # The picture's border is no block, and block ends there.
    outside = np.asarray(cv2.distanceTransform(_inverted(busy), cv2.DIST_L2, 3), np.float32)
    inside = _distances(theirs)
    points = _reduced_points(contour, pitch_px / _POINTS_A_PITCH, shrink)
    farthest = [
        (*_widest(_but(ours, busy)), True),
        (*_widest(_but(theirs, around)), False),
        (*in_tips, False),
        (
            *_faint_holes(activity, holes, max(of_table, _FAINTEST_IN_HOLES * of_comb), _RIM_PITCHES * small_pitch_px),
            False,
        ),
        (*_farthest(outside, points, 0.0), True),
        (*_farthest(inside, points, _BLUR_PITCHES * small_pitch_px), False),
    ]
    apart, place, claims = max(farthest, key=lambda one: one[0])
    x, y = pixels_of(np.array(place), shrink).tolist()
    on_the_whole = median(_at(outside, points) - _at(inside, points))
    return Disagreement(apart / small_pitch_px, (x, y), claims, on_the_whole / small_pitch_px)


def _activity(small: Bytes, small_pitch_px: float) -> Float32s:
    """By how much the picture differs from its mean over a pitch, averaged over another, in the channel where most."""
    window = _odd(small_pitch_px)
    off = largest(np.asarray(cv2.absdiff(small, cv2.blur(small, (window, window))), np.uint8))
    return np.asarray(cv2.boxFilter(off, cv2.CV_32F, (window, window)), np.float32)


def _far_inside(fainter: Bools, ours: Bytes, far_px: float) -> Bools:
    """Where, so far inside the contour, walls fade: a hole shows the table."""
    # Few pictures have such a place in the squares that discs of that radius hold, and these are had at once.
    square = np.ones((2 * int(far_px / _DIAGONAL) + 1,) * 2, np.uint8)
    fainter = fainter & (cv2.erode(ours, square, borderType=cv2.BORDER_CONSTANT, borderValue=0) > 0)
    return fainter & (_distances(ours) > far_px) if fainter.any() else fainter


def _faded(activity: Float32s, quiet: Bytes, ours: Bytes, levels: tuple[float, float], small_pitch_px: float) -> Bytes:
    """The quiet pieces, wide enough to count and far inside the contour, that are busier than the first level, in
    surroundings less busy than the other.
    """
    found = np.zeros_like(quiet)
    wide = _opened(quiet, _square(_SCRATCH_PITCHES * small_pitch_px)) > 0
    if not wide.any():
        return found
    far_inside = _far_inside(quiet > 0, ours, _FAR_INSIDE_PITCHES * small_pitch_px)
    labels, boxes = pieces_and_boxes(quiet, 4)
    reach = round(_AROUND_PITCHES * small_pitch_px)
    for number in np.unique(labels[wide]).tolist():
        x, y, across, down = boxes[number, :4].tolist()
        box = slice(max(0, y - reach), y + down + reach), slice(max(0, x - reach), x + across + reach)
        piece, busy = labels[box] == number, activity[box]
        if far_inside[box][piece].all() and quantile(busy[piece], _NEARLY_ALL) > levels[0]:
            beside = (within(piece, reach) > 0) & ~piece
            if median(busy[beside]) < levels[1]:
                found[box][piece] = 255
    return found


def _faint_holes(activity: Float32s, holes: Bytes, level: float, rim_px: float) -> tuple[float, tuple[float, float]]:
    """The widest hole that is busier than that within its rim, as `_widest`: walls fade there."""
    x, y, wide, high = cv2.boundingRect(holes)
    if not wide:
        return 0.0, (0.0, 0.0)
    box = slice(y, y + high), slice(x, x + wide)
    depth = _distances(holes[box])
    _, part = cv2.connectedComponents((depth > rim_px).astype(np.uint8), connectivity=4)
    busy = np.bincount(part[activity[box] > level], minlength=int(part.max()) + 1)
    faint = busy > 0.5 * np.bincount(part.ravel())
    faint[0] = False
    across, (column, row) = _deepest(np.where(faint[part], depth, np.float32(0.0)))
    return across, (x + column, y + row)


def _busy(average: Float32s, small_pitch_px: float) -> Bytes:
    """Where the picture differs from its mean over a pitch as it does in comb, 0 or 255."""
    nearby = _odd(_NEARBY_PITCHES * small_pitch_px)
    squares = cv2.boxFilter(average * average, cv2.CV_32F, (nearby, nearby))
    # The mean that weighs busy places by how busy they are: beside the block it is the block's.
    level = squares / np.maximum(cv2.boxFilter(average, cv2.CV_32F, (nearby, nearby)), 1e-3)
    least = _LEAST_SHARE * quantile(level[::4, ::4], _BUSIEST)
    busy = average > np.maximum(_SHARE_OF_LEVEL * level, least)
    return np.asarray(busy, np.uint8) * np.uint8(255)


def _without_small_gaps(mask: Bytes, area_px2: float, holes: Bytes) -> Bytes:
    labels, area = pieces_and_areas(_inverted(mask), 4)
    small = area < area_px2
    small[labels[holes > 0]] = False
    small[0] = False
    return np.asarray(cv2.bitwise_or(mask, small.astype(np.uint8).take(labels) * np.uint8(255)), np.uint8)


def _opened(mask: Bytes, shape: Bytes) -> Bytes:
    """The mask without what is narrower than the shape."""
    return np.asarray(cv2.morphologyEx(mask, cv2.MORPH_OPEN, shape), np.uint8)


def _drawn(outlines: tuple[Ring, ...], shape: tuple[int, ...], shrink: int) -> Bytes:
    mask = np.zeros(shape, np.uint8)
    rings = [_fixed_point(samples_of(ring, shrink)) for ring in outlines]
    cv2.fillPoly(mask, rings, 255, cv2.LINE_8, _FRACTION_BITS)
    return mask


def _fixed_point(ring: Ring) -> Int32s:
    return np.asarray(np.rint(ring * (1 << _FRACTION_BITS)), np.int32)


def _touched(mask: Bytes, ours: Bytes) -> Bytes:
    """The parts of `mask` that meet `ours`."""
    count, labels = pieces_of(mask, 4)
    meets = np.bincount(labels[ours > 0], minlength=count) > 0
    meets[0] = False
    return meets.astype(np.uint8).take(labels) * np.uint8(255)


def _but(mask: Bytes, other: Bytes) -> Bytes:
    """What is in `mask` and not in `other`."""
    return np.asarray(cv2.bitwise_and(mask, cv2.bitwise_not(other)), np.uint8)


def _inverted(mask: Bytes) -> Bytes:
    return np.asarray(cv2.bitwise_not(mask), np.uint8)


def _distances(mask: Bytes) -> Float32s:
    """Of each pixel in `mask` from what is not, pixels; 0 elsewhere. The picture's border ends a mask too."""
    framed = cv2.copyMakeBorder(mask, 1, 1, 1, 1, cv2.BORDER_CONSTANT)
    return np.asarray(cv2.distanceTransform(framed, cv2.DIST_L2, 3)[1:-1, 1:-1], np.float32)


def _widest(difference: Bytes) -> tuple[float, tuple[float, float]]:
    """Diameter of the largest disc inside, in pixels, and its middle (x, y)."""
    return _deepest(_distances(difference))


def _deepest(depth: Float32s) -> tuple[float, tuple[float, float]]:
    y, x = np.unravel_index(int(depth.argmax()), depth.shape)
    return 2.0 * float(depth[y, x]), (float(x), float(y))


def _beyond(busy: Bytes, ours: Bytes, tips: list[Ring], small_pitch_px: float) -> tuple[float, tuple[float, float]]:
    """How far the farthest busy place in the tips lies from ours, in pixels, and that place (x, y)."""
    if not tips:
        return 0.0, (0.0, 0.0)
    in_tips = np.zeros(busy.shape, np.uint8)
    for tip in tips:
        cv2.fillPoly(in_tips, [_fixed_point(tip)], 255, cv2.LINE_8, _FRACTION_BITS)
    pieces = _opened(_but(busy, ours), _disc(_SCRATCH_PITCHES * small_pitch_px)) & in_tips
    away = np.where(pieces > 0, cv2.distanceTransform(_inverted(ours), cv2.DIST_L2, 3), 0.0)
    y, x = np.unravel_index(int(away.argmax()), away.shape)
    return float(away[y, x]), (float(x), float(y))


def _cut_tips(exterior: Ring, pitch_px: float) -> list[Ring]:
    """The tips of corners that an edge bevels, or two do, where the edges on their sides meet, triangles (3, 2) in
    pixels: chips beside a bevel lie anywhere.
    """
    even = fewer_vertices(exterior, _EVEN_PITCHES * pitch_px)
    if len(even) < 4:
        return []
    edges = np.roll(even, -1, axis=0) - even
    heading, long = edges[:, 0] + 1j * edges[:, 1], np.hypot(*edges.T) / pitch_px
    side = np.sign(signed_area(even))
    tips = []
    for k, sides in itertools.product(range(len(even)), _BEVEL_SIDES):
        first, last = (k - 1) % len(even), (k + sides) % len(even)
        chord = even[last] - even[k]
        along = chord[0] + 1j * chord[1]
        turns = np.angle([along / heading[first], heading[last] / along]) * side
        if min(turns) < _BEVEL[0] or sum(turns) > _BEVEL[1] or min(long[first], long[last]) < _SIDE_PITCHES:
            continue
        # By the law of sines, from the first end of the bevel along the edge before it.
        reach = abs(along) * np.sin(turns[1]) / np.sin(sum(turns))
        corner = even[k] + reach * edges[first] / (long[first] * pitch_px)
        legs = np.array([even[k], even[last]]) - corner
        legs *= np.minimum(1.0, _TIP_PITCHES * pitch_px / np.hypot(*legs.T))[:, None]
        tips.append(np.array([corner, *(corner + legs)]))
    return tips


def _reduced_points(contour: Contour, spacing_px: float, shrink: int) -> Float64s:
    """Points at equal spacing along all rings, in the reduced picture, shape (N, 2)."""
    rings = [_along(ring, spacing_px) for ring in contour.rings]
    return samples_of(np.concatenate(rings), shrink)


def _along(ring: Ring, spacing: float) -> Ring:
    closed = np.concatenate((ring, ring[:1]))
    reached = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(closed, axis=0).T))))
    at = np.linspace(0.0, reached[-1], max(4, int(np.ceil(reached[-1] / spacing))), endpoint=False)
    between = np.column_stack((np.interp(at, reached, closed[:, 0]), np.interp(at, reached, closed[:, 1])))
    # Tips are vertices, and as narrow as they like.
    return np.concatenate((between, ring))


def _at(values: Float32s, points: Float64s) -> Float32s:
    """The values at the pixels that the points lie in, shape (N,)."""
    last = np.array(values.shape[::-1]) - 1
    x, y = np.clip(np.rint(points), 0, last).astype(np.intp).T
    return np.asarray(values[y, x], np.float32)


def _farthest(values: Float32s, points: Float64s, less: float) -> tuple[float, tuple[float, float]]:
    """The largest value at a point, less so much, and that point (x, y)."""
    there = _at(values, points)
    k = int(there.argmax())
    x, y = points[k].tolist()
    return float(there[k]) - less, (x, y)


def _disc(diameter: float) -> Bytes:
    size = _odd(diameter)
    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size)), np.uint8)


def _square(side: float) -> Bytes:
    return np.ones((_odd(side), _odd(side)), np.uint8)


def _odd(length: float) -> int:
    return 2 * round(0.5 * length) + 1
