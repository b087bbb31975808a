"""What things look like from above, drawn about an anchor with a direction and a size."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.other_hand.fields import Rng, Shape
from benchmarks.sixth_hand.drawings import blank, fill, lobes, shrink, stroke, turn
from benchmarks.sixth_hand.fields import any_of
from contour.geometry.arrays import Bytes, Float32s, Float64s


@dataclass(frozen=True, eq=False)
class Pose:
    """Where a form lies: its anchor, (2,), the angle along which it goes on outward, radians, its size, and how far it
    is to beyond the picture; pixels.
    """

    anchor: Float64s
    angle: float
    size: float
    far: float

    def put(self, local: Float64s) -> Float64s:
        """Points of the form, (N, 2), x outward from its anchor, in the picture."""
        return np.asarray(self.anchor + local @ turn(self.angle).T)

    def moved(self, by: Float64s) -> Pose:
        """The same elsewhere, by (x, y) pixels."""
        return replace(self, anchor=self.anchor + by)


Draw = Callable[[Bytes, Pose, Rng], None]


def _band(drawn: Bytes, pose: Pose, rng: Rng) -> None:
    """A straight band that ends near the anchor or runs right across."""
    half = pose.size * rng.uniform(0.25, 0.6)
    back = -pose.size * rng.uniform(0.3, 2) if rng.random() < 0.6 else -pose.far
    front = pose.far if rng.random() < 0.6 else pose.size * rng.uniform(1, 5)
    taper = rng.choice([1, 1, rng.uniform(0.5, 1.2)])
    end = np.stack([np.full(7, back), np.linspace(half, -half, 7)], axis=1)
    end[1:-1, 0] += rng.normal(0, rng.choice([0, 0, 0.12]) * half, 5)
    fill(drawn, [pose.put(np.vstack([[(front, -half * taper), (front, half * taper)], end]))])


def _wave(pose: Pose, rng: Rng, start: float, end: float) -> Float64s:
    """A bent line from start to end along the pose, (120, 2), pixels."""
    x = np.linspace(start, end, 120)
    run = pose.size * rng.uniform(3, 12)
    sway = pose.size * rng.uniform(0.2, 1.6) * np.sin(x / run * 3 + rng.uniform(0, 6.3))
    y = sway + (x / pose.far) ** 2 * rng.normal(0, 0.4) * pose.far
    return pose.put(np.stack([x, y - np.interp(0, x, y)], axis=1))


def _curve(drawn: Bytes, pose: Pose, rng: Rng) -> None:
    """A curved band: a cable, a hose or a strap."""
    back = -pose.far if rng.random() < 0.5 else -pose.size * rng.uniform(0.5, 6)
    stroke(drawn, _wave(pose, rng, back, pose.far), pose.size * rng.uniform(0.25, 0.8))


def _polygon(drawn: Bytes, pose: Pose, rng: Rng) -> None:
    """A box or an irregular polygon."""
    count = int(rng.choice([3, 4, 4, 4, 5, 6, 7]))
    theta = (np.arange(count) + (rng.uniform(-0.3, 0.3, count) if count != 4 else 0.5)) * 2 * np.pi / count
    local = np.stack([np.cos(theta) * rng.uniform(0.5, 1.6), np.sin(theta)], axis=1) * pose.size
    fill(drawn, [pose.put(local)])


def _blob(drawn: Bytes, pose: Pose, rng: Rng) -> None:
    """A blob with round lobes."""
    fill(drawn, [pose.put(lobes(rng, rng.uniform(0.2, 0.9)) * pose.size * (rng.uniform(0.7, 1.6), 1))])


def _disc(drawn: Bytes, pose: Pose, rng: Rng) -> None:
    """A disc, at times with a handle outward."""
    theta = np.linspace(0, 2 * np.pi, 90, endpoint=False)
    fill(drawn, [pose.put(np.stack([np.cos(theta), np.sin(theta)], axis=1) * pose.size)])
    if rng.random() < 0.4:
        reach = pose.far if rng.random() < 0.6 else 3 * pose.size
        handle = pose.put(np.array([(0, 0), (reach, rng.normal(0, 0.3) * reach)]))
        stroke(drawn, handle, pose.size * rng.uniform(0.2, 0.9))


def _ring(drawn: Bytes, pose: Pose, rng: Rng) -> None:
    """A ring, whole or open."""
    gap = rng.choice([0, 0, rng.uniform(0.3, 2)])
    theta = np.linspace(gap / 2, 2 * np.pi - gap / 2, 120)
    local = np.stack([np.cos(theta) * rng.uniform(0.7, 1.4), np.sin(theta)], axis=1) * pose.size
    stroke(drawn, pose.put(local), pose.size * rng.uniform(0.12, 0.6))


def _rake(drawn: Bytes, pose: Pose, rng: Rng) -> None:
    """A rake or a brush: a back with teeth toward the block."""
    count, wide = int(rng.integers(3, 16)), pose.size * rng.uniform(0.8, 1.6)
    at = np.linspace(-wide, wide, count)
    thick = wide / count * rng.uniform(0.5, 1.3)
    for y in at:
        tip = (-pose.size * rng.uniform(0.3, 1), y + rng.normal(0, thick / 4))
        stroke(drawn, pose.put(np.array([(pose.size, y), tip])), thick)
    back = pose.size * rng.uniform(0.3, 0.9)
    stroke(drawn, pose.put(np.array([(pose.size, -wide), (pose.size, wide)])), back)
    if rng.random() < 0.6:
        stroke(drawn, pose.put(np.array([(pose.size, 0), (pose.far, rng.normal(0, 0.2) * pose.far)])), back)


def _bundle(drawn: Bytes, pose: Pose, rng: Rng) -> None:
    """A bundle of wires or threads."""
    thick = max(1.5, pose.size * rng.uniform(0.03, 0.15))
    for _ in range(int(rng.integers(3, 14))):
        strand = pose.moved(rng.normal(0, pose.size * rng.uniform(0.1, 0.4), 2))
        strand = replace(strand, angle=strand.angle + rng.normal(0, 0.12))
        stroke(drawn, _wave(strand, rng, -pose.size * rng.uniform(0.5, 4), pose.far), thick)


def _sheet(drawn: Bytes, pose: Pose, rng: Rng) -> None:
    """An irregular sheet with torn edges that goes on outward."""
    wide, back = pose.size * rng.uniform(0.8, 2), -pose.size * rng.uniform(0.3, 1.2)
    front = pose.far if rng.random() < 0.5 else pose.size * rng.uniform(0.8, 3)
    frame = np.array(
        [(back, -wide), (front, -wide * rng.uniform(0.6, 1.4)), (front, wide * rng.uniform(0.6, 1.4)), (back, wide)]
    )
    sides = [np.linspace(a, b, 45, endpoint=False) for a, b in zip(frame, np.roll(frame, -1, axis=0), strict=True)]
    slow = np.repeat(rng.normal(0, 1, (46, 2)), 4, axis=0)[:180]
    torn = np.vstack(sides) + slow * pose.size * rng.choice([0.01, 0.05])
    fill(drawn, [pose.put(torn + rng.normal(0, pose.size * rng.choice([0, 0.01, 0.03]), torn.shape))])


def _hand(drawn: Bytes, pose: Pose, rng: Rng) -> None:
    """A hand: a palm, four fingers, a thumb and an arm."""
    size, side = pose.size, rng.choice([-1, 1])
    stroke(drawn, pose.put(np.array([(0.1, -0.25), (0.1, 0.25), (0.5, 0.1), (0.5, -0.1)]) * size), 0.75 * size)
    spread = rng.uniform(0.05, 0.3)
    for finger in range(4):
        y = (finger - 1.5) * 0.28
        tip = np.array([-rng.uniform(0.5, 1.35), y * (1 + 3 * spread) + rng.normal(0, 0.04)])
        bend = np.array([-0.45, y * (1 + spread) + rng.normal(0, 0.04)])
        stroke(drawn, pose.put(np.array([(0.2, y), bend, tip]) * size), 0.24 * size)
    thumb = np.array([(0.5, 0.3 * side), (0.15, 0.7 * side), (-0.3, side * rng.uniform(0.6, 1.1))])
    stroke(drawn, pose.put(thumb * size), 0.27 * size)
    arm = np.array([(0.5, 0), (pose.far, rng.normal(0, 0.25) * pose.far)])
    stroke(drawn, pose.put(arm), rng.uniform(0.6, 1) * size)


def _tool(drawn: Bytes, pose: Pose, rng: Rng) -> None:
    """A tool or a clamp: a shaft with heads of other forms."""
    width = pose.size * rng.uniform(0.15, 0.4)
    stroke(drawn, pose.put(np.array([(0, 0), (pose.far if rng.random() < 0.6 else 4 * pose.size, 0)])), width)
    for _ in range(int(rng.integers(1, 4))):
        at = pose.put(np.array([rng.uniform(-0.3, 2) * pose.size, 0]))
        head = Pose(at, pose.angle + rng.choice([0, 0, np.pi / 2]), width * rng.uniform(0.7, 1.8), pose.far)
        (_polygon, _ellipse, _ring)[int(rng.integers(3))](drawn, head, rng)


def _ellipse(drawn: Bytes, pose: Pose, rng: Rng) -> None:
    """An ellipse."""
    theta = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    fill(drawn, [pose.put(np.stack([np.cos(theta) * rng.uniform(0.7, 1.5), np.sin(theta)], axis=1) * pose.size)])


FORMS: dict[str, Draw] = {
    "band": _band,
    "curve": _curve,
    "polygon": _polygon,
    "blob": _blob,
    "disc": _disc,
    "ring": _ring,
    "rake": _rake,
    "bundle": _bundle,
    "sheet": _sheet,
    "hand": _hand,
    "tool": _tool,
    "ellipse": _ellipse,
}
COMPACT = ("polygon", "blob", "ellipse", "ring")


def silhouette(name: str, shape: Shape, pose: Pose, rng: Rng) -> Float32s:
    """How much of each pixel of the picture is a form, (H, W) float32 from 0 to 1."""
    drawn = blank(shape)
    FORMS[name](drawn, pose, rng)
    return shrink(drawn)


def any_form(rng: Rng) -> str:
    """One of `FORMS`."""
    return any_of(rng, tuple(FORMS))
