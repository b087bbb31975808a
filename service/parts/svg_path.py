"""An SVG path's data as points: read by fontTools, curves as chords."""

from __future__ import annotations

import cmath
import math

import numpy as np

from contour.geometry.arrays import Float64s
from service.parts.part import PartFileError

_MOST_CHORDS = 10_000
Point = tuple[float, float]


def path_strokes(data: str, chord: float) -> list[tuple[Float64s, bool]]:
    """Each subpath's points (N, 2) and whether it is closed, chords within `chord` of their curves.

    Raises ValueError where the data is none, PartFileError where what reads it is not installed.
    """
    try:
        from fontTools.svgLib.path.parser import parse_path  # type: ignore[import-untyped]
    except ImportError as error:
        raise PartFileError("is SVG, which needs fontTools. Install: pip install 'combtrace[export]'") from error
    pen = _Pen(chord)
    parse_path(data, pen)
    return [(np.array(points, dtype=np.float64), closed) for points, closed in pen.runs]


class _Pen:
    """Takes what a path is made of, by the names that fontTools calls."""

    def __init__(self, chord: float) -> None:
        self._chord = chord
        self.runs: list[tuple[list[Point], bool]] = []

    def moveTo(self, point: Point) -> None:  # noqa: N802
        self.runs.append(([point], False))

    def lineTo(self, point: Point) -> None:  # noqa: N802
        self.runs[-1][0].append(point)

    def curveTo(self, *points: Point) -> None:  # noqa: N802
        """A cubic curve."""
        self._curve(points)

    def qCurveTo(self, *points: Point) -> None:  # noqa: N802
        """A quadratic one."""
        self._curve(points)

    def closePath(self) -> None:  # noqa: N802
        self.runs[-1] = (self.runs[-1][0], True)

    def endPath(self) -> None:  # noqa: N802
        """An open subpath stays open."""

    def arcTo(self, rx: float, ry: float, rotation: float, large: bool, sweep: bool, end: Point) -> None:  # noqa: N802
        """An elliptical arc, by its centre (SVG 1.1, F.6.5)."""
        start, stop = complex(*self.runs[-1][0][-1]), complex(*end)
        rx, ry = abs(rx), abs(ry)
        if start == stop:
            return
        if not (rx and ry):
            self.lineTo(end)
            return
        turn = cmath.exp(1j * math.radians(rotation))
        half = (start - stop) / 2 / turn
        x, y = half.real / rx, half.imag / ry
        # Radii too small to span the ends grow until they do.
        grow = max(math.hypot(x, y), 1.0)
        rx, ry, x, y = rx * grow, ry * grow, x / grow, y / grow
        root = math.sqrt(max(1.0 / (x * x + y * y) - 1.0, 0.0)) * (-1.0 if bool(large) == bool(sweep) else 1.0)
        centre = complex(root * y, -root * x)
        first = cmath.phase(complex(x, y) - centre)
        span = cmath.phase(complex(-x, -y) - centre) - first
        span = span % (2 * math.pi) if sweep else -(-span % (2 * math.pi))
        step = 2 * math.acos(max(1.0 - self._chord / max(rx, ry), 0.0))
        count = _count(abs(span) / max(step, 1e-9))
        middle = (start + stop) / 2 + complex(centre.real * rx, centre.imag * ry) * turn
        for k in range(1, count):
            angle = first + span * k / count
            place = middle + complex(rx * math.cos(angle), ry * math.sin(angle)) * turn
            self.lineTo((place.real, place.imag))
        self.lineTo(end)

    def _curve(self, points: tuple[Point, ...]) -> None:
        """A Bézier curve in equal steps of its parameter: a chord's sagitta is at most n (n − 1) / 8 of the largest
        second difference, over the square of the number of chords (Wang 1984).
        """
        control = np.array([self.runs[-1][0][-1], *points], dtype=np.float64)
        degree = len(control) - 1
        bend = float(np.hypot(*np.diff(control, 2, axis=0).T).max())
        count = _count(math.sqrt(degree * (degree - 1) / 8 * bend / self._chord))
        share = np.arange(1, count + 1)[:, None] / count
        terms = [math.comb(degree, k) * share**k * (1 - share) ** (degree - k) * control[k] for k in range(degree + 1)]
        self.runs[-1][0].extend((x, y) for x, y in sum(terms[1:], terms[0]).tolist())


def _count(chords: float) -> int:
    """A whole number of chords; raise ValueError for more than any part needs."""
    if not chords <= _MOST_CHORDS:
        raise ValueError(f"a curve needs {chords:.3g} chords, expected {_MOST_CHORDS} at most; check the units")
    return max(math.ceil(chords), 1)
