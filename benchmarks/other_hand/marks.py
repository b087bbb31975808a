"""What else is on a table or on a core: sheets, swarf and dust, compound, writing, a seam, and a mirrored edge."""

from __future__ import annotations

import cv2
import numpy as np

from benchmarks.other_hand.canvas import WHITE, Canvas
from benchmarks.other_hand.core import Core
from benchmarks.other_hand.drawings import disc, filled, share, sixteenths, stroke
from benchmarks.other_hand.fields import axes, blurred, ramp, smoothstep, spread, tint
from benchmarks.other_hand.layout import Layout
from benchmarks.other_hand.outlines import across, curve, direction, rotated
from contour.geometry.arrays import Bytes, Float64s


def lay_sheet(canvas: Canvas, where: Layout, *, over: bool) -> None:
    """Paper, printed or not, or crumpled foil: over the block's edge, else on the table up to it or under it."""
    rng, edge, angle = canvas.rng, where.edge(canvas.rng), canvas.rng.uniform(0.0, 7.0)
    size = rng.uniform(0.12, (0.5, 0.4)) * canvas.shape[1]
    corners = rotated(np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]]) * size, angle)
    if rng.random() < 0.3:
        corners += rng.uniform(-0.06, 0.06, (4, 2)) * size[0]
    beyond = rng.uniform(1.0, 5.5) if over or rng.random() < 0.5 else rng.uniform(-0.3, 0.1)
    corners += edge.point - edge.outward * (float((corners @ edge.outward).min()) + beyond * where.pitch)
    if rng.random() < 0.4:
        one, other = canvas.noise(rng.uniform(25.0, 90.0)), canvas.noise(rng.uniform(12.0, 40.0))
        texture = 0.45 + 0.28 * np.abs(one) + 0.2 * np.abs(other) + 0.1 * one * other + 0.03 * canvas.noise(3.0)
    else:
        texture = canvas.mottled((2.0, 0.015), (200.0, 0.04))
        if rng.random() < 0.5:
            texture *= 1.0 - 0.7 * share(_print(canvas, corners.mean(axis=0), size, angle))
    texture = np.clip(rng.uniform(0.45, 1.0) * texture, 0.05, 1.6)
    cover = share(filled(canvas.shape, [corners], cv2.LINE_AA))
    if over:
        canvas.cover(cover, texture, WHITE, 3.0)
    else:
        canvas.shade(cover, 4.0, 0.35)
        canvas.paint(cover, texture)


def _print(canvas: Canvas, middle: Float64s, size: Float64s, angle: float) -> Bytes:
    """Lines of words."""
    drawn, rng, along = canvas.blank(), canvas.rng, direction(angle)
    for line in np.arange(-0.42, 0.42, rng.uniform(0.04, 0.09)):
        words = np.cumsum(rng.uniform((0.012, 0.01), (0.02, 0.06), (40, 2))).reshape(-1, 2) - 0.43
        start = middle + across(along) * line * size[1]
        for word in words[words[:, 1] < 0.42]:
            points = start + np.outer(word, along) * size[0]
            stroke(drawn, points, 255, max(1, int(0.012 * size[1])))
    return drawn


def lay_swarf(canvas: Canvas, where: Layout) -> None:
    """Curled chips on the table along the block."""
    rng, chips = canvas.rng, np.zeros((*canvas.shape, 2), np.uint8)
    for _ in range(rng.integers(5, 60)):
        edge = where.edge(rng)
        middle = edge.point + where.pitch * (edge.outward * rng.uniform(0.1, 2.2) + edge.along * rng.uniform(-1.0, 1.0))
        along = rotated(edge.along, rng.standard_normal() * (0.25 if rng.random() < 0.6 else 1.5))
        places = np.linspace(-0.5, 0.5, int(rng.integers(3, 7)))
        bent = np.outer(places, along) + np.outer(0.1 * rng.standard_normal(len(places)), across(along))
        points = curve(middle + where.pitch * spread(rng, 0.7, 7.0) * bent, 40)
        stroke(chips, points, (255.0, rng.uniform(80.0, 240.0)), max(1, round(where.pitch * spread(rng, 0.04, 0.3))))
    cover = share(chips[..., 0])
    canvas.shade(cover, 3.0, 0.5)
    light = np.clip(1.0 + 0.5 * canvas.noise(max(4.0, 0.5 * where.pitch)), 0.15, 1.8)
    canvas.paint(cover, rng.uniform(0.8, 1.2) * light * share(chips[..., 1]) / np.maximum(cover, 0.01))


def strew_dust(canvas: Canvas, where: Layout) -> None:
    """Grains, denser here than there, crumbs and hairs, and a film."""
    rng, count = canvas.rng, int(spread(canvas.rng, 600.0, 24000.0))
    grains, crumbs = np.zeros(canvas.shape, np.float32), canvas.blank()
    rows, columns = (rng.integers(0, size, count) for size in canvas.shape)
    dense = smoothstep(0.5 + 0.5 * canvas.noise(rng.uniform(80.0, 400.0)))[rows, columns]
    grains[rows, columns] = rng.uniform(0.2, 1.0, count) * (rng.random(count) < dense)
    for _ in range(rng.integers(10, 200)):
        place = rng.uniform(0.0, canvas.shape[::-1])
        if rng.random() < 0.75:
            disc(crumbs, place, spread(rng, 1.0, max(1.5, 0.15 * where.pitch)), int(rng.integers(60, 255)))
        else:
            hair = place + np.cumsum(rng.standard_normal((4, 2)) * 0.4 * where.pitch, axis=0)
            stroke(crumbs, curve(hair, 20), int(rng.integers(60, 200)))
    film = np.clip(0.5 + 0.5 * canvas.noise(200.0), 0.0, 1.0) * rng.uniform(0.0, 0.12)
    specks = np.maximum(2.5 * blurred(grains, 0.6), share(crumbs)) * rng.uniform(0.5, 1.0)
    canvas.paint(np.clip(specks + film, 0.0, 0.97), rng.uniform(0.3, 0.9))


def fill_cells(canvas: Canvas, where: Layout, core: Core, cells: Float64s) -> None:
    """Compound in patches of cells, mostly at the edge, up to walls' tops or somewhat over them."""
    rng, middles = canvas.rng, cells.mean(axis=1)
    picked = rng.random(len(cells)) < (0.02 if rng.random() < 0.3 else 0.0)
    for _ in range(rng.integers(1, 6)):
        place = where.edge(rng).point if rng.random() < 0.7 else middles[int(rng.integers(len(cells)))]
        away = rotated(middles - place, rng.uniform(0.0, 7.0)) * (1.0, rng.uniform(0.4, 1.2))
        reach = rng.uniform(0.6, 6.0) * where.pitch * rng.normal(1.0, 0.15, len(cells))
        picked |= np.hypot(*away.T) < reach
    drawn = canvas.blank()
    for cell in sixteenths(cells[picked]):
        cv2.fillConvexPoly(drawn, cell, 255, cv2.LINE_8, 4)
    filling = share(drawn & where.block)
    texture = canvas.mottled((0.7 * where.pitch, rng.uniform(0.02, 0.12)), (2.0, 0.03), (5.0 * where.pitch, 0.05))
    texture *= np.where(canvas.noise(rng.uniform(1.5, 4.0)) > 2.6, 0.5, 1.0)
    texture *= 0.5 + 0.5 * np.clip(1.6 * blurred(filling, 0.08 * where.pitch) - 0.6, 0.0, 1.0)
    bare = canvas.tops * (1.0 - rng.uniform(0.0, 0.7))
    texture *= core.light * spread(rng, 0.12, 1.05)
    canvas.paint(filling * (1.0 - bare), texture, tint(*rng.uniform(0.6, 1.3, 3)))


def write(canvas: Canvas, where: Layout) -> None:
    """Words and lines with a felt pen on walls' tops."""
    rng, ink = canvas.rng, canvas.blank()
    for _ in range(rng.integers(1, 5)):
        thick = max(2, int(where.pitch * spread(rng, 0.15, 0.9)))
        if rng.random() < 0.6:
            ink |= _word(canvas, where, thick)
        else:
            edge = where.edge(rng)
            start = edge.point - where.pitch * (edge.outward * rng.uniform(0.0, 2.0) + 0.5 * rng.standard_normal(2))
            others = where.middle + rng.standard_normal((int(rng.integers(1, 4)), 2)) * 0.3 * where.size
            stroke(ink, curve(np.vstack([start, others]), 80), 255, thick)
    canvas.dim(1.0 - rng.uniform(0.5, 0.93) * share(ink) * canvas.tops)


def _word(canvas: Canvas, where: Layout, thick: int) -> Bytes:
    rng, drawn = canvas.rng, canvas.blank()
    word = "".join(rng.choice(list("ABCDEFGHKLMNPRSTUXZ0123456789-/"), int(rng.integers(2, 9))))
    size = spread(rng, 1.5, 9.0) * canvas.shape[1] / 1400.0
    x, y = where.middle + rng.standard_normal(2) * 0.2 * where.size
    font = cv2.FONT_HERSHEY_SIMPLEX if rng.random() < 0.5 else cv2.FONT_HERSHEY_SCRIPT_SIMPLEX
    (width, height), _ = cv2.getTextSize(word, font, size, thick)
    cv2.putText(drawn, word, (int(x - 0.5 * width), int(y + 0.5 * height)), font, size, 255, thick, cv2.LINE_AA)
    matrix = cv2.getRotationMatrix2D((x, y), rng.uniform(-180.0, 180.0), 1.0)
    return np.asarray(cv2.warpAffine(drawn, matrix, canvas.shape[::-1]), np.uint8)


def glue(canvas: Canvas, where: Layout, core: Core, seam: tuple[Float64s, float]) -> None:
    """Foam along a seam, which hides walls."""
    rng, (normal, offset) = canvas.rng, seam
    away = np.abs(ramp(canvas.shape, normal * offset, normal))
    wide = canvas.mottled((0.5 * where.pitch, 0.35), (2.0 * where.pitch, 0.25)) * rng.uniform(0.15, 0.6) * where.pitch
    foam = smoothstep((wide - away) / 1.5 + 0.5) * share(filled(canvas.shape, where.blocks[0], cv2.LINE_AA))
    texture = core.light * spread(rng, 0.25, 1.0) * canvas.mottled((3.0, 0.1), (0.6 * where.pitch, 0.1))
    texture *= np.where(canvas.noise(rng.uniform(2.0, 5.0)) > 1.4, rng.uniform(0.4, 0.8), 1.0)
    canvas.paint(foam, texture, tint(*rng.uniform(0.6, 1.3, 3)))
    canvas.tops *= foam < 0.5


def mirror(canvas: Canvas, where: Layout) -> None:
    """Add the block's rim to the table beside it, turned over its edge and fading."""
    beside = (where.block == 0).astype(np.uint8)
    away, labels = cv2.distanceTransformWithLabels(beside, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    rows, columns = np.nonzero(where.block)
    rim = np.zeros((labels.max() + 1, 2), np.float32)
    rim[labels[rows, columns]] = np.column_stack([columns, rows])
    x, y = axes(canvas.shape)
    times = canvas.rng.uniform(0.8, 1.6)
    column, row = (rim[labels, axis] * (1.0 + times) - times * place for axis, place in ((0, x), (1, y)))
    seen = cv2.remap(canvas.picture, column, row, cv2.INTER_LINEAR)
    fading = canvas.rng.uniform(0.15, 0.6) * np.exp(-away / (where.pitch * canvas.rng.uniform(0.5, 2.5)))
    soft = blurred(np.asarray(seen, np.float32), canvas.rng.uniform(0.5, 2.0)).reshape(canvas.picture.shape)
    canvas.picture += soft * (fading * beside).astype(np.float32)[..., None]
