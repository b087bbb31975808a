"""`wall-tips`: the line along which a block was cut, through the ends of its cell walls."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from contour.coarse_block import CoarseBlock, coarse_block
from contour.wall_cells import probe
from contour.wall_ends import Chains, edge_chains, find_ends, outermost
from contour.wall_evidence import BlockEvidence, RingEvidence, WitnessKind
from contour.wall_light import wall_light
from contour.wall_mask import wall_mask
from contour.wall_profile import FittedEnds, centred_axes, fit_ends

Gray = NDArray[np.uint8]

_HALF_SIZE_ABOVE_PX = 6_000_000


def see_block(picture: NDArray[np.uint8], polarity: str) -> BlockEvidence:
    """Witnesses of the largest block in a picture, grey (H, W) or BGR (H, W, 3), uint8. Raises PictureError, NoBlockFound."""
    light = wall_light(picture)
    cells = probe(light, polarity)
    scale = 2 if light.size > _HALF_SIZE_ABOVE_PX and cells.pitch > 20 and cells.wall > 2.5 else 1
    small = light if scale == 1 else np.asarray(cv2.resize(light, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA), np.uint8)
    pitch, wall = cells.pitch / scale, max(1.0, cells.wall / scale)
    seen = wall_mask(small, pitch, bright=cells.bright)
    coarse = coarse_block(seen.mask, pitch)
    chains = edge_chains(seen.mask, coarse, pitch)
    ends = find_ends(chains, coarse, pitch, wall)
    sign = 1.0 if cells.bright else -1.0
    tip = (ends.tip + 0.5) * scale - 0.5
    reach = float(np.clip(0.3 * cells.pitch, 2.5, 3 * cells.wall + 4))
    tip, axis = centred_axes(light, tip, ends.axis, cells.wall, reach, sign)
    out = float(np.clip(0.25 * cells.pitch, 3.0, 6.0))
    free = fit_ends(light, tip[ends.clean], axis[ends.clean], wall=cells.wall, blur=None, reach=reach, out=out, sign=sign)
    blur = float(np.median(free.blur)) if len(free.blur) >= 5 else 0.9
    fitted = fit_ends(light, tip, axis, wall=cells.wall, blur=blur, reach=reach, out=out, sign=sign)
    points, kinds, sigma = _gather(fitted, ends.clean, chains, outermost(chains, coarse, pitch), coarse, pitch, scale)
    rings = _rings(coarse, points, kinds, sigma, scale)
    return BlockEvidence(
        rings, cells.pitch, cells.wall, "bright" if cells.bright else "dark", blur, seen.noise, seen.contrast
    )


def _gather(
    fitted: FittedEnds,
    clean: NDArray[np.bool_],
    chains: Chains,
    outer: NDArray[np.int64],
    coarse: CoarseBlock,
    pitch: float,
    scale: int,
) -> tuple[NDArray[np.float64], NDArray[np.int8], NDArray[np.float64]]:
    """Ends and, where a stretch of about a pitch has none, outermost wall points: points, kinds, sigmas."""
    kinds = np.where(clean, WitnessKind.CLEAN, WitnessKind.BLUNT).astype(np.int8)
    sigma = np.hypot(np.where(clean, 0.1, 0.3), fitted.sigma)
    good = (fitted.sigma < 1.0) & (fitted.height > 0.3 * np.median(fitted.height))
    points, kinds, sigma = fitted.point[good], kinds[good], sigma[good]
    ring, arc, _ = coarse.feet((points + 0.5) / scale - 0.5)
    extra = chains.points[outer]
    extra_ring, extra_arc, _ = coarse.feet(extra)
    gap = np.full(len(extra), np.inf)
    for number, one in enumerate(coarse.rings):
        mine, theirs = arc[ring == number], extra_arc[extra_ring == number]
        if len(mine):
            away = np.abs(theirs[:, None] - mine[None, :])
            gap[extra_ring == number] = np.minimum(away, one.length - away).min(axis=1)
    filler = (extra[gap > 0.6 * pitch] + 0.5) * scale - 0.5
    return (
        np.concatenate([points, filler]),
        np.concatenate([kinds, np.full(len(filler), WitnessKind.OUTERMOST, np.int8)]),
        np.concatenate([sigma, np.full(len(filler), 1.0)]),
    )


def _rings(
    coarse: CoarseBlock, points: NDArray[np.float64], kinds: NDArray[np.int8], sigma: NDArray[np.float64], scale: int
) -> tuple[RingEvidence, ...]:
    ring, arc, normal = coarse.feet((points + 0.5) / scale - 0.5)
    evidence = []
    for number, one in enumerate(coarse.rings):
        mine = np.flatnonzero(ring == number)
        mine = mine[np.argsort(arc[mine], kind="stable")]
        evidence.append(
            RingEvidence(
                (one.vertices + 0.5) * scale - 0.5,
                one.is_hole,
                points[mine],
                arc[mine] * scale,
                normal[mine],
                sigma[mine],
                kinds[mine],
            )
        )
    return tuple(evidence)
