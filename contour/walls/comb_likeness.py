"""Whether what was taken for a comb can be one: boards, prints and codes have patches side by side, too."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from contour.geometry.arrays import Bools, Float64s, Indices, Int32s, medians

# Walls look wider by about this, and, where blur is wider than that, by it: its full width at half maximum over its
# standard deviation.
WIDER_PX, _BLUR_WIDTH = 1.5, 2.355
FINE_PITCH_PX = 15.0
"""Walls of finer cells look wide, whatever is taken off for that; from this pitch on they look as wide as they are."""
# Of 183 scenes with cells of more than 15 px only foam has walls wider than 0.28 of their pitch, and of 60 that were
# defocused or moved three have 0.31 to 0.32; of prints and boards the narrowest are 0.34.
# Of finer ones, of 5 to 12 px, none has more than 0.3; sheets whose holes are a few pixels have 0.4 and more.
_WIDEST_WALL, WIDEST_FINE = 0.31, 0.35
_REGULAR = 0.5
# But a lattice may have webs as wide as that all around its cells, which stay apart where they are grown by a share of
# a web: of 60 such lattices all do. Squares of a board meet at their corners.
_GROWN, _APART, _IN_ORDER = 0.2, 0.8, 0.5
_FEW_CELLS = 18
_POOR_SCORE = 0.23
# Cells of combs are convex: of 250 scenes none has less than 0.93. Foam has 0.82, letters, codes, weaves and noise 0.54
# to 0.88.
_CONVEX = 0.9
# Foam has order, too: 0.38 at least. Letters between walls as narrow as a comb's, codes and noise have 0.2 at most.
_LEAST_ORDER = 0.3
# Of combs of which broken walls leave few whole cells the least is 0.22; of a few large cells nearly all lie at the
# border. Scratches, nuts, and the squares of a board that lie apart have 0.16 at most.
_ORDER_OF_SCATTERED = 0.18
_SAMPLED = 64
# Six neighbours of a honeycomb's cell are 1 pitch away, of an over-expanded one 0.8 to 1.2, the next ones 1.5.
_NEIGHBOUR_PITCHES = (0.75, 1.35)
_NEIGHBOURS = 4
# However cells are stretched, the nearest neighbours of each lie opposite others, within a share of their distance; so
# many of so many do.
_NEAREST, _OPPOSITE, _OFF = 8, 7, 0.25
# Distances that are one differ by less than this factor, of a triangle's three neighbours, and of the next six.
_TRIANGLES, _EVEN = 9, 1.35
# Of squares 0.67 of cells or more have four such neighbours, of hexagons 0.34 at most, and of those that are drawn out
# 0.62, which fill 0.54 of the circle around them where squares fill 0.64 and look rounder.
_SQUARES, _EVEN_SQUARES, MOSTLY_SQUARES, ROUND_SQUARES = 4, 1.2, 0.55, 0.61


@dataclass(frozen=True)
class Comb:
    """Cells as they were seen: pitch and wall width in pixels, whether walls are bright, the cells counted in the part
    that was looked at, how good a comb they make (0 to 1), and the share that is regular and fills its place (0 to 1).

    order: share of the cells with neighbours all around, a pitch away. solid, circled: shares of its convex hull and of
    the circle around it that a cell fills, the medians. triangular, square: whether its neighbours are those of
    triangles, or of squares and it as round as one.
    apart: share of cells that stay apart where they are grown, 0 to 1. plate: whether holes were seen that show the
    table.
    """

    pitch_px: float
    wall_px: float
    bright: bool
    count: int
    score: float
    regular: float
    order: float = 1.0
    solid: float = 1.0
    circled: float = 1.0
    triangular: bool = False
    square: bool = False
    apart: float = 0.0
    plate: bool = False

    @property
    def cellular(self) -> bool:
        """Whether patches are convex as cells, or lie as cells do."""
        return self.solid >= _CONVEX or self.order >= _LEAST_ORDER

    @property
    def lattice(self) -> bool:
        """Whether cells are many, convex and in good order, and webs lie all around each, however wide."""
        regular = self.order >= _IN_ORDER and self.solid >= _CONVEX
        return regular and self.apart >= _APART and self.count >= _FEW_CELLS

    @property
    def core(self) -> bool:
        """Whether cells may be a honeycomb core's, no holes of a sheet: hexagons, drawn out or bent."""
        return not (self.triangular or self.square or self.plate)

    @property
    def scattered(self) -> bool:
        """Whether patches are many, but lie nowhere as cells do."""
        return self.count >= _FEW_CELLS and self.order < _ORDER_OF_SCATTERED


def surely_comb(comb: Comb) -> bool:
    """Whether cells are so many, convex and orderly that they make a comb, in however many pieces it lies."""
    many = comb.count >= _FEW_CELLS and comb.wall_px < _WIDEST_WALL * comb.pitch_px
    return many and comb.solid >= _CONVEX and comb.order >= _ORDER_OF_SCATTERED


def unlike_comb(comb: Comb, blur_px: float, *, cut: bool = True, shown: bool = True) -> str | None:
    """Why this is no honeycomb, as a sentence with what was measured and what to do; None where it may be one.

    `blur_px`: standard deviation of the picture's blur there; it makes walls look wider, and is taken off. `cut`: its
    border was cut through cells, so that it may be foam. `shown`: cells show the table, so that it may be a lattice.
    """
    sharp_px = math.sqrt(max(comb.wall_px**2 - (_BLUR_WIDTH * blur_px) ** 2, 0.0))
    share = min(sharp_px, comb.wall_px - WIDER_PX) / comb.pitch_px
    # Foam has wide bright walls, and cells of all sizes between them; so has a sheet with letters, which closes them.
    even = not (cut and comb.bright) or comb.regular > _REGULAR
    widest = _WIDEST_WALL if comb.pitch_px > FINE_PITCH_PX else WIDEST_FINE
    if share > widest and even and not (comb.plate or (comb.lattice and shown)):
        return (
            f"what lies between patches {comb.pitch_px:.0f} px apart is {100 * share:.0f} % as wide as that, cell "
            f"walls are {100 * widest:g} % at most: a board, a print, a perforated plate, or foam whose cells "
            "are closed. Check that a block lies in view, and set edge: cells for a plate or foam"
        )
    if not comb.cellular:
        return (
            f"patches {comb.pitch_px:.0f} px apart fill {100 * comb.solid:.0f} % of their convex hulls, and "
            f"{100 * comb.order:.0f} % of them have neighbours all around; at least {100 * _CONVEX:.0f} % or "
            f"{100 * _LEAST_ORDER:.0f} % are expected of cells: a print. Check that a block lies in view, and remove "
            "prints and codes"
        )
    if comb.scattered:
        return (
            f"{100 * comb.order:.0f} % of {comb.count} patches have neighbours all around {comb.pitch_px:.0f} px away, "
            f"at least {100 * _ORDER_OF_SCATTERED:.0f} % are expected of cells. Check that a block lies in view, and "
            "clear the table"
        )
    if comb.count < _FEW_CELLS and comb.score < _POOR_SCORE:
        return (
            f"{comb.count} patches that make {100 * comb.score:.0f} % of a comb are no block, at least {_FEW_CELLS} "
            f"patches or {100 * _POOR_SCORE:g} % are expected. Check that a block lies in view, "
            "and remove prints and codes"
        )
    return None


def lattice_order(places: Float64s, pitch_px: float) -> tuple[float, float, float]:
    """Share of cells with neighbours all around, 0 to 1; centroids of cells (N, 2), pixels: four or more about a pitch
    away, or three nearer ones and then six, as triangles have, or where none of that is so opposite each other. And the
    shares of those alone that are like triangles, and like squares.
    """
    some = places[_spread(len(places))]
    distances = (some[:, :1] - places[:, 0]) ** 2 + (some[:, 1:] - places[:, 1]) ** 2
    square = distances / pitch_px**2

    def between(low: float, high: float) -> Indices:
        return np.asarray(((square > low**2) & (square < high**2)).sum(axis=1), np.intp)

    around = between(*_NEIGHBOUR_PITCHES) >= _NEIGHBOURS
    triangles = float(np.mean(_among_triangles(distances)))
    order = max(float(np.mean(around)), triangles)
    if order < _LEAST_ORDER:
        order = max(order, float(np.mean(_opposite(some, places, distances))))
    return order, triangles, float(np.mean(_among_squares(distances)))


def _opposite(some: Float64s, places: Float64s, square: Float64s) -> Bools:
    """Which cells (K, 2) have nearest neighbours opposite each other; centroids of all (N, 2), squared distances."""
    if len(places) <= _NEAREST:
        return np.zeros(len(some), np.bool_)
    nearest = np.argsort(square, axis=1)[:, 1 : 1 + _NEAREST]
    step = places[nearest] - some[:, None]
    beyond = (some[:, None] - step)[:, :, None] - places
    off = np.hypot(beyond[..., 0], beyond[..., 1]).min(axis=2)
    met = off < _OFF * np.hypot(step[..., 0], step[..., 1])
    return np.asarray(np.count_nonzero(met, axis=1) >= _OPPOSITE)


def _among_triangles(square: Float64s) -> Bools:
    """Which cells have three neighbours at one distance and the next six at √3 of it, whatever their pitch looks like:
    squared distances to all cells, themselves too, (N, M).
    """
    ordered = _nearest(square, _TRIANGLES)
    near, far = ordered[:, :3], ordered[:, 3:]
    even = (near[:, -1] < _EVEN * near[:, 0]) & (far[:, -1] < _EVEN * far[:, 0])
    return np.asarray(even & (far[:, 0] > _EVEN * near[:, -1]))


def _among_squares(square: Float64s) -> Bools:
    """Which cells have four neighbours at one distance and the next ones at √2 of it, as `_among_triangles`."""
    near = _nearest(square, 1 + _SQUARES)
    return np.asarray((near[:, -2] < _EVEN_SQUARES * near[:, 0]) & (near[:, -1] > _EVEN_SQUARES * near[:, -2]))


def _nearest(square: Float64s, count: int) -> Float64s:
    """How far each cell's nearest so many others are, in their order, (N, count), by squared distances to all cells,
    itself too, (N, M); nowhere, 0, where there are fewer.
    """
    if square.shape[1] <= count:
        return np.zeros((len(square), count))
    return np.sqrt(np.sort(np.partition(square, count, axis=1)[:, 1 : 1 + count], axis=1))


def apart(labels: Int32s, numbers: Indices, wall_px: float) -> float:
    """The share of pieces, by their numbers, that stay apart where each is grown by a share of the walls' width."""
    chosen = np.zeros(int(labels.max()) + 1, np.uint8)
    chosen[numbers] = 1
    size = 2 * round(_GROWN * wall_px) + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    count, _ = cv2.connectedComponents(cv2.dilate(chosen.take(labels), disc), connectivity=4)
    return float(count - 1) / max(1, len(numbers))


def filled_shares(labels: Int32s, numbers: Indices, stats: Int32s) -> tuple[float, float]:
    """Median shares of their convex hull and of the circle around them that pieces fill, by their numbers, 0 to 1."""
    shares = []
    for number in numbers[_spread(len(numbers))]:
        left, top, wide, high, area = stats[number].tolist()
        piece = (labels[top : top + high, left : left + wide] == number).astype(np.uint8)
        outlines, _ = cv2.findContours(piece, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        hull = cv2.convexHull(outlines[0])
        # Pixels have an area, the polygon through their centres lacks half of its boundary and one more.
        convex = cv2.contourArea(hull) + 0.5 * cv2.arcLength(hull, True) + 1.0
        shares.append((area / convex, circled(area, hull)))
    solid, round_ = medians(np.array(shares), axis=0).tolist()
    return solid, round_


def circled(area: float, outline: Int32s) -> float:
    """The share of the circle around a piece of so many pixels that it fills; outline: as OpenCV finds contours."""
    _, radius = cv2.minEnclosingCircle(outline)
    # It runs through the centres of the outermost pixels.
    return float(area / (np.pi * (radius + 0.5) ** 2))


def _spread(count: int) -> Indices:
    return np.linspace(0, count - 1, min(count, _SAMPLED)).astype(np.intp)
