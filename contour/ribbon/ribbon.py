"""The direction of the core's ribbon, read from a picture of it, or why it cannot be.

Core is made of ribbons of foil that are glued together along node lines and pulled apart. Of the three directions in
which the walls of its cells run one is the ribbon's (L): its walls are two foils thick, and cells that were not pulled
to regular hexagons are symmetric about it alone. Both are looked at, and neither is believed where the other denies it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from contour.geometry.arrays import Bytes, Float64s, Indices, median
from contour.geometry.rings import Contour
from contour.ribbon.cells import cell_centres
from contour.ribbon.lattice import CellLattice, cell_lattice
from contour.ribbon.wall_widths import wall_profiles

ToMillimetres = Callable[[Float64s], Float64s]

_LEAST_CELLS = 24
_LEAST_WALLS = 20
_SEEN_SHARE = 0.5
_ROUNDS = 8
_SURE = 6.0
"""Standard deviations."""

# Of 85 drawn combs of regular cells, bent as cores are, the longest step differs from the others by 0.017 at most, of
# irregular cells by 0.037. Square cells differ by 0.41; so wide no core is pulled whose ribbons still make corners.
_UNEVEN, _MOST_UNEVEN, _LEAST_UNEVEN = 0.06, 0.33, -0.24
_OTHERS_ALIKE = 0.3
_WIDER, _WIDER_PX, _OTHERS_AS_WIDE = 0.065, 0.15, 0.4
# Of 90 combs of single foils, moved across the walls of one direction by up to 6 px, these walls have up to 1.4 times
# as much light where they return a third more than others, and where they look less than 1.3 times as wide their
# flanks are longer by half of that or more. Doubled ones have up to twice as much light, on flanks nearly as short.
_DOUBLED_LIGHT, _FLATTER, _WIDE = 1.5, 0.45, 1.3
_BY_PARALLAX = 0.5
_TILE_PITCHES, _TILES_ACROSS, _LEAST_TILES, _PAIRS_A_TILE = 3.0, 4.0, 4, 4
_TILES_ALIKE = 1.5
_CLEAR = 2.0


@dataclass(frozen=True)
class Ribbon:
    """Direction of the core's ribbon, degrees in [0, 180) from x, counter-clockwise, in the frame of millimetres, and
    its 95 % bound. told_by: "walls", the doubled ones, "cells", their form, or "walls and cells". Where it is not told
    all three are None and `why` says why not, in words that follow "since".
    """

    angle_deg: float | None = None
    bound_deg: float | None = None
    told_by: str | None = None
    why: str = ""


@dataclass(frozen=True, eq=False)
class CorePicture:
    """What the ribbon is read from. light: (H, W), uint8, in which walls stand out, bright or dark; block: its outline
    in pixels; to_mm: pixels to millimetres; lean_px: by how many pixels, (N, 2), what lies a millimetre below the
    block's top looks moved against what lies there, for places in pixels, (N, 2).
    """

    light: Bytes
    block: Contour
    pitch_px: float
    bright: bool
    to_mm: ToMillimetres
    lean_px: Callable[[Float64s], Float64s]


def read_ribbon(core: CorePicture) -> Ribbon:
    """The ribbon's direction; told only where the walls or the cells tell it clearly, and do not disagree."""
    seen = _seen(core)
    return Ribbon(why=seen) if isinstance(seen, str) else _told(*seen)


def _seen(core: CorePicture) -> tuple[_Walls, _Form] | str:
    """What the picture shows of the core's walls and cells; else what it does not show."""
    pixels = cell_centres(core.light, core.block, core.pitch_px, bright=core.bright)
    if len(pixels) < _LEAST_CELLS:
        return f"{len(pixels)} whole cells are seen in the block, at least {_LEAST_CELLS} are expected"
    places = core.to_mm(pixels)
    affine, *_ = np.linalg.lstsq(np.column_stack([places, np.ones(len(places))]), pixels, rcond=None)
    to_px: Float64s = np.asarray(affine[:2], np.float64)
    pitch = core.pitch_px / math.sqrt(abs(float(np.linalg.det(to_px))))
    lattice = cell_lattice(places, pitch)
    if lattice is None:
        return f"the {len(pixels)} cells that are seen make no even lattice of six neighbours each"
    form = _Form.of(lattice, places, pitch)
    if not form.hexagonal:
        return f"{form.words}, and are no hexagons"
    if len(form.of_parts) < _LEAST_TILES:
        return f"the {len(pixels)} cells that are seen are too few to say how straight the ribbon runs"
    walls = _Walls.of(core, pixels, lattice, to_px)
    return "too few walls are seen between the cells" if walls is None else (walls, form)


def _told(walls: _Walls, form: _Form) -> Ribbon:
    by_walls, by_cells = walls.widest(), form.unlike()
    if by_walls is not None and by_cells is not None and by_walls != by_cells:
        return Ribbon(why="the widest walls and the form of the cells tell different directions")
    family = by_walls if by_cells is None else by_cells
    if family is None:
        return Ribbon(why=f"{walls.words}, and {form.words}")
    angle, bound = form.along(family)
    told = " and ".join(name for name, by in (("walls", by_walls), ("cells", by_cells)) if by is not None)
    return Ribbon(angle, bound, told)


def _along(steps: Float64s) -> Float64s:
    """Of each of three steps the direction of the walls that it crosses, shapes (..., 3, 2) both: from the middle of
    the three cells on one side of it to that of the three on the other.
    """
    one, other, third = steps[..., 0, :], steps[..., 1, :], steps[..., 2, :]
    return np.stack([other + third, one - third, one + other], axis=-2)


def _others(family: int) -> list[int]:
    return [k for k in range(3) if k != family]


@dataclass(frozen=True, eq=False)
class _Walls:
    """Widths and flanks (pixels) and heights (grey levels) of the walls of each family, (3,), the covariance of the
    widths, and how much of each was taken for parallax.
    """

    width: Float64s
    flank: Float64s
    height: Float64s
    covariance: Float64s
    parallax: Float64s

    @classmethod
    def of(cls, core: CorePicture, pixels: Float64s, lattice: CellLattice, to_px: Float64s) -> _Walls | None:
        width, lever, family, typical = [], [], [], []
        for k, (pairs, step, way) in enumerate(zip(lattice.pairs, lattice.steps, _along(lattice.steps), strict=True)):
            along = way @ to_px
            across = np.array([-along[1], along[0]]) / np.hypot(*along)
            middle = 0.5 * (pixels[pairs[:, 0]] + pixels[pairs[:, 1]])
            seen = wall_profiles(
                core.light, middle, across, step_px=float(np.hypot(*(step @ to_px))), bright=core.bright
            )
            good = np.isfinite(seen.width)
            if np.count_nonzero(good) < max(_LEAST_WALLS, _SEEN_SHARE * len(pairs)):
                return None
            width.append(seen.width[good])
            lever.append(np.abs(core.lean_px(middle[good]) @ across))
            family.append(np.full(np.count_nonzero(good), k))
            typical.append((median(seen.flank[good]), median(seen.height[good])))
        every, levers, families = np.concatenate(width), np.concatenate(lever), np.concatenate(family)
        factors, covariance = _fitted(every, levers, families)
        far = np.array([median(one) for one in lever])
        flank, height = np.array(typical).T
        return cls(factors[:3], flank, height, covariance[:3, :3], factors[3] * far)

    def widest(self) -> int | None:
        """The family that is wider than both others, which are alike; None where that is not clear."""
        family = int(np.argmax(self.width))
        one, other = _others(family)
        weights = np.full(3, -0.5)
        weights[family] = 1.0
        gap = float(weights @ self.width)
        clear = (
            gap > _SURE * math.sqrt(float(weights @ self.covariance @ weights))
            and gap > max(_WIDER_PX, _WIDER * float(self.width[[one, other]].mean()))
            and abs(self.width[one] - self.width[other]) < _OTHERS_AS_WIDE * gap
            and abs(float(weights @ self.parallax)) < _BY_PARALLAX * gap
        )
        return family if clear and not self._smeared(family) else None

    def _smeared(self, family: int) -> bool:
        """Whether these walls may look wider since the picture moved across them.

        A doubled wall has more light (width by height) than a single one, a smeared one has what it had, on longer
        flanks, but for what more of it foils return that lie well to the lamp.
        """
        wider, flatter, higher = (
            float(values[family] / values[_others(family)].mean()) for values in (self.width, self.flank, self.height)
        )
        doubled = wider * higher > _DOUBLED_LIGHT
        steep = wider < _WIDE and flatter - 1.0 < _FLATTER * (wider - 1.0)
        return not doubled and not steep

    @property
    def words(self) -> str:
        """How wide the walls look."""
        low, middle, high = np.sort(self.width).tolist()
        return f"walls of the three directions look {low:.2f}, {middle:.2f} and {high:.2f} px wide"


def _fitted(width: Float64s, lever: Float64s, family: Indices) -> tuple[Float64s, Float64s]:
    """Widths of three families and the share of the lever by which walls look wider, (4,), robustly, and covariance.

    A camera sees a wall's side, the more the more it leans in the picture.
    """
    terms = np.column_stack([family == 0, family == 1, family == 2, lever]).astype(np.float64)
    weight = np.ones(len(width))
    factors: Float64s = np.zeros(4)
    inverse: Float64s = np.eye(4)
    spread = 1.0
    for _ in range(_ROUNDS):
        inverse = np.asarray(np.linalg.inv((terms * weight[:, None]).T @ terms + np.diag([0.0, 0.0, 0.0, 1e-3])))
        factors = np.asarray(inverse @ ((terms * weight[:, None]).T @ width))
        off = np.abs(width - terms @ factors)
        spread = max(1.4826 * median(off), 0.02)
        weight = 1.0 / (1.0 + (off / (2.0 * spread)) ** 2)
    return np.asarray(factors, np.float64), np.asarray(inverse * spread**2, np.float64)


@dataclass(frozen=True, eq=False)
class _Form:
    """Steps to neighbours (3, 2), millimetres: of the whole block, and of each of its parts, (T, 3, 2)."""

    steps: Float64s
    of_parts: Float64s

    @classmethod
    def of(cls, lattice: CellLattice, places: Float64s, pitch: float) -> _Form:
        low, size = places.min(axis=0), float(np.ptp(places, axis=0).max())
        tile = max(_TILE_PITCHES * pitch, size / _TILES_ACROSS)
        count = int(size / tile) + 1
        sums = []
        for pairs in lattice.pairs:
            one, other = places[pairs[:, 0]], places[pairs[:, 1]]
            column, row = np.floor((0.5 * (one + other) - low) / tile).astype(np.intp).T
            number = row * count + column
            # A step more of as many pairs as any of the three has says which parts have enough of all.
            pairs_there = np.bincount(number, minlength=count**2)
            moved = [np.bincount(number, way, minlength=count**2) for way in (other - one).T]
            sums.append(np.column_stack([pairs_there, *moved]))
        table = np.stack(sums, axis=1)
        kept = table[(table[:, :, 0] >= _PAIRS_A_TILE).all(axis=1)]
        return cls(lattice.steps, kept[:, :, 1:] / kept[:, :, :1])

    def unlike(self) -> int | None:
        """The step that is longer or shorter than both others, which are alike; None where that is not clear."""
        family, uneven = self._uneven
        length = np.hypot(*self.steps.T)[_others(family)]
        apart = abs(float(length[0] - length[1])) / float(length.mean())
        parts = np.hypot(self.of_parts[:, :, 0], self.of_parts[:, :, 1])
        of_parts = parts[:, family] / parts[:, _others(family)].mean(axis=1)
        deviation = _TILES_ALIKE * float(of_parts.std()) / math.sqrt(len(of_parts))
        clear = abs(uneven) > max(_UNEVEN, _SURE * deviation) and apart < _OTHERS_ALIKE * abs(uneven)
        return family if clear else None

    @property
    def hexagonal(self) -> bool:
        """Whether cells lie as those of a core may."""
        return _LEAST_UNEVEN < self._uneven[1] < _MOST_UNEVEN

    @property
    def _uneven(self) -> tuple[int, float]:
        """The step least like the others, and its length over theirs less one."""
        length = np.hypot(*self.steps.T)
        short, middle, long = np.argsort(length).tolist()
        family = long if length[long] - length[middle] > length[middle] - length[short] else short
        return family, float(length[family] / length[_others(family)].mean() - 1.0)

    def along(self, family: int) -> tuple[float, float]:
        """Direction of this family's walls, degrees in [0, 180), and its 95 % bound: they run across the step."""
        walls, across = _angles(self.steps, family)
        twice = np.exp(2j * walls) + np.exp(2j * across)
        of_parts = _angles(self.of_parts, family)[0]
        off = np.angle(np.exp(2j * (of_parts - walls))) / 2.0
        deviation = _TILES_ALIKE * float(off.std()) / math.sqrt(len(off))
        sheared = abs(float(np.angle(np.exp(2j * (walls - across))))) / 4.0
        return math.degrees(float(np.angle(twice)) / 2.0) % 180.0, math.degrees(math.hypot(_CLEAR * deviation, sheared))

    @property
    def words(self) -> str:
        """How uneven the cells are."""
        return f"its cells are {100 * abs(self._uneven[1]):.1f} % off regular ones"


def _angles(steps: Float64s, family: int) -> tuple[Float64s, Float64s]:
    """Directions of a family's walls, and across its step, radians."""
    walls, step = _along(steps)[..., family, :], steps[..., family, :]
    return np.arctan2(walls[..., 1], walls[..., 0]), np.arctan2(step[..., 0], -step[..., 1])
