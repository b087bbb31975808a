"""Tables, and what is drawn or spilt on them."""

from __future__ import annotations

import cv2
import numpy as np

from benchmarks.other_hand.drawings import share
from benchmarks.third_hand.shapes import disc
from benchmarks.third_hand.stage import Spot, Stage
from benchmarks.third_hand.textures import F32, noise, shaded, tiled
from contour.geometry.arrays import Float32s

TABLES = ("plain", "painted", "wood", "brushed", "tslot", "perforated", "rubber", "paper", "grid")


def table_of(st: Stage, style: str) -> Float32s:
    """Colours of a table of one of `TABLES`, (H, W, 3) float32, BGR to 255."""
    r, shape, tone = st.rng, st.x.shape, st.table_tone
    tint = r.uniform(0.75, 1.1, 3) if r.random() < 0.5 else r.uniform(0.95, 1.05, 3)
    colour, turn = (tone * tint).astype(F32), r.uniform(0, np.pi)
    spot = Spot(st.width * r.random(), st.height * r.random(), turn if r.random() < 0.5 else r.normal(0, 0.05), 0)
    u, v = st.frame(spot)
    soft, fine = noise(r, shape, 150 * st.ss), noise(r, shape, 1.6)
    pitch = r.uniform(26, 80) * st.unit
    if style == "wood":
        grain = noise(r, shape, 240, 3, turn) * 0.5 + noise(r, shape, 420, 17, turn) * 0.7 + 0.3 * fine
        table = shaded(colour * np.array([0.7, 0.9, 1.1], F32), grain, r.uniform(0.05, 0.18))
    elif style == "brushed":
        table = shaded(colour, noise(r, shape, 190, 1.5, turn) + soft, r.uniform(0.03, 0.08))
    elif style == "tslot":
        gap = np.abs(np.mod(v, pitch * 3.5) - pitch * 1.7)
        slot = np.clip((gap - pitch * 0.3) * st.ss * 0.7, 0, 1) * 0.8 + 0.2 + 0.15 * (np.abs(gap - pitch * 0.36) < 1.5)
        table = shaded(colour, noise(r, shape, 190, 1.5, -spot.angle), 0.04) * slot[..., None].astype(F32)
    elif style == "perforated":
        away = disc(np.mod(u, pitch) - F32(pitch / 2), np.mod(v, pitch) - F32(pitch / 2), pitch * r.uniform(0.12, 0.3))
        table = shaded(colour, soft + fine, 0.03) * np.clip(away * st.ss + 0.6, r.uniform(0.15, 0.5), 1)[..., None]
    elif style == "rubber":
        ridge = np.sin(v * F32(r.uniform(0.6, 1.6) / st.unit)) * (np.sin(u / F32(st.unit)) if r.random() < 0.4 else 1)
        table = shaded(colour * F32(0.7), 1.2 * ridge + fine * 0.5, r.uniform(0.04, 0.16))
    elif style == "grid":
        tile = np.full((400, 400, 3), colour, np.uint8)
        ink = (colour + (90 if tone < 130 else -70)).clip(0, 255).tolist()
        for k in range(0, 400, 40):
            cv2.line(tile, (k, 0), (k, 400), ink, 3 if k % 200 == 0 else 1, cv2.LINE_AA)
            cv2.line(tile, (0, k), (400, k), ink, 3 if k % 200 == 0 else 1, cv2.LINE_AA)
        table = tiled(tile, u, v, 40 / pitch) * np.clip(1 + 0.03 * soft, 0, 2)[..., None]
    else:
        speckle = np.minimum(noise(r, shape, 5 * st.ss), 1) * (1.5 if style == "painted" else 0.3)
        table = shaded(colour, soft + fine * 0.7 + speckle, r.uniform(0.01, 0.05))
    return np.asarray(table, F32)


def mark_table(st: Stage, style: str) -> None:
    """Put stains, oil, chalk lines, old cuts, swarf or dust on the stage's table, in place."""
    if style in ("stain", "oil", "dust"):
        _spill(st, style)
    else:
        _draw(st, style)


def _spill(st: Stage, style: str) -> None:
    r, shape = st.rng, st.x.shape
    field = noise(r, shape, 120 * st.ss) + 0.35 * noise(r, shape, 25 * st.ss)
    amount = np.clip((field - r.uniform(0.2, 0.9)) * (9 if style == "oil" else 3), 0, 1)[..., None]
    if style == "dust":
        amount = amount * np.clip(noise(r, shape, 2.2), 0, 1)[..., None] * 0.6
    target = st.albedo * F32(r.uniform(0.35, 0.75)) if style != "dust" else np.full(3, 210, F32)
    st.albedo = np.asarray(st.albedo + (target - st.albedo) * amount, F32)
    if style == "oil":
        st.gloss += F32(0.3) * amount[..., 0]


def _draw(st: Stage, style: str) -> None:
    r, shape = st.rng, st.x.shape
    canvas = np.zeros(shape, np.uint8)
    for _ in range(int(r.integers(60, 260)) if style == "swarf" else int(r.integers(2, 9))):
        a = r.random(2) * [shape[1], shape[0]]
        way, turn = r.uniform(3, 16) * st.ss if style == "swarf" else r.uniform(0.2, 1.5) * shape[1], r.uniform(0, 6.3)
        at = a + np.array([np.cos(turn), np.sin(turn)]) * way * np.linspace(-0.5, 0.5, 12)[:, None]
        bend = np.cumsum(r.normal(0, way * 0.02 if style == "swarf" else 0.6, at.shape), 0)
        thick = 1 if style == "cut" else int(r.integers(1, 3 if style == "swarf" else 7))
        cv2.polylines(
            canvas, [np.rint(at + bend).astype(np.int32)], False, int(r.integers(120, 255)), thick, cv2.LINE_AA
        )
    amount = share(canvas)
    if style == "chalk":
        amount = np.asarray(amount * np.clip(0.7 + 0.5 * noise(r, shape, 2.0), 0, 1), F32)
    target = r.uniform(10, 60) if style == "cut" and st.table_tone > 60 else r.uniform(180, 250)
    st.albedo = st.albedo + (F32(target) - st.albedo) * amount[..., None] * F32(0.85)
