"""What things are made of, and how they are laid into a picture with their shadow."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from benchmarks.fourth_hand.textures import blur
from benchmarks.fourth_hand.view import View
from benchmarks.other_hand.fields import Field
from contour.geometry.arrays import Float32s


@dataclass(eq=False)
class Body:
    """One solid layer of a thing: where it is and what colour it has, (H, W) and (H, W, 3) float32 from 0 to 1, and how
    it takes light; the rest is pixels where not from 0 to 1.
    """

    alpha: Float32s
    albedo: Float32s
    round_px: float = 2.0
    bump: Field | None = None
    gloss: float = 0.15
    opacity: float | Field = 1.0
    lift: float = 3.0
    drape: float = 0.0  # how far the block's step shows through, in pixels


def lay(picture: Float32s, body: Body, comb: Float32s, view: View, soft: float) -> Float32s:
    """The picture, (H, W, 3) float32, with a body and its shadow on block and table. comb: how much of each pixel is
    block, (H, W); soft: how soft shadows are, 1 much.
    """
    x, y, w, h = cv2.boundingRect((body.alpha > 0).astype(np.uint8))
    margin = int(3 * body.lift + 2 * view.height + 25)
    part = np.s_[max(0, y - margin) : y + h + margin, max(0, x - margin) : x + w + margin]
    cut = replace(
        body,
        alpha=body.alpha[part],
        albedo=body.albedo[part],
        bump=None if body.bump is None else body.bump[part],
        opacity=body.opacity[part] if isinstance(body.opacity, np.ndarray) else body.opacity,
    )
    out = picture.copy()
    out[part] = _shine_on(picture[part], cut, comb[part], view, soft) if w else picture[part]
    return out


def _shine_on(picture: Field, body: Body, comb: Float32s, view: View, soft: float) -> Field:
    """As `lay`, all over a picture."""
    ground = view.lower(body.alpha, 0, view.light * (body.lift + view.height * 0.35 * (1 if body.drape == 0 else 0.4)))
    near = view.lower(body.alpha, 0, view.light * body.lift)
    shade = blur(near, 0.6 + soft * body.lift * 0.3) * comb + blur(ground, 1 + soft * view.height * 0.15) * (1 - comb)
    deep = np.clip(np.mean(body.opacity) * 0.62, 0.08, 1)
    picture = picture * (1 - deep * np.maximum(shade, 0.5 * blur(body.alpha, 2)))[..., None]
    near_edge = cv2.distanceTransform((body.alpha > 0.5).astype(np.uint8), cv2.DIST_L2, 5)
    rim = np.clip(near_edge / np.float32(body.round_px), 0, 1)
    height = np.float32(body.round_px) * np.sqrt(1 - (1 - rim) ** 2)
    height += 0 if body.bump is None else body.bump
    if body.drape:
        height += np.float32(body.drape) * blur(comb, 3.0) + np.float32(0.15 * body.drape) * blur(comb, 1.2)
    height = cv2.GaussianBlur(height.astype(np.float32), (0, 0), 0.8)
    gx, gy = (np.asarray(cv2.Sobel(height, cv2.CV_32F, *way, scale=0.125), np.float32) for way in ((1, 0), (0, 1)))
    norm = 1 / np.sqrt(1 + gx * gx + gy * gy)
    slope = (gx * view.light[0] + gy * view.light[1]).astype(np.float32)
    lambert = np.clip((1 + 0.85 * slope) * norm, 0.12, 1.7)
    shine = np.clip((1.6 + slope) * norm / 1.9, 0, 1) ** 22 * np.float32(body.gloss)
    cover = (body.alpha * body.opacity)[..., None]
    shown = body.albedo * lambert[..., None] * cover
    return np.asarray(picture * (1 - cover) + shown + (shine * body.alpha)[..., None] * 0.7)
