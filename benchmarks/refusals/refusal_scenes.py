"""Pictures without a whole block, each with the reasons by which it may be refused.

A family makes pictures of one kind from a seed. `tuned-…` pictures were looked at while thresholds were chosen; the
others come from other seeds and were only measured.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.refusals import drawn_tables
from contour.synthetic import (
    Clutter,
    Light,
    Scene,
    Sensor,
    Table,
    camera_above,
    convex,
    moved,
    rectangle,
    render,
    truth_px,
)
from tests.support.scenes.bench_scenes import MIDDLE, SHAPES, shop

Picture = NDArray[np.uint8]
Family = Callable[[np.random.Generator], Picture]

NO_BLOCK = frozenset({"no_block_found"})
QUALITY = frozenset({"image_quality"})
BORDER = frozenset({"touches_border"})
SEVERAL = frozenset({"several_blocks"})
# A pattern that runs out of the picture is no block in view, or one that is cut off: both send a person to the table.
PATTERN = NO_BLOCK | BORDER
# Prints that look like cells end somewhere else than the sheet they are on.
PRINT = NO_BLOCK | {"methods_disagree"}

# A number that was looked at and led to a change is not fresh any more: begin after it then.
FIRST = 11

# No lens: far from the picture's middle its model folds back, and a block that is out of view would be in it.
_CAMERA = camera_above(1280, 960, 0.375, target_mm=MIDDLE, tilt_deg=(1.2, -0.8), roll_deg=0.5)
_FAR_AWAY = rectangle((240.0, 3000.0), 100.0, 100.0)


@dataclass(frozen=True)
class RefusalScene:
    """A picture, made when it is asked for, and the names of reasons that are right for it."""

    name: str
    right: frozenset[str]
    make: Callable[[], Picture]

    @property
    def tuned(self) -> bool:
        """Whether it was looked at while thresholds were chosen."""
        return self.name.startswith("tuned-")


def refusal_scenes(measured_of_each: int = 2, first: int = FIRST) -> tuple[RefusalScene, ...]:
    """One tuned picture of every family, and as many for measuring as asked for, numbered from `first`."""
    return tuple(
        _scene(f"tuned-{name}" if number == 0 else f"{name}-{number}", family, right)
        for name, (family, right) in FAMILIES.items()
        for number in (0, *range(first, first + measured_of_each))
    )


def _scene(name: str, family: Family, right: frozenset[str]) -> RefusalScene:
    seed = zlib.crc32(name.encode())
    return RefusalScene(name, right, lambda: family(np.random.default_rng(seed)))


def _shop(rng: np.random.Generator, outline: Any = None, **changes: Any) -> Scene:
    """A shop-floor block, its cells anywhere."""
    shape = str(rng.choice(["rectangle", "convex", "l", "blob"]))
    chosen = SHAPES[shape](int(rng.integers(0, 1000))) if outline is None else outline
    scene = shop("refusal", chosen, camera=_CAMERA, **changes)
    pitch = float(rng.uniform(6.0, 12.0))
    cells = replace(
        scene.cells,
        pitch_mm=pitch,
        wall_mm=pitch * float(rng.uniform(0.07, 0.1)),
        ribbon_deg=float(rng.uniform(0.0, 180.0)),
    )
    return replace(scene, cells=cells, seed=int(rng.integers(1, 100_000)))


def _empty(rng: np.random.Generator, **changes: Any) -> Picture:
    return render(_shop(rng, _FAR_AWAY, **changes)).picture


def _empty_plain(rng: np.random.Generator) -> Picture:
    return _empty(rng, table=Table(level=float(rng.uniform(0.08, 0.6)), texture=0.015))


def _empty_chips(rng: np.random.Generator) -> Picture:
    return _empty(rng, clutter=Clutter(specks=int(rng.integers(100, 600)), debris=int(rng.integers(80, 400))))


def _empty_vacuum(rng: np.random.Generator) -> Picture:
    table = Table(
        level=float(rng.uniform(0.15, 0.5)),
        perforation_pitch_mm=float(rng.uniform(10.0, 30.0)),
        perforation_mm=float(rng.uniform(3.0, 5.0)),
        groove_pitch_mm=float(rng.choice([0.0, 60.0, 80.0])),
        scratches=15,
        texture=0.02,
    )
    return _empty(rng, table=table)


def _out_of_focus(rng: np.random.Generator) -> Picture:
    scene = _shop(rng)
    sharp = render(scene).picture
    pitch_px = scene.cells.pitch_mm / 0.375
    return np.asarray(cv2.GaussianBlur(sharp, (0, 0), pitch_px * float(rng.uniform(0.22, 0.8))), np.uint8)


def _shaken(rng: np.random.Generator) -> Picture:
    """Moved during the exposure by half a pitch or more."""
    scene = _shop(rng)
    sharp = render(scene).picture
    length = round(scene.cells.pitch_mm / 0.375 * float(rng.uniform(0.6, 1.5)))
    kernel = np.zeros((2 * length + 1, 2 * length + 1), np.float32)
    way = length / 2 * np.array([np.cos(angle := rng.uniform(0, np.pi)), np.sin(angle)])
    start, end = (tuple(np.rint(length + sign * way).astype(int).tolist()) for sign in (-1, 1))
    cv2.line(kernel, start, end, 1.0, 1, cv2.LINE_AA)
    return np.asarray(cv2.filter2D(sharp, -1, kernel / kernel.sum(), borderType=cv2.BORDER_REPLICATE), np.uint8)


def _overexposed(rng: np.random.Generator) -> Picture:
    level = float(rng.uniform(9.0, 20.0))
    return render(_shop(rng, light=Light(level=level, gradient=0.3, vignetting=0.2))).picture


def _underexposed(rng: np.random.Generator) -> Picture:
    return render(_shop(rng, light=Light(level=float(rng.uniform(0.004, 0.015)), gradient=0.3, vignetting=0.2))).picture


def _fogged(rng: np.random.Generator) -> Picture:
    """A dirty window before the lens: walls stand out by a level or two, under as much noise."""
    scene = _shop(rng, sensor=Sensor(shot_noise=0.0, read_noise=0.0))
    clear = render(scene).picture.astype(np.float32)
    haze = float(rng.uniform(60.0, 180.0)) + (clear - clear.mean()) * float(rng.uniform(0.006, 0.015))
    return np.clip(np.rint(haze + rng.normal(0.0, 2.0, haze.shape)), 0, 255).astype(np.uint8)


def _at_border(dx: float, dy: float) -> Family:
    """A block of which 4 to 150 px lie outside of the picture, on the sides that (dx, dy) point to."""

    def make(rng: np.random.Generator) -> Picture:
        scene = _shop(rng, convex(MIDDLE, float(rng.uniform(110.0, 140.0)), int(rng.integers(0, 999))))
        seen = truth_px(scene).exterior
        over = np.exp(rng.uniform(np.log(4.0), np.log(150.0), 2))
        right, down = 1279.0 - seen[:, 0].max(), 959.0 - seen[:, 1].max()
        shift_px = np.array(
            [
                dx * (over[0] + (right if dx > 0 else seen[:, 0].min())),
                -dy * (over[1] + (down if dy < 0 else seen[:, 1].min())),
            ]
        )
        shift = shift_px * [0.375, -0.375]
        return render(replace(scene, outline=moved(scene.outline, (float(shift[0]), float(shift[1]))))).picture

    return make


def _just_touching(rng: np.random.Generator) -> Picture:
    """A straight edge that lies along the frame, within a pixel of it, or just outside."""
    scene = _shop(rng)
    edge = _CAMERA.back_project(np.array([[float(rng.uniform(-1.0, 1.0)), 480.0]]), scene.thickness_mm)[0, 0]
    turn = 0.5  # as the camera is rolled
    return render(replace(scene, outline=rectangle((float(edge) + 120.0, 180.0), 240.0, 220.0, turn))).picture


def _wider_than_view(rng: np.random.Generator) -> Picture:
    return render(_shop(rng, rectangle(MIDDLE, 900.0, 900.0, float(rng.uniform(0.0, 90.0))))).picture


def _two_equal(rng: np.random.Generator) -> Picture:
    one = rectangle((0.0, 0.0), 170.0, 200.0, float(rng.uniform(-15.0, 15.0)))
    other = moved(one, (350.0, float(rng.uniform(160.0, 200.0))), float(rng.uniform(-10.0, 10.0)))
    clutter = Clutter(specks=90, debris=30, neighbours=(other,))
    return render(_shop(rng, moved(one, (130.0, 180.0)), clutter=clutter)).picture


def _three(rng: np.random.Generator) -> Picture:
    pieces = tuple(
        convex(
            (80.0 + 160.0 * column, float(rng.uniform(150.0, 210.0))),
            float(rng.uniform(58.0, 70.0)),
            int(rng.integers(0, 99)),
        )
        for column in range(3)
    )
    return render(_shop(rng, pieces[0], clutter=Clutter(specks=90, debris=30, neighbours=pieces[1:]))).picture


def _small_beside_large(rng: np.random.Generator) -> Picture:
    large = rectangle((180.0, 180.0), 260.0, 250.0, float(rng.uniform(-8.0, 8.0)))
    small = rectangle((405.0, float(rng.uniform(110.0, 250.0))), 80.0, 110.0, float(rng.uniform(-20.0, 20.0)))
    return render(_shop(rng, large, clutter=Clutter(specks=90, debris=30, neighbours=(small,)))).picture


def _close_together(rng: np.random.Generator) -> Picture:
    """Two blocks with a gap of two or three cells between them."""
    gap = float(rng.uniform(20.0, 32.0))
    left, right = rectangle((150.0, 180.0), 180.0, 220.0), rectangle((240.0 + gap + 75.0, 180.0), 150.0, 220.0)
    return render(_shop(rng, left, clutter=Clutter(specks=60, debris=10, neighbours=(right,)))).picture


_SIDES = {"left": (-1, 0), "right": (1, 0), "upper": (0, 1), "lower": (0, -1), "corner": (1, 1)}

FAMILIES: dict[str, tuple[Family, frozenset[str]]] = {
    "black": (drawn_tables.black, QUALITY),
    "white": (drawn_tables.white, QUALITY),
    "grey": (drawn_tables.grey, NO_BLOCK | QUALITY),
    "noise": (drawn_tables.noise, NO_BLOCK | QUALITY),
    "salt": (drawn_tables.salt, NO_BLOCK | QUALITY),
    "compressed": (drawn_tables.compressed, NO_BLOCK | QUALITY),
    "stripes": (drawn_tables.stripes, NO_BLOCK | QUALITY),
    "empty": (_empty_plain, NO_BLOCK),
    "empty-chips": (_empty_chips, NO_BLOCK),
    "empty-vacuum": (_empty_vacuum, PATTERN),
    "dusty": (drawn_tables.dusty, NO_BLOCK),
    "scratched": (drawn_tables.scratched, PATTERN),
    "brushed": (drawn_tables.brushed, NO_BLOCK),
    "wood": (drawn_tables.wood, NO_BLOCK),
    "weave": (drawn_tables.weave, PATTERN),
    "knit": (drawn_tables.knit, PATTERN),
    "checker-plate": (drawn_tables.checker_plate, PATTERN),
    "punched-sheet": (drawn_tables.punched_sheet, PATTERN),
    "grooves": (drawn_tables.grooves, PATTERN),
    "cutting-mat": (drawn_tables.cutting_mat, PATTERN),
    "coloured-table": (drawn_tables.coloured_table, NO_BLOCK),
    "lettering": (drawn_tables.lettering, PRINT),
    "code-squares": (drawn_tables.code_squares, PRINT),
    "board": (drawn_tables.board, PRINT | BORDER),
    "plain-board": (drawn_tables.plain_board, NO_BLOCK),
    "hand": (drawn_tables.hand, NO_BLOCK),
    "tools": (drawn_tables.tools, NO_BLOCK),
    "nuts": (drawn_tables.nuts, NO_BLOCK),
    "cables": (drawn_tables.cables, NO_BLOCK),
    "shadow": (drawn_tables.shadow, NO_BLOCK | QUALITY),
    "out-of-focus": (_out_of_focus, QUALITY),
    "shaken": (_shaken, QUALITY | NO_BLOCK),
    "overexposed": (_overexposed, QUALITY),
    "underexposed": (_underexposed, QUALITY),
    "fogged": (_fogged, QUALITY | NO_BLOCK),
    **{f"border-{name}": (_at_border(*way), BORDER) for name, way in _SIDES.items()},
    "border-just": (_just_touching, BORDER),
    "wider-than-view": (_wider_than_view, PATTERN),
    "two-equal": (_two_equal, SEVERAL),
    "three": (_three, SEVERAL),
    "small-beside-large": (_small_beside_large, SEVERAL),
    "close-together": (_close_together, SEVERAL),
}
