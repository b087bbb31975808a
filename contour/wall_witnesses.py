"""Witnesses of a block's outline: from a picture to where its material ends, wall by wall."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from contour.coarse_block import CoarseBlock, coarse_block
from contour.wall_cells import Cells, probe
from contour.wall_ends import edge_chains, find_ends, outermost
from contour.wall_evidence import BlockEvidence, RingEvidence, WitnessKind
from contour.wall_light import light_from_table, wall_light
from contour.wall_mask import WallMask, wall_mask
from contour.wall_parallax import Parallax, parallax
from contour.wall_profile import EndModel, centred_axes, fit_ends, true_width

Gray = NDArray[np.uint8]
Points = NDArray[np.float64]
Vector = NDArray[np.float64]

_HALF_SIZE_ABOVE_PX = 6_000_000
# Sharpest and softest blur that a lens in use leaves; outside of it the fit has seen something else.
_BLUR_PX = (0.4, 3.0)
# What the mask's own light blur (3 × 3) adds.
_MASK_BLUR_PX = 0.8
# Walls of such cells are two pixels wide and more: every second pixel tells their colour.
_SUBSAMPLED_PITCH = 20.0


def see_block(
    picture: NDArray[np.uint8], polarity: str, on_mask: Callable[[], None] = lambda: None
) -> BlockEvidence:
    """Witnesses of the largest block in a picture, grey (H, W) or BGR (H, W, 3), uint8. 

    `on_mask` is called when the wall mask is made. Raises PictureError, NoBlockFound.
    """
    light = wall_light(picture)
    cells = probe(light, polarity)
    if picture.ndim == 3:
        hop = 2 if cells.pitch > _SUBSAMPLED_PITCH else 1
        sample = np.ascontiguousarray(light[::hop, ::hop])
        walls = wall_mask(sample, cells.pitch / hop, bright=cells.bright, contrast=cells.contrast).mask
        coloured = light_from_table(picture, sample, walls, hop)
        if coloured is not None:
            light, cells = coloured, probe(coloured, "bright")
    scale = 2 if light.size > _HALF_SIZE_ABOVE_PX and cells.pitch > 20 and cells.wall > 2.5 else 1
    small = light if scale == 1 else np.asarray(cv2.resize(light, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA), np.uint8)
    seen = wall_mask(small, cells.pitch / scale, bright=cells.bright, contrast=cells.contrast)
    on_mask()
    coarse = coarse_block(seen.mask, cells.pitch / scale, cells.wall / scale)
    return _evidence(light, seen, coarse, cells, scale)


def _evidence(light: Gray, seen: WallMask, coarse: CoarseBlock, cells: Cells, scale: int) -> BlockEvidence:
    pitch, wall = cells.pitch / scale, max(1.0, cells.wall / scale)
    chains = edge_chains(seen.mask, coarse, pitch)
    ends = find_ends(chains, coarse, pitch, wall)
    outer = chains.points[outermost(chains, coarse, pitch)]
    sign = 1.0 if cells.bright else -1.0
    straight = ends.straight * scale
    tip, axis = centred_axes(light, (ends.tip + 0.5) * scale - 0.5, ends.axis, cells.wall, straight, sign)
    clean = straight > 2 * cells.wall + 2
    _, _, normal = coarse.feet(ends.tip)
    model = EndModel(
        width=true_width(cells.wall, np.hypot(0.9, _MASK_BLUR_PX)),
        blur=None,
        height=None,
        noise=seen.noise,
        reach=float(np.clip(0.3 * cells.pitch, 2.5, 2 * cells.wall + 4)),
        out=float(np.clip(0.25 * cells.pitch, 3.0, 6.0)),
        sign=sign,
    )
    depth = parallax(light, tip, axis, straight, cells.wall, sign)
    if depth.width is not None:
        # The top is the half of the band that lies away from the picture's middle.
        across = np.stack([-axis[:, 1], axis[:, 0]], axis=1)
        tip = tip + 0.5 * depth.across(tip, across)[:, None] * across
    model = _learn(light, tip, axis, normal, np.argsort(-straight), model, depth.width or cells.wall, seen.contrast)
    fitted = fit_ends(light, tip, axis, normal, model)
    good = (fitted.sigma < 1.0) & (fitted.height > 0.4 * model.height)
    sigma = np.hypot(np.where(clean, 0.2, 0.3), fitted.sigma)
    kinds = np.where(clean, WitnessKind.CLEAN, WitnessKind.BLUNT).astype(np.int8)
    points, kinds, sigma = fitted.point[good], kinds[good], sigma[good]
    points = _raised(points, normal[good], depth)

    outer = outer[_nearest(outer, (points + 0.5) / scale - 0.5) > 0.3 * pitch]
    _, _, normal = coarse.feet(outer)
    place = (outer + 0.5) * scale - 0.5
    side = fit_ends(light, place, normal, normal, replace(model, width=1.0, reach=min(model.reach, cells.wall)))
    moved = ((side.point - place) * normal).sum(axis=1)
    use = np.abs(moved) < 1.5 * scale
    # Beside a thin wall half height lies outside of it, at its corners and ends inside: about a third of the way is left.
    fat = 0.17 * (cells.wall - model.width)
    place = _raised(np.where(use[:, None], side.point, place) - fat * normal, normal, depth)
    points = np.concatenate([points, place])
    kinds = np.concatenate([kinds, np.full(len(place), WitnessKind.OUTERMOST, np.int8)])
    sigma = np.concatenate([sigma, np.where(use, 0.5, 1.0)])
    rings = _rings(coarse, points, kinds, sigma, scale)
    polarity = "bright" if cells.bright else "dark"
    return BlockEvidence(
        rings, cells.pitch, cells.wall, polarity, model.blur, seen.noise, seen.contrast, coarse.leaves
    )


def _learn(light: Gray, tip: Points, axis: Points, normal: Points, longest: NDArray[np.int64], model: EndModel, wall: float, contrast: float) -> EndModel:
    """The model with blur and height as the straightest ends show them."""
    some = longest[: max(5, min(64, len(longest) // 2))]
    if not len(some):
        return replace(model, blur=0.9, height=contrast)
    free = fit_ends(light, tip[some], axis[some], normal[some], model)
    blur = float(np.clip(np.median(free.blur), *_BLUR_PX))
    width = true_width(wall, float(np.hypot(blur, _MASK_BLUR_PX)))
    return replace(model, width=width, blur=blur, height=float(np.median(free.height)))


def _raised(points: Points, normal: Points, depth: Parallax) -> Points:
    """Points moved from the lower edge of the block's outer side up to its top, where that side is in view."""
    return points + np.minimum(depth.across(points, normal), 0.0)[:, None] * normal if depth.width is not None else points


def _nearest(points: Points, others: Points) -> Vector:
    """Distance from each of `points` (N, 2) to the nearest of `others` (M, 2), shape (N,); inf where there is none."""
    if not len(others) or not len(points):
        return np.full(len(points), np.inf)
    square = ((points[:, None, :] - others[None, :, :]) ** 2).sum(axis=2)
    return np.asarray(np.sqrt(square.min(axis=1)), np.float64)


def _rings(coarse: CoarseBlock, points: Points, kinds: NDArray[np.int8], sigma: Vector, scale: int) -> tuple[RingEvidence, ...]:
    ring, arc, normal = coarse.feet((points + 0.5) / scale - 0.5)
    evidence = []
    for number, one in enumerate(coarse.rings):
        mine = np.flatnonzero(ring == number)
        mine = mine[np.argsort(arc[mine], kind="stable")]
        vertices = (one.vertices + 0.5) * scale - 0.5
        arcs = arc[mine] * scale
        evidence.append(RingEvidence(vertices, one.is_hole, points[mine], arcs, normal[mine], sigma[mine], kinds[mine]))
    return tuple(evidence)
