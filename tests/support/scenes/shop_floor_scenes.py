"""Blocks with what happens to them on a shop floor, one kind (or two) and seed a scene, its strength drawn at random.

No thing looks just like the table under it: levels keep `NEAR` grey levels away, and a quarter of them no more than
twice that.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from contour.geometry.arrays import Float64s
from contour.geometry.rings import Contour
from contour.synthetic import (
    Cover,
    Crush,
    Filling,
    Flare,
    Ink,
    Mirror,
    Scene,
    Shade,
    Slip,
    Strip,
    Structure,
    Thing,
    blob,
    densified,
    moved,
    pitch_px,
    rectangle,
    signed_distance,
    thick_line,
)
from tests.support.scenes.shop_floor_blocks import shop_floor_block

NEAR = 12.0
Drawn = Callable[[np.random.Generator, Scene], Scene]


@dataclass(frozen=True)
class ShopFloorScene:
    """A scene, and what was done to its block."""

    scene: Scene
    kinds: tuple[str, ...]

    @property
    def name(self) -> str:
        """Kinds and seed."""
        return f"{'+'.join(self.kinds)}-{self.scene.seed}"


def shop_floor_scene(kind: str, seed: int, *, alone: bool = False) -> ShopFloorScene:
    """The scene of this kind and seed, the same for the same; a quarter of them (none if `alone`) has a second kind."""
    rng = np.random.default_rng([seed, zlib.crc32(kind.encode())])
    scene = KINDS[kind](rng, shop_floor_block(seed))
    if alone or kind == "undisturbed" or rng.random() >= 0.25:
        return ShopFloorScene(scene, (kind,))
    others = [name for name in KINDS if name not in _alike(kind)]
    second = str(rng.choice(others))
    return ShopFloorScene(KINDS[second](rng, scene), (kind, second))


def _alike(kind: str) -> set[str]:
    """The kinds that are not drawn beside this one: they change the same, or undo each other."""
    groups = ({"dim", "blown_out", "gamma"}, {"motion", "defocus"}, {"wood", "brushed", "slots", "old_cuts", "mirror"})
    return {"undisturbed", kind}.union(*(group for group in groups if kind in group))


# --- places and levels ------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Place:
    """A place on the exterior, the unit vectors along it and out of the block, millimetres."""

    at: Float64s
    along: Float64s
    out: Float64s

    def point(self, along: float, out: float) -> tuple[float, float]:
        """The place this far along the edge and out of it."""
        x, y = (self.at + along * self.along + out * self.out).tolist()
        return (x, y)

    @property
    def out_deg(self) -> float:
        """The direction out of the block."""
        return math.degrees(math.atan2(self.out[1], self.out[0]))


def _place(rng: np.random.Generator, scene: Scene) -> Place:
    """A place anywhere on the exterior, which runs counter-clockwise."""
    ring = densified(scene.outline.exterior, 0.25 * scene.cells.pitch_mm)
    k = int(rng.integers(len(ring)))
    along = ring[(k + 1) % len(ring)] - ring[k]
    along = along / np.hypot(*along)
    return Place(ring[k], along, np.array([along[1], -along[0]]))


def _level(rng: np.random.Generator, scene: Scene, low: float = 0.02, high: float = 0.95) -> float:
    """A level away from the table's, shaded or not, by `NEAR` grey levels or more under the scene's light."""
    step = NEAR / 255.0 / min(1.0, scene.light.level)
    dark = scene.table.level * (1.0 - scene.light.shadow)
    if rng.random() < 0.25:
        near = [dark - step * rng.uniform(1.0, 2.0), scene.table.level + step * rng.uniform(1.0, 2.0)]
        return float(rng.choice([level for level in near if level > 0.01]))
    while True:
        level = float(rng.uniform(low, high))
        if not dark - step < level < scene.table.level + step:
            return level


def _colour(rng: np.random.Generator, spread: float = 0.35) -> tuple[float, float, float]:
    tint = np.exp(rng.normal(0.0, spread, 3))
    blue, green, red = (tint / tint.mean()).tolist()
    return (blue, green, red)


def _with(scene: Scene, *things: Thing) -> Scene:
    return replace(scene, things=(*scene.things, *things))


def _extent(scene: Scene) -> float:
    """Diagonal of the block's box, millimetres."""
    return float(np.hypot(*np.ptp(scene.outline.exterior, axis=0)))


# --- what hides the edge ----------------------------------------------------------------------------------------------


def _tape(rng: np.random.Generator, scene: Scene) -> Scene:
    """Tape or a label over the edge, 1 to 4 cells deep, at any angle; some are printed on."""
    pitch, place = scene.cells.pitch_mm, _place(rng, scene)
    deep, wide = float(rng.uniform(1.0, 4.0)) * pitch, float(rng.uniform(1.5, 8.0)) * pitch
    beyond = float(rng.uniform(0.5, 8.0)) * pitch
    centre = place.point(0.0, 0.5 * (beyond - deep))
    turn = place.out_deg + float(rng.normal(0.0, 25.0))
    if rng.random() < 0.2:  # laid along the edge
        turn, wide, beyond = turn + 90.0, deep + min(beyond, 3.0 * pitch), float(rng.uniform(1.0, 6.0)) * pitch
        centre = place.point(0.0, float(rng.uniform(-0.3, 0.3)) * wide)
    tape = Cover(
        rectangle(centre, deep + beyond, wide, turn),
        _level(rng, scene),
        _colour(rng),
        texture=float(rng.uniform(0.0, 0.06)),
    )
    printed: list[Thing] = []
    if rng.random() < 0.35:
        ink = float(rng.choice([0.05, 0.9]))
        for row in np.linspace(-0.35, 0.35, int(rng.integers(2, 6))).tolist():
            bar = rectangle((0.0, row * wide), float(rng.uniform(0.3, 0.85)) * (deep + beyond), 0.07 * wide)
            printed.append(Cover(moved(moved(bar, (0.0, 0.0), turn), centre), ink, texture=0.0))
    return _with(scene, tape, *printed)


def _clamp(rng: np.random.Generator, scene: Scene) -> Scene:
    """A clamp's bar from over the block to the picture's side, with its pad and its shadow."""
    pitch, place = scene.cells.pitch_mm, _place(rng, scene)
    deep, wide = float(rng.uniform(1.0, 5.0)) * pitch, float(rng.uniform(2.0, 6.0)) * pitch
    camera = scene.camera
    long = 1.5 * math.hypot(camera.width, camera.height) * camera.mm_per_px(place.point(0.0, 0.0), scene.thickness_mm)
    turn = place.out_deg + float(rng.normal(0.0, 15.0))
    level, colour = _level(rng, scene), _colour(rng, float(rng.choice([0.0, 0.4])))
    angle = float(rng.uniform(0.0, 2.0 * math.pi))
    height = float(rng.uniform(0.2, 1.0)) * pitch
    metal = float(rng.choice([0.0, rng.uniform(0.03, 0.12)]))
    bar = rectangle((0.5 * long - deep, 0.0), long, wide)
    pad = rectangle((0.35 * wide - deep, 0.0), 0.7 * wide, 1.3 * wide)
    parts: list[Thing] = []
    for shape, tone in ((bar, level), (pad, level * float(rng.uniform(0.7, 1.2)))):
        area = moved(moved(shape, (0.0, 0.0), turn), place.point(0.0, 0.0))
        parts.append(
            Cover(
                area,
                tone,
                colour,
                texture=0.03,
                rounding_mm=float(rng.choice([0.1, rng.uniform(0.1, 0.5)])) * wide,
                streaks=metal,
                streaks_deg=turn,
                shadow=float(rng.uniform(0.0, 0.5)),
                shadow_mm=(height * math.cos(angle), height * math.sin(angle)),
            )
        )
    return _with(scene, *parts[: int(rng.integers(1, 3))])


def _hand_or_cable(rng: np.random.Generator, scene: Scene) -> Scene:
    """A cable, bent, over the edge and out of the picture's middle; or a hand: a palm with fingers."""
    return (_cable if rng.random() < 0.5 else _hand)(rng, scene)


def _cable(rng: np.random.Generator, scene: Scene) -> Scene:
    pitch, place = scene.cells.pitch_mm, _place(rng, scene)
    width = float(rng.uniform(0.6, 2.5)) * pitch
    long = float(rng.uniform(0.8, 2.0)) * _extent(scene)
    share = np.linspace(-float(rng.uniform(0.05, 0.5)), 1.0, 80)
    start = math.radians(place.out_deg + float(rng.uniform(-60.0, 60.0)))
    heading = start + float(rng.normal(0.0, 0.8)) * share + float(rng.normal(0.0, 0.25)) * np.sin(7.0 * share)
    steps = np.column_stack((np.cos(heading), np.sin(heading))) * (long / 80.0)
    path = np.cumsum(steps, axis=0)
    path += place.at - path[int(np.argmin(np.abs(share)))]
    area = thick_line([(float(x), float(y)) for x, y in path], width)
    cover = Cover(area, _level(rng, scene), _colour(rng), 0.02, rounding_mm=0.5 * width, shadow=0.3)
    return _with(scene, replace(cover, shadow_mm=(0.3 * width, -0.3 * width)))


def _hand(rng: np.random.Generator, scene: Scene) -> Scene:
    pitch, place = scene.cells.pitch_mm, _place(rng, scene)
    size = float(rng.uniform(2.0, 5.0)) * pitch
    level = _level(rng, scene, 0.3, 0.8)
    colour = (0.75, 0.95, 1.3) if rng.random() < 0.6 else _colour(rng)
    look = Cover(rectangle((0.0, 0.0), 1.0, 1.0), level, colour, 0.06, rounding_mm=0.3 * size)
    look = replace(look, shadow=float(rng.uniform(0.1, 0.5)), shadow_mm=(0.2 * size, 0.1 * size))
    reach = float(rng.uniform(0.0, 1.5)) * size
    palm = replace(look, area=blob(place.point(0.0, 1.2 * size - reach), 1.2 * size, int(rng.integers(10_000)), 0.12))
    parts: list[Thing] = []
    for number in range(int(rng.integers(2, 6))):
        angle = math.radians(place.out_deg + 180.0 - 40.0 + 25.0 * number)
        foot = np.array(place.point(0.0, 1.2 * size - reach))
        way = np.linspace(0.4, float(rng.uniform(1.8, 2.5)), 12)[:, None] * size
        path = foot + way * np.array([math.cos(angle), math.sin(angle)])
        finger = thick_line([(float(x), float(y)) for x, y in path], 0.5 * size)
        parts.append(replace(look, area=finger, rounding_mm=0.25 * size))
    return _with(scene, *parts, palm)


# --- what changes cells and walls -------------------------------------------------------------------------------------


def _compound(rng: np.random.Generator, scene: Scene) -> Scene:
    """Potting compound in patches of cells, one or two of them at the edge, flush with the cut."""
    pitch = scene.cells.pitch_mm
    things: list[Thing] = []
    for number in range(int(rng.integers(1, 4))):
        place = _place(rng, scene)
        radius = float(rng.uniform(1.5, 5.0)) * pitch
        out = float(rng.uniform(-0.5, 0.3)) * radius if number == 0 else -float(rng.uniform(0.0, 3.0)) * radius
        area = blob(place.point(0.0, out), radius, int(rng.integers(10_000)), 0.25)
        if rng.random() < 0.25:  # along the edge
            area = rectangle(place.point(0.0, 0.0), float(rng.uniform(4.0, 16.0)) * pitch, 2.4 * radius)
            area = moved(moved(area, (-place.at[0], -place.at[1])), place.point(0.0, 0.0), 0.0)
        things.append(_filling(rng, scene, area))
    return _with(scene, *things)


def _filling(rng: np.random.Generator, scene: Scene, area: Contour) -> Filling:
    walls = float(rng.choice([0.0, 1.0, rng.uniform(0.0, 1.0)]))
    share = float(rng.choice([1.0, 1.0, rng.uniform(0.7, 1.0)]))
    return Filling(area, _level(rng, scene, 0.03, 0.85), _colour(rng), walls, share)


def _splice(rng: np.random.Generator, scene: Scene) -> Scene:
    """A seam of foaming adhesive across the whole block, one or two cells wide."""
    pitch, low, high = scene.cells.pitch_mm, scene.outline.exterior.min(axis=0), scene.outline.exterior.max(axis=0)
    middle = low + (high - low) * rng.uniform(0.3, 0.7, 2)
    angle, long = float(rng.uniform(0.0, math.pi)), _extent(scene)
    along, across = np.array([math.cos(angle), math.sin(angle)]), np.array([-math.sin(angle), math.cos(angle)])
    share = np.linspace(-1.0, 1.0, 60)
    wave = float(rng.uniform(0.0, 0.4)) * pitch * np.sin(share * long / pitch + float(rng.uniform(0.0, 6.0)))
    path = middle + share[:, None] * long * along + wave[:, None] * across
    area = thick_line([(float(x), float(y)) for x, y in path], float(rng.uniform(1.0, 2.0)) * pitch)
    x, y = along.tolist()
    slip = Slip((float(middle[0]), float(middle[1])), (x, y), float(rng.uniform(0.0, 1.0)) * pitch)
    return _with(scene, replace(_filling(rng, scene, area), share=1.0), slip)


def _crushed(rng: np.random.Generator, scene: Scene) -> Scene:
    """One to three places at the edge where cells were pressed together over one or two cells."""
    pitch = scene.cells.pitch_mm
    things: list[Thing] = []
    for _ in range(int(rng.integers(1, 4))):
        place = _place(rng, scene)
        deep = float(rng.uniform(1.0, 2.2)) * pitch
        x, y = place.out.tolist()
        things.append(
            Crush(
                place.point(0.0, 0.0),
                (-x, -y),
                float(rng.uniform(3.0, 12.0)) * pitch,
                deep,
                float(rng.uniform(0.25, 0.6)) * deep,
                float(rng.uniform(0.0, 0.3)) * pitch,
            )
        )
    return _with(scene, *things)


def _writing(rng: np.random.Generator, scene: Scene) -> Scene:
    """Letters of a felt pen on the walls, often across the edge, and then on the table as well or not."""
    pitch = scene.cells.pitch_mm
    size, width = float(rng.uniform(3.0, 9.0)) * pitch, float(rng.uniform(0.3, 1.3)) * pitch
    place, turn = _place(rng, scene), float(rng.uniform(0.0, 360.0))
    out = float(rng.uniform(-1.5, 0.3)) * size
    bright = rng.random() < 0.4
    level = float(rng.uniform(0.8, 1.0)) if bright else float(rng.uniform(0.02, 0.25))
    strokes = []
    letters = int(rng.integers(2, 6))
    for letter in range(letters):
        corners = np.cumsum(rng.uniform(-0.5, 0.5, (int(rng.integers(3, 6)), 2)), axis=0) * size
        at = np.linspace(0.0, len(corners) - 1.0, 40)
        path = np.column_stack([np.interp(at, np.arange(len(corners)), corners[:, axis]) for axis in (0, 1)])
        first = (letter - 0.5 * letters) * 0.9 * size
        area = thick_line([(float(x) + first, float(y)) for x, y in path], width)
        strokes.append(moved(moved(area, (0.0, 0.0), turn), place.point(0.0, out)))
    strength, on_table = float(rng.uniform(0.5, 1.0)), bool(rng.random() < 0.5)
    return _with(scene, Ink(tuple(strokes), level, _colour(rng, 0.5), strength, on_table))


# --- what lies beside it, and light -----------------------------------------------------------------------------------


def _mirror(rng: np.random.Generator, scene: Scene) -> Scene:
    reach = float(rng.uniform(0.5, 3.0)) * scene.cells.pitch_mm
    return _with(scene, Mirror(float(rng.uniform(0.08, 0.55)), reach, float(rng.uniform(0.5, 3.0))))


def _swarf(rng: np.random.Generator, scene: Scene) -> Scene:
    """Strips of one to three cells that were cut off lie beside the edge, a twentieth of a pitch to one from it."""
    pitch, things = scene.cells.pitch_mm, []
    for _ in range(40):
        place = _place(rng, scene)
        long, wide = float(rng.uniform(2.0, 10.0)) * pitch, float(rng.uniform(1.0, 3.0)) * pitch
        turn = place.out_deg + 90.0 + float(rng.normal(0.0, 4.0))
        strip = moved(rectangle((0.0, 0.0), long, wide), (0.0, 0.0), turn)
        gap = float(rng.uniform(0.05, 1.0)) * pitch
        strip = moved(strip, place.point(0.0, 0.5 * wide))
        near = float(signed_distance(scene.outline, densified(strip.exterior, 0.1 * pitch)).max())
        x, y = ((near + gap) * place.out).tolist()
        strip = moved(strip, (x, y))
        reached = signed_distance(scene.outline, densified(strip.exterior, 0.1 * pitch)).max()
        if not -1.2 * gap - 0.05 * pitch < reached < -0.04 * pitch:
            continue
        x, y = rng.uniform(0.0, pitch, 2).tolist()
        ribbon = scene.cells.ribbon_deg + float(rng.normal(0.0, 6.0))
        things.append(Strip(strip, replace(scene.cells, offset_mm=(x, y), ribbon_deg=ribbon)))
        if rng.random() < 0.5:
            break
    return _with(scene, *things[:3])


def _glare(rng: np.random.Generator, scene: Scene) -> Scene:
    """A lamp's image over the edge: a spot or a streak."""
    place, pitch = _place(rng, scene), scene.cells.pitch_mm
    size = (float(rng.uniform(2.0, 10.0)) * pitch, float(rng.uniform(0.7, 4.0)) * pitch)
    level, share = float(rng.uniform(0.1, 0.6)), float(rng.uniform(0.0, 0.8))
    return _with(scene, Flare(place.point(0.0, 0.0), level, size, float(rng.uniform(0.0, 180.0)), share))


def _shadow(rng: np.random.Generator, scene: Scene) -> Scene:
    """The shadow of something beside the block, along or across its edge, soft or fairly sharp."""
    place, pitch = _place(rng, scene), scene.cells.pitch_mm
    wide, long = float(rng.uniform(1.0, 6.0)) * pitch, float(rng.uniform(4.0, 20.0)) * pitch
    turn = place.out_deg + 90.0 + float(rng.choice([0.0, rng.normal(0.0, 40.0)]))
    centre = place.point(0.0, float(rng.uniform(-0.2, 0.6)) * wide)
    area = moved(moved(rectangle((0.0, 0.0), long, wide), (0.0, 0.0), turn), centre)
    soft = float(rng.choice([rng.uniform(0.03, 0.15), rng.uniform(0.3, 1.5)])) * pitch
    return _with(scene, Shade(area, float(rng.uniform(0.25, 0.7)), soft, bool(rng.random() < 0.5)))


def _dust(rng: np.random.Generator, scene: Scene) -> Scene:
    clutter = replace(scene.clutter, specks=int(rng.integers(200, 2500)), debris=int(rng.integers(0, 40)))
    return replace(scene, clutter=clutter)


def _structured(kind: str) -> Drawn:
    def draw(rng: np.random.Generator, scene: Scene) -> Scene:
        pitch, dark = scene.cells.pitch_mm, scene.material.top < scene.table.level
        top = scene.material.top
        level = float(rng.uniform(0.55, 0.85)) if dark else float(rng.uniform(0.55, 1.1)) * top
        colour = scene.table.colour
        if kind in ("wood", "old-cuts"):
            colour = (0.62, 0.98, 1.4) if kind == "wood" else (0.75, 1.0, 1.25)
        scale = {"wood": rng.uniform(5.0, 25.0), "brushed": rng.uniform(4.0, 30.0)}.get(kind, rng.uniform(2.5, 10.0))
        contrast = {"wood": rng.uniform(0.08, 0.3), "brushed": rng.uniform(0.05, 0.2)}.get(kind, rng.uniform(0.1, 0.35))
        table = replace(scene.table, level=level, colour=colour)
        pattern = Structure(kind, float(scale) * pitch, float(contrast), float(rng.uniform(0.0, 180.0)))
        return _with(replace(scene, table=table), pattern)

    return draw


# --- light and camera as a whole --------------------------------------------------------------------------------------


def _sensor(change: Callable[[np.random.Generator, Scene], dict[str, object]]) -> Drawn:
    def draw(rng: np.random.Generator, scene: Scene) -> Scene:
        return replace(scene, sensor=replace(scene.sensor, **change(rng, scene)))

    return draw


def _motion(rng: np.random.Generator, scene: Scene) -> dict[str, object]:
    length, angle = float(rng.uniform(4.0, 13.0)), float(rng.uniform(0.0, 2.0 * math.pi))
    return {"motion_px": (length * math.cos(angle), length * math.sin(angle))}


def _gamma(rng: np.random.Generator, scene: Scene) -> dict[str, object]:
    return {"gamma": math.exp(float(rng.uniform(math.log(0.45), math.log(2.0))))}


def _blown_out(rng: np.random.Generator, scene: Scene) -> Scene:
    """So much light that walls read full scale; table (or cells) stay below two thirds of it."""
    darker = min(scene.table.level, scene.material.top)
    brighter = max(scene.table.level, scene.material.top)
    level = min(float(rng.uniform(1.15, 2.8)) / brighter, 0.6 / darker)
    sensor = replace(scene.sensor, bloom=float(rng.uniform(0.04, 0.2)))
    return replace(scene, light=replace(scene.light, level=max(level, scene.light.level)), sensor=sensor)


def _dim(rng: np.random.Generator, scene: Scene) -> Scene:
    return replace(scene, light=replace(scene.light, level=scene.light.level * float(rng.uniform(0.15, 0.3))))


def _coloured(rng: np.random.Generator, scene: Scene) -> Scene:
    """Coloured light on a coloured table."""
    light, tint = _colour(rng, 0.2), _colour(rng, 0.4)
    material = replace(scene.material, colour=_product(scene.material.colour, light))
    table = replace(scene.table, colour=_product(tint, light))
    return replace(scene, material=material, table=table, sensor=replace(scene.sensor, colour=True))


def _product(one: tuple[float, float, float], other: tuple[float, float, float]) -> tuple[float, float, float]:
    return (one[0] * other[0], one[1] * other[1], one[2] * other[2])


KINDS: dict[str, Drawn] = {
    "undisturbed": lambda rng, scene: scene,
    "tape": _tape,
    "clamp": _clamp,
    "hand_or_cable": _hand_or_cable,
    "compound": _compound,
    "writing": _writing,
    "mirror": _mirror,
    "splice": _splice,
    "swarf": _swarf,
    "dust": _dust,
    "hot_pixels": _sensor(lambda rng, _: {"hot_pixels": float(rng.uniform(0.0001, 0.002))}),
    "jpeg": _sensor(lambda rng, _: {"jpeg_quality": int(rng.integers(20, 41))}),
    "gamma": _sensor(_gamma),
    "row_noise": _sensor(lambda rng, _: {"row_noise": float(rng.uniform(2.0, 8.0)) / 255.0}),
    "motion": _sensor(_motion),
    "defocus": _sensor(lambda rng, scene: {"blur_px": float(rng.uniform(0.06, 0.12)) * pitch_px(scene)}),
    "blown_out": _blown_out,
    "dim": _dim,
    "coloured": _coloured,
    "glare": _glare,
    "shadow": _shadow,
    "crushed": _crushed,
    "wood": _structured("wood"),
    "brushed": _structured("brushed"),
    "slots": _structured("slots"),
    "old_cuts": _structured("old-cuts"),
}
