"""Outlines of blocks in millimetres: exterior counter-clockwise, holes clockwise."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from contour.errors import ParameterError
from contour.geometry.arrays import Float64s
from contour.geometry.rings import Contour, Ring

Point = tuple[float, float]


def polygon(points: Sequence[Point], holes: Sequence[Ring] = ()) -> Contour:
    """The polygon through these points, oriented as contours are."""
    return Contour(_oriented(np.array(points, dtype=np.float64), 1.0), tuple(_oriented(h, -1.0) for h in holes))


def rectangle(centre: Point, width: float, height: float, angle_deg: float = 0.0) -> Contour:
    """A rectangle turned about its centre."""
    w, h = width / 2.0, height / 2.0
    return moved(polygon([(-w, -h), (w, -h), (w, h), (-w, h)]), centre, angle_deg)


def l_shape(centre: Point, width: float, height: float, arm: float, angle_deg: float = 0.0) -> Contour:
    """An L: the upper right of a rectangle is missing, both arms `arm` wide."""
    w, h = width / 2.0, height / 2.0
    points = [(-w, -h), (w, -h), (w, -h + arm), (-w + arm, -h + arm), (-w + arm, h), (-w, h)]
    return moved(polygon(points), centre, angle_deg)


def u_shape(centre: Point, width: float, height: float, arm: float, floor: float, angle_deg: float = 0.0) -> Contour:
    """A U, open upwards: arms `arm` wide, its floor `floor` high."""
    w, h = width / 2.0, height / 2.0
    points = [
        (-w, -h),
        (w, -h),
        (w, h),
        (w - arm, h),
        (w - arm, -h + floor),
        (-w + arm, -h + floor),
        (-w + arm, h),
        (-w, h),
    ]
    return moved(polygon(points), centre, angle_deg)


def disc_ring(centre: Point, radius: float, sagitta: float = 0.002) -> Ring:
    """A circle as a ring whose chords stay within `sagitta` of it, shape (N, 2)."""
    if radius <= 0.0:
        raise ParameterError(f"radius {radius}: expected above 0")
    count = max(12, math.ceil(math.pi / math.acos(max(0.0, 1.0 - sagitta / radius))))
    angle = np.arange(count) * (2.0 * math.pi / count)
    return np.column_stack((centre[0] + radius * np.cos(angle), centre[1] + radius * np.sin(angle)))


def crescent(centre: Point, radius: float, bite_radius: float, bite_shift: float, angle_deg: float = 0.0) -> Contour:
    """A disc without a second disc whose centre lies `bite_shift` to the right."""
    x = (radius**2 - bite_radius**2 + bite_shift**2) / (2.0 * bite_shift)
    if not abs(x) < radius:
        raise ParameterError(f"bite_radius {bite_radius}, bite_shift {bite_shift}: the circles must cross")
    y = math.sqrt(radius**2 - x**2)
    outer = _arc((0.0, 0.0), radius, math.atan2(y, x), math.atan2(-y, x) + 2.0 * math.pi)
    inner = _arc(
        (bite_shift, 0.0),
        bite_radius,
        math.atan2(-y, x - bite_shift) % (2 * math.pi),
        math.atan2(y, x - bite_shift) % (2 * math.pi),
    )
    return moved(Contour(_oriented(np.concatenate((outer[:-1], inner[:-1])), 1.0)), centre, angle_deg)


def blob(centre: Point, radius: float, seed: int, roughness: float = 0.16, waves: int = 5) -> Contour:
    """A smooth free curve around the centre."""
    rng = np.random.default_rng([seed, 21])
    angle = np.arange(720) * (2.0 * math.pi / 720)
    r = np.ones_like(angle)
    for k in range(2, waves + 1):
        r += roughness * rng.uniform(0.3, 1.0) / (k - 0.5) * np.cos(k * angle + rng.uniform(0, 2 * math.pi))
    ring = np.column_stack((np.cos(angle), np.sin(angle))) * (radius * r)[:, None] + np.array(centre)
    return Contour(_oriented(ring, 1.0))


def convex(centre: Point, radius: float, seed: int, corners: int = 7) -> Contour:
    """A convex polygon with its corners on an ellipse, irregularly spaced."""
    rng = np.random.default_rng([seed, 22])
    angle = (np.arange(corners) + rng.uniform(-0.28, 0.28, corners)) * (2.0 * math.pi / corners) + rng.uniform(0, 6)
    ring = np.column_stack((radius * np.cos(angle), radius * rng.uniform(0.65, 1.0) * np.sin(angle))) + np.array(centre)
    return Contour(_oriented(ring, 1.0))


def moved(contour: Contour, shift: Point, angle_deg: float = 0.0) -> Contour:
    """The contour turned about the origin, then shifted."""
    c, s = math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
    turn = np.array([[c, s], [-s, c]])
    return Contour.of(ring @ turn + np.array(shift) for ring in contour.rings)


def broken_off(contour: Contour, start: float, end: float, depth: float, seed: int, pieces: int = 4) -> Contour:
    """The contour without the part beside its exterior between two shares of its length: torn off along a crooked line.

    The line runs from one place to the other in `pieces` straight runs, bulging inwards by `depth`.
    """
    ring = contour.exterior
    edges = np.linalg.norm(np.roll(ring, -1, axis=0) - ring, axis=1)
    reached = np.concatenate(([0.0], np.cumsum(edges)))
    closed = np.concatenate((ring, ring[:1]))
    if not 0.0 <= start < end <= 1.0:
        raise ParameterError(f"start {start}, end {end}: expected 0 <= start < end <= 1")
    at = np.array([start, end]) * reached[-1]
    (ax, bx), (ay, by) = np.interp(at, reached, closed[:, 0]), np.interp(at, reached, closed[:, 1])
    a, b = np.array([ax, ay]), np.array([bx, by])
    share = np.linspace(0.0, 1.0, pieces + 1)[1:-1]
    rng = np.random.default_rng([seed, 23])
    inward = np.array([-(b - a)[1], (b - a)[0]]) / max(float(np.linalg.norm(b - a)), 1e-9)
    bulge = depth * np.sin(math.pi * share) * rng.uniform(0.7, 1.3, len(share))
    share = share + rng.uniform(-0.25, 0.25, len(share)) / pieces
    torn = a + (b - a) * share[:, None] + inward * bulge[:, None]
    kept = ring[(reached[:-1] < at[0]) | (reached[:-1] > at[1])]
    after = int((reached[:-1] < at[0]).sum())
    return Contour(np.concatenate((kept[:after], [a], torn, [b], kept[after:])), contour.holes)


def thick_line(points: Sequence[Point], width: float) -> Contour:
    """The area of a line of this width through points, its ends round."""
    path = np.array(points, dtype=np.float64)
    along = np.gradient(path, axis=0)
    along /= np.maximum(np.hypot(along[:, 0], along[:, 1]), 1e-9)[:, None]
    normal = np.column_stack((-along[:, 1], along[:, 0]))
    angle = np.linspace(0.0, math.pi, 9)[1:-1, None]
    end = path[-1] + 0.5 * width * (np.sin(angle) * along[-1] - np.cos(angle) * normal[-1])
    start = path[0] + 0.5 * width * (np.cos(angle) * normal[0] - np.sin(angle) * along[0])
    sides = (path - 0.5 * width * normal, (path + 0.5 * width * normal)[::-1])
    return Contour(_oriented(np.concatenate((sides[0], end, sides[1], start)), 1.0))


def with_holes(contour: Contour, *holes: Ring) -> Contour:
    """The contour with more holes."""
    return Contour(contour.exterior, (*contour.holes, *(_oriented(hole, -1.0) for hole in holes)))


def _arc(centre: Point, radius: float, start: float, end: float) -> Float64s:
    count = max(4, math.ceil(abs(end - start) * math.sqrt(radius / 0.016)))
    angle = np.linspace(start, end, count + 1)
    return np.column_stack((centre[0] + radius * np.cos(angle), centre[1] + radius * np.sin(angle)))


def _oriented(ring: Ring, sign: float) -> Ring:
    x, y = ring[:, 0], ring[:, 1]
    area = float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))
    return ring if area * sign > 0.0 else np.ascontiguousarray(ring[::-1])


def signed_distance(contour: Contour, points: Float64s) -> Float64s:
    """Distance of points to the contour, positive inside (holes are outside), shape (N,)."""
    nearest = np.full(len(points), np.inf)
    crossings = np.zeros(len(points), dtype=np.int64)
    x, y = points[:, 0], points[:, 1]
    for ring in contour.rings:
        for a, b in zip(ring, np.roll(ring, -1, axis=0), strict=True):
            d = b - a
            share = np.clip(((x - a[0]) * d[0] + (y - a[1]) * d[1]) / max(float(d @ d), 1e-300), 0.0, 1.0)
            nearest = np.minimum(nearest, np.hypot(x - a[0] - share * d[0], y - a[1] - share * d[1]))
            if a[1] != b[1]:
                spans = (a[1] > y) != (b[1] > y)
                crossings += spans & (x < a[0] + (y - a[1]) / (b[1] - a[1]) * d[0])
    return np.where(crossings % 2 == 1, nearest, -nearest)
