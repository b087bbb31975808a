"""Rendered blocks as the network is to see them: what of the picture is a wall, comb, a thing over it, and a seam."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import cv2
import numpy as np

from benchmarks.fifth_hand.scene import KINDS as FIFTH_KINDS
from benchmarks.fifth_hand.scene import scene as fifth_scene
from benchmarks.fourth_hand.scene import KINDS as FOURTH_KINDS
from benchmarks.fourth_hand.scene import scene as fourth_scene
from benchmarks.other_hand.scene import KINDS as OTHER_KINDS
from benchmarks.other_hand.scene import scene as other_scene
from benchmarks.sixth_hand.scene import KINDS as SIXTH_KINDS
from benchmarks.sixth_hand.scene import scene as sixth_scene
from benchmarks.third_hand.scene import KINDS as THIRD_KINDS
from benchmarks.third_hand.scene import scene as third_scene
from contour.geometry.arrays import Bytes, Float32s, median
from contour.image.opencv import grey, within
from contour.segmentation.network import LEAST_SPREAD, PITCH_PX
from contour.synthetic import Strip, area_coverage, render, truth_px
from contour.synthetic.rendering import tops
from contour.synthetic.shop_floor.covers import cover_areas
from tests.support.scenes.shop_floor_scenes import KINDS as SHOP_FLOOR
from tests.support.scenes.shop_floor_scenes import STRUCTURED, shop_floor_scene

# By how much cells are larger or smaller than those that the network is asked about.
_APART = 0.2
_OTHERS = (
    *("undisturbed", "tape", "hand_or_cable", "clamp", "compound", "writing", "splice", "swarf", "dust", "jpeg"),
    *("row_noise", "motion", "defocus", "glare", "shadow", "crushed", "fading", "dim", "mirror", "gamma", "coloured"),
)
KINDS = (*STRUCTURED * 3, *_OTHERS)
# So many are two blocks, or a block and an offcut, that lie against each other. Within so many pitches of both is seam.
_TOGETHER, SEAM_PITCHES = 0.2, 0.55
_OWN_TOGETHER, _OTHERS_TOGETHER = ("pushed_together", "pushed_together", "offcut"), ("pair", "pair", "offcut")
# So many are drawn by another hand; and so many of the things that lie over an edge do so on a table with structure.
_BY_ANOTHER, _ON_STRUCTURED, _BY_MORE = 0.5, 0.5, 0.8
_THINGS = ("tape", "clamp", "hand_or_cable")
_OTHER_THINGS = ("tape", "clamp", "hand", "cable")
LATER_HANDS = {
    "third": (THIRD_KINDS, third_scene),
    "fourth": (FOURTH_KINDS, fourth_scene),
    "fifth": (FIFTH_KINDS, fifth_scene),
    "sixth": (SIXTH_KINDS, sixth_scene),
}
"""Kinds and scenes of hands that drew many things that lie over a block, and what looks like these."""


@dataclass(frozen=True, eq=False)
class Example:
    """A picture, (h, w) or (h, w, 3), uint8, with cells of about that pitch, and how much of each pixel is the top of a
    wall, of a block, of a thing over it, and of a seam between two blocks, 255 all, (h, w), uint8. mean, spread: of its
    light. dark: whether walls are darker than what lies between them.
    """

    picture: Bytes
    wall: Bytes
    comb: Bytes
    thing: Bytes
    seam: Bytes
    mean: float
    spread: float
    dark: bool
    pitch_px: float


def example(seed: int, pitch_px: float = PITCH_PX, *, more_hands: bool = False) -> Example:
    """The example of this seed, the same for the same, with cells of about that pitch; with `more_hands` four of
    five are drawn by hands who drew many things that lie over a block, and what looks like these.
    """
    rng = np.random.default_rng([seed, 77])
    if more_hands and rng.random() < _BY_MORE:
        drawn = _by_one_more(rng, seed)
    else:
        drawn = _by_another(rng, seed) if rng.random() < _BY_ANOTHER else _own(rng, seed)
    height, width = drawn.picture.shape[:2]
    share = pitch_px / drawn.pitch_px * math.exp(float(rng.uniform(-_APART, _APART)))
    size = max(64, round(width * share)), max(64, round(height * share))
    how = cv2.INTER_AREA if share < 1.0 else cv2.INTER_LINEAR
    picture = np.asarray(cv2.resize(drawn.picture, size, interpolation=how), np.uint8)
    comb = np.maximum.reduce(drawn.pieces)
    wall, block, over = (_sized(one, size, how) for one in (drawn.wall * comb, comb, drawn.thing))
    seam = _seam_between([_sized(piece, size, how) for piece in drawn.pieces], pitch_px)
    light = grey(picture)
    on, off = light[wall > 180], light[(wall < 20) & (block > 200)]
    dark = len(on) > 0 and len(off) > 0 and median(on) < median(off)
    even = float(light.mean()), max(float(light.std()), LEAST_SPREAD)
    return Example(picture, wall, block, over, seam, *even, dark, pitch_px)


def _seam_between(pieces: Sequence[Bytes], pitch_px: float) -> Bytes:
    """255 where two pieces, 255 each in (h, w), with cells of that pitch lie against each other."""
    beside = [within((piece > 127).astype(np.uint8), SEAM_PITCHES * pitch_px) for piece in pieces]
    return np.where(np.add.reduce(beside) > 1, np.uint8(255), np.uint8(0))


class _Drawn(NamedTuple):
    """A picture, the pitch of its cells, and how much of each pixel is a wall's top, each block, and a thing, 0…1."""

    picture: Bytes
    pitch_px: float
    wall: Float32s
    pieces: list[Float32s]
    thing: Float32s


def _own(rng: np.random.Generator, seed: int) -> _Drawn:
    kind = str(rng.choice(_OWN_TOGETHER if rng.random() < _TOGETHER else KINDS))
    over = kind in STRUCTURED and rng.random() < _ON_STRUCTURED
    scene = shop_floor_scene(kind, seed, alone=over).scene
    if over:
        scene = SHOP_FLOOR[str(rng.choice(_THINGS))](rng, scene)
    rendered = render(scene)
    height, width = rendered.picture.shape[:2]
    outlines = [truth_px(scene)]
    if kind in _OWN_TOGETHER:
        others = (thing.outline for thing in scene.things if isinstance(thing, Strip))
        outlines += [truth_px(replace(scene, outline=outline)) for outline in others]
    pieces = [area_coverage(outline.rings, width, height) for outline in outlines]
    thing = np.zeros_like(pieces[0])
    for area in cover_areas(scene):
        thing = np.maximum(thing, area_coverage(area.rings, width, height))
    return _Drawn(rendered.picture, rendered.pitch_px, tops(scene)[0], pieces, thing)


def _by_another(rng: np.random.Generator, seed: int) -> _Drawn:
    kind = str(rng.choice(_OTHERS_TOGETHER if rng.random() < _TOGETHER else OTHER_KINDS))
    on = str(rng.choice(STRUCTURED)) if kind in _OTHER_THINGS and rng.random() < _ON_STRUCTURED else None
    one = other_scene(kind, seed, on)
    wall, thing, *pieces = (np.asarray(part, np.float32) for part in (one.walls, one.hidden, *one.pieces))
    return _Drawn(one.picture, one.pitch_px, wall, pieces, thing)


def _by_one_more(rng: np.random.Generator, seed: int) -> _Drawn:
    kinds, draw = list(LATER_HANDS.values())[int(rng.integers(len(LATER_HANDS)))]
    one = draw(str(rng.choice(kinds)), seed)
    wall, comb, thing = (np.asarray(part, np.float32) for part in (one.walls, one.comb, one.hidden))
    return _Drawn(one.picture, one.pitch_px, wall, [comb], thing)


def _sized(share: Float32s, size: tuple[int, int], how: int) -> Bytes:
    small = cv2.resize(share, size, interpolation=how)
    return np.rint(255.0 * np.clip(small, 0.0, 1.0)).astype(np.uint8)
