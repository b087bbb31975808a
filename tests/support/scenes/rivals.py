"""What a user would reach for instead: ready-made ways to an outline, given the true cell pitch and polarity.

They get what they cannot find out themselves, so that the comparison is with their best: the pitch sets the closing,
the polarity the threshold's side, specks are dropped before the hull.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from contour.geometry.rings import Contour, Ring

Picture = NDArray[np.uint8]
HULL_POINTS = 20_000
GRABCUT_WIDTH = 640


class RivalFailed(Exception):
    """The ready-made way gave no outline; the message says why."""


@dataclass(frozen=True)
class Hints:
    """What a user would set by hand: the true pitch, and whether walls are dark."""

    pitch_px: float
    dark: bool


def largest_contour(picture: Picture, hints: Hints) -> Contour:
    """Otsu's threshold, `findContours` with external retrieval, the largest."""
    return Contour(_largest(_otsu(picture, hints.dark)))


def closing(picture: Picture, hints: Hints) -> Contour:
    """Otsu's threshold, closing by a disc two pitches wide, the largest contour and its holes of four cells or more."""
    size = 2 * round(hints.pitch_px) + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    border = cv2.copyMakeBorder(_otsu(picture, hints.dark), size, size, size, size, cv2.BORDER_CONSTANT, value=0)
    closed = cv2.morphologyEx(border, cv2.MORPH_CLOSE, disc)[size:-size, size:-size]
    chains, tree = cv2.findContours(np.ascontiguousarray(closed), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_SIMPLE)
    outer = [k for k in range(len(chains)) if tree[0][k][3] < 0 and len(chains[k]) >= 3]
    if not outer:
        raise RivalFailed("the closed mask is empty")
    block = max(outer, key=lambda k: cv2.contourArea(chains[k]))
    holes = [
        _ring(chains[k])
        for k in range(len(chains))
        if tree[0][k][3] == block and cv2.contourArea(chains[k]) > 4.0 * hints.pitch_px**2
    ]
    return Contour(_ring(chains[block]), tuple(holes))


def concave_hull(picture: Picture, hints: Hints) -> Contour:
    """`shapely.concave_hull` of (at most 20 000) wall pixels; parts smaller than a fifth of a cell are dropped."""
    mask = _otsu(picture, hints.dark)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask)
    keep = np.flatnonzero(stats[:, cv2.CC_STAT_AREA] >= max(4.0, 0.2 * hints.pitch_px**2 * 0.2))
    kept = np.zeros(count, dtype=bool)
    kept[keep[keep > 0]] = True
    y, x = np.nonzero(kept[labels])
    if len(x) < 4:
        raise RivalFailed("fewer than four wall pixels")
    chosen = np.random.default_rng(1).permutation(len(x))[:HULL_POINTS]
    hull = shapely.concave_hull(shapely.multipoints(np.column_stack((x[chosen], y[chosen]))), ratio=0.04)
    if not isinstance(hull, shapely.Polygon) or hull.is_empty:
        raise RivalFailed("the hull is no polygon")
    return Contour(np.asarray(hull.exterior.coords, dtype=np.float64)[:-1])


def grabcut(picture: Picture, hints: Hints) -> Contour:
    """GrabCut (five rounds, at most 640 px wide) started from the wall pixels' bounding box, the largest contour."""
    shrink = max(1.0, picture.shape[1] / GRABCUT_WIDTH)
    size = (round(picture.shape[1] / shrink), round(picture.shape[0] / shrink))
    small = cv2.resize(_bgr(picture), size, interpolation=cv2.INTER_AREA)
    walls = cv2.medianBlur(cv2.resize(_otsu(picture, hints.dark), size, interpolation=cv2.INTER_AREA), 3)
    y, x = np.nonzero(walls > 40)
    if len(x) == 0:
        raise RivalFailed("no wall pixels to start from")
    low_x, high_x = np.percentile(x, (0.5, 99.5)).astype(int)
    low_y, high_y = np.percentile(y, (0.5, 99.5)).astype(int)
    box = (
        max(1, low_x - 5),
        max(1, low_y - 5),
        min(size[0] - 2, high_x - low_x + 10),
        min(size[1] - 2, high_y - low_y + 10),
    )
    mask, back, front = np.zeros(size[::-1], dtype=np.uint8), np.zeros((1, 65)), np.zeros((1, 65))
    cv2.setRNGSeed(1)
    cv2.grabCut(small, mask, box, back, front, 5, cv2.GC_INIT_WITH_RECT)
    inside = np.where((mask == cv2.GC_FGD) | (mask == cv2.GC_PR_FGD), 255, 0).astype(np.uint8)
    return Contour((_largest(inside) + 0.5) * shrink - 0.5)


RIVALS: dict[str, Callable[[Picture, Hints], Contour]] = {
    "largest findContours": largest_contour,
    "closing + findContours": closing,
    "shapely.concave_hull": concave_hull,
    "GrabCut": grabcut,
}


def _otsu(picture: Picture, dark: bool) -> Picture:
    grey = picture if picture.ndim == 2 else cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
    kind = cv2.THRESH_BINARY_INV if dark else cv2.THRESH_BINARY
    return np.asarray(cv2.threshold(grey, 0, 255, kind | cv2.THRESH_OTSU)[1], dtype=np.uint8)


def _bgr(picture: Picture) -> Picture:
    return picture if picture.ndim == 3 else np.asarray(cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR), dtype=np.uint8)


def _largest(mask: Picture) -> Ring:
    chains, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    usable = [chain for chain in chains if len(chain) >= 3]
    if not usable:
        raise RivalFailed("the mask has no region of three points")
    return _ring(usable[int(np.argmax([cv2.contourArea(chain) for chain in usable]))])


def _ring(chain: ArrayLike) -> Ring:
    return np.asarray(chain, dtype=np.float64).reshape(-1, 2)
