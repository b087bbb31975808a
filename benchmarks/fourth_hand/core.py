"""The block: its cells, its walls with their depth and shadow, and marks on it."""

from __future__ import annotations

import cv2
import numpy as np

from benchmarks.fourth_hand.drawings import FINE, Place, blob, fill, shrink
from benchmarks.fourth_hand.textures import blur, clouds, mix, paint
from benchmarks.fourth_hand.view import View
from benchmarks.other_hand.fields import Rng, Shape
from contour.geometry.arrays import Float32s


def lattice(rng: Rng, view: View, shape: Shape, pitch: float) -> tuple[Float32s, Float32s]:
    """Walls of cells all over the picture: how much of each pixel they are, and how light, (H, W) float32 from 0 to 1
    both; pitch in pixels.
    """
    h, w = shape
    side = pitch / np.sqrt(3)
    stretch = 1.0 if rng.random() < 0.6 else rng.uniform(0.86, 1.16)
    reach = 0.62 * np.hypot(h, w)
    i, j = np.meshgrid(
        np.arange(-int(2 * reach / pitch) - 2, int(2 * reach / pitch) + 3),
        np.arange(-int(reach / side / 1.5) - 2, int(reach / side / 1.5) + 3),
        indexing="ij",
    )
    even = (i + j) % 2 == 0
    q = np.stack([i * pitch / 2 * stretch, (1.5 * j + np.where(even, 0.25, -0.25)) * side / stretch], -1)
    q = q + rng.normal(0, pitch * rng.choice([0.005, 0.025, 0.06]), q.shape)
    angle = rng.uniform(0, np.pi)
    q = q @ np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]) + (w / 2, h / 2)
    bend = np.stack([clouds(rng, (16, 16), 5), clouds(rng, (16, 16), 5)], -1) * pitch * rng.uniform(0, 0.8)
    where = np.clip(q / (w, h) * 15, 0, 15).astype(np.float32)
    q = q + cv2.remap(bend.astype(np.float32), where[..., 0], where[..., 1], cv2.INTER_LINEAR)
    q = view.place(q.reshape(-1, 2)).reshape(q.shape)
    zig = np.stack([q[:-1], q[1:]], -2)
    bond = np.stack([q[:, :-1], q[:, 1:]], -2)[even[:, :-1]]
    thick = max(1.1, pitch * rng.uniform(0.05, 0.13)) * FINE
    groups = [(zig[even[:-1]], 1.0), (zig[~even[:-1]], 1.0), (bond, rng.uniform(1.0, 2.1))]
    much = np.zeros((h * FINE, w * FINE), np.uint8)
    tone = np.full((h * FINE, w * FINE), 128, np.uint8)
    for segments, wide in groups:
        flat = segments.reshape(-1, 2, 2)
        inside = np.all((flat > -60) & (flat < np.array([w, h]) + 60), axis=(1, 2))
        points = np.round((flat[inside] * FINE + 1) * 16).astype(np.int32)
        facing = rng.uniform(150, 225)
        batch = rng.integers(0, 5, len(points))
        for k in range(5):
            lines, level = list(points[batch == k]), int(np.clip(facing + 16 * (k - 2), 60, 255))
            cv2.polylines(much, lines, False, 255, max(1, round(thick * wide)), cv2.LINE_8, 4)
            cv2.polylines(tone, lines, False, level, max(1, round(thick * wide)) + 2, cv2.LINE_8, 4)
    return shrink(much), shrink(tone)


def wall_paint(rng: Rng, floor: float) -> Float32s:
    """The walls' colour, (3,) float32: bright aluminium, brown or yellow aramid, or dark walls where the floor is
    light.
    """
    choice = rng.random()
    if choice < 0.55:
        return np.asarray(np.array([1.0, 1.0, 0.98]) * rng.uniform(0.55, 0.95), np.float32)
    if choice < 0.85 or floor < 0.25:
        aramid = np.array([rng.uniform(0.25, 0.5), rng.uniform(0.5, 0.72), 0.85])
        return np.asarray(aramid * rng.uniform(0.6, 1.1), np.float32)
    return np.asarray(np.array([0.9, 0.95, 1.0]) * floor * rng.uniform(0.15, 0.4), np.float32)


def block_shadow(comb: Float32s, view: View, soft: float) -> Float32s:
    """The block's shadow on the table, swept along the light, (H, W) float32 from 0 to 1; `soft`: how soft, 1 much."""
    out = np.zeros_like(comb)
    for part in np.linspace(0, 1, 9):
        out = np.maximum(out, view.lower(comb, 1, view.light * view.height * part))
    return blur(out, 0.7 + soft * view.height * 0.25)


def build(
    rng: Rng, table: Float32s, comb: Float32s, cells: tuple[Float32s, Float32s], view: View, paints: Float32s
) -> Float32s:
    """The block on the table, (H, W, 3) float32: layers of walls from the table up to the lit tops. comb: how much of
    each pixel is block, (H, W); cells: of `lattice`; paints: the walls' colour, (3,).
    """
    much, tone = cells
    wall = much * comb
    drop = np.abs(1 - view.sink) * np.linalg.norm(view.nadir - np.array(comb.shape[::-1]) / 2)
    layers = int(np.clip(drop / 2.5, 4, 14))
    see, deep = rng.choice([0.1, 0.35, 0.6]), rng.uniform(0.1, 0.5)
    light = 1 - comb * (1 - np.float32(see))
    own = np.zeros_like(comb)
    for part in np.linspace(1, 0, layers + 1)[:-1]:
        body, lines = view.lower(comb, part) * np.float32(1.1 / layers), view.lower(wall, part)
        level = np.float32(deep * (0.35 + 0.65 * (1 - part)))
        cover = np.maximum(body, lines * np.float32(0.75))
        own = own * (1 - cover) + level * cover * (0.35 + 0.65 * lines)
        light = light * (1 - cover)
    top = tone * np.float32(255 / 170) * (1 + 0.1 * clouds(rng, (comb.shape[0], comb.shape[1]), 200))
    own = own * (1 - wall) + top * wall
    return np.asarray(table * (light * (1 - wall))[..., None] + own[..., None] * paints, np.float32)


def mark_comb(rng: Rng, picture: Float32s, comb: Float32s, place: Place, style: str) -> Float32s:
    """The picture with ink lines, crushed cells, dust or a glare on the block."""
    shape = place.shape
    if style == "ink":
        lines = [
            place.at + np.linspace(-0.3, 1, 30)[:, None] * place.heading(0.9) * place.unit * rng.uniform(0.3, 1)
            for _ in range(3)
        ]
        return mix(picture, fill(shape, lines, rng.uniform(2, 6)) * comb * 0.75, paint(rng, 0.02, 0.3, 1.0))
    at = place.at + place.inward * place.unit * rng.uniform(0.05, 0.3)
    patch = blur(fill(shape, [blob(place, at, place.unit * rng.uniform(0.1, 0.3), 0.15)]), 5) * comb
    if style == "crushed":
        amount = rng.uniform(4, 12)
        grid_x, grid_y = np.meshgrid(np.arange(shape[1], dtype=np.float32), np.arange(shape[0], dtype=np.float32))
        push = [clouds(rng, shape, place.pitch * 0.8) * patch * np.float32(amount) for _ in range(2)]
        x, y = grid_x + push[0], grid_y + push[1]
        crushed = cv2.remap(picture, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)
        return np.asarray(crushed, np.float32)
    if style == "dust":
        return mix(picture, patch * np.clip(clouds(rng, shape, 8, 3) + 0.3, 0, 1) * 0.7, paint(rng, 0.3, 0.8, 0.2))
    return picture + blur(patch, 40)[..., None] * rng.uniform(0.3, 0.9)
