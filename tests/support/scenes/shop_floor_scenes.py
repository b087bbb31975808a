"""Blocks and what happens to them on a shop floor, one kind (or two) and seed a scene, its strength drawn at random."""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import numpy as np

from contour.synthetic import Scene, pitch_px
from tests.support.scenes.shop_floor import cells, covers, light
from tests.support.scenes.shop_floor.blocks import shop_floor_block
from tests.support.scenes.shop_floor.corners import corners
from tests.support.scenes.shop_floor.together import offcut, pushed_together

KINDS: dict[str, light.Drawn] = {
    "undisturbed": lambda rng, scene: scene,
    "tape": covers.tape,
    "clamp": covers.clamp,
    "hand_or_cable": covers.hand_or_cable,
    "compound": cells.compound,
    "writing": cells.writing,
    "mirror": light.mirror,
    "splice": cells.splice,
    "swarf": cells.swarf,
    "dust": light.dust,
    "hot_pixels": light.sensor(lambda rng, _: {"hot_pixels": float(rng.uniform(0.0001, 0.002))}),
    "jpeg": light.sensor(lambda rng, _: {"jpeg_quality": int(rng.integers(20, 41))}),
    "gamma": light.sensor(light.gamma),
    "row_noise": light.sensor(lambda rng, _: {"row_noise": float(rng.uniform(2.0, 8.0)) / 255.0}),
    "motion": light.sensor(light.motion),
    "motion_far": light.sensor(light.motion_far),
    "defocus": light.sensor(lambda rng, scene: {"blur_px": float(rng.uniform(0.06, 0.12)) * pitch_px(scene)}),
    "blown_out": light.blown_out,
    "dim": light.dim,
    "coloured": light.coloured,
    "glare": light.glare,
    "shadow": light.shadow,
    "crushed": cells.crushed,
    "fading": light.fading,
    "light_table": light.light_table,
    "wood": light.structured("wood"),
    "brushed": light.structured("brushed"),
    "slots": light.structured("slots"),
    "old_cuts": light.structured("old-cuts"),
}

GUARDS: dict[str, light.Drawn] = {
    "expanded": light.structured("expanded"),
    "ribbed": light.structured("ribbed"),
    "cork": light.structured("cork"),
}
"""Tables that nothing is tuned on: they tell whether what was learnt on others holds. Never a second kind."""

LATER: dict[str, light.Drawn] = {
    "sheet": covers.sheet,
    "pushed_together": pushed_together,
    "offcut": offcut,
    "corners": corners,
}
"""Kinds that were thought of later: never a second kind, so that all other scenes stay what they were."""

STRUCTURED = ("light_table", "wood", "brushed", "slots", "old_cuts")
"""Kinds in which the table is no plain dark one."""

_LIGHT = {"gamma", "blown_out", "dim", "coloured", *STRUCTURED, *GUARDS}
"""Kinds that change in what light and on what table other things are seen: they come first, for levels to be drawn."""


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
    kinds = [kind]
    if not alone and kind != "undisturbed" and rng.random() < 0.25:
        kinds.append(str(rng.choice([name for name in KINDS if name not in _alike(kind)])))
    scene, drawn = shop_floor_block(seed), KINDS | LATER | GUARDS
    for name in sorted(kinds, key=lambda name: name not in _LIGHT):
        scene = drawn[name](rng, scene)
    return ShopFloorScene(scene, tuple(kinds))


def _alike(kind: str) -> set[str]:
    """The kinds that are not drawn beside this one: they change the same, or undo each other."""
    groups = (
        {"dim", "blown_out", "gamma"},
        {"motion", "motion_far", "defocus"},
        {*STRUCTURED, "mirror", *GUARDS},
    )
    return {"undisturbed", kind}.union(*(group for group in groups if kind in group))
