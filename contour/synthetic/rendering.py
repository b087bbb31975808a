"""A scene becomes a picture with its exact truth."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from contour.geometry.arrays import Bools, Bytes, Float32s
from contour.geometry.rings import Contour
from contour.synthetic.camera import CameraModel
from contour.synthetic.depth import Relief, relief
from contour.synthetic.scene import Scene
from contour.synthetic.sensor import dust, expose, illumination, patches
from contour.synthetic.shop_floor.covers import lay_covers, visible
from contour.synthetic.shop_floor.lights import add_flares, faded, shaded
from contour.synthetic.shop_floor.marks import ink_tops, inked_table, mirrored, tints
from contour.synthetic.shop_floor.structures import structured
from contour.synthetic.surface import surface
from contour.synthetic.table import bare_table, smooth_noise, table_glare, table_light
from contour.synthetic.things import Strip

# Far from the seeds of scenes: noise is not that of the picture with the block.
_EMPTY_SEED = 2_000_000_000


@dataclass(frozen=True)
class Rendered:
    """A picture and what is true of it.

    `picture` is uint8, (H, W) grey or (H, W, 3) BGR. `truth_mm` is the outline as given (work frame, top plane);
    `truth_px` the same, densified in millimetres and projected. `pitch_px` is the root of the mean cell area × 1.1547.
    `visible` says of each vertex of `truth_px`, ring by ring, whether nothing lies over it.
    """

    picture: Bytes
    truth_px: Contour
    truth_mm: Contour
    camera: CameraModel
    thickness_mm: float
    pitch_px: float
    visible: tuple[Bools, ...] = ()


def render(scene: Scene) -> Rendered:
    """The scene's picture; the same scene always gives the same bytes."""
    cover, light, filled = tops(scene)
    _texture(scene, light)
    block = relief(scene, cover, light)
    picture = expose(scene.sensor, _planes(scene, block, filled), scene.seed)
    truth = truth_px(scene)
    seen = visible(scene, truth)
    return Rendered(picture, truth, scene.outline, scene.camera, scene.thickness_mm, pitch_px(scene), seen)


def render_empty_table(scene: Scene, count: int) -> list[Bytes]:
    """Pictures of the scene's table with nothing on it, as `render` gives them, each with noise of its own."""
    light = np.maximum(bare_table(scene), 0.0) * structured(scene) * illumination(scene)
    tints = scene.table.colour if scene.sensor.colour else (1.0,)
    planes = [np.asarray(light * np.float32(tint), dtype=np.float32) for tint in tints]
    return [expose(scene.sensor, planes, _EMPTY_SEED + scene.seed + number) for number in range(count)]


def truth_px(scene: Scene) -> Contour:
    """The outline in pixels, densified in millimetres (the lens bends it); orientation as seen in the work frame."""
    step = 2.0 * scene.camera.mm_per_px(_middle(scene), scene.thickness_mm)
    return scene.camera.project_contour(scene.outline, scene.thickness_mm, step)


def pitch_px(scene: Scene) -> float:
    """Pitch of a regular honeycomb whose cells have the same area, pixels."""
    scale = scene.camera.mm_per_px(_middle(scene), scene.thickness_mm)
    return float(np.sqrt(scene.cells.cell_area_mm2 * 2.0 / np.sqrt(3.0)) / scale)


def _middle(scene: Scene) -> tuple[float, float]:
    x, y = ((scene.outline.exterior.min(axis=0) + scene.outline.exterior.max(axis=0)) / 2.0).tolist()
    return (x, y)


def tops(scene: Scene) -> tuple[Float32s, Float32s, Bytes | None]:
    """Cover and light of the top planes of all pieces, shape (H, W), and what fills the block's cells, if anything."""
    shape = (scene.camera.height, scene.camera.width)
    cover, light = np.zeros(shape, dtype=np.float32), np.zeros(shape, dtype=np.float32)
    strips = [thing for thing in scene.things if isinstance(thing, Strip)]
    pieces = [(scene, outline) for outline in (scene.outline, *scene.clutter.neighbours)]
    pieces += [(replace(scene, cells=strip.cells), strip.outline) for strip in strips]
    filled: Bytes | None = None
    for number, (whole, outline) in enumerate(pieces):
        piece = surface(whole, outline, scene.seed + 1000 * number)
        if piece is None:
            continue
        rows = slice(piece.top, piece.top + piece.cover.shape[0])
        columns = slice(piece.left, piece.left + piece.cover.shape[1])
        np.add(cover[rows, columns], piece.cover, out=cover[rows, columns])
        np.add(light[rows, columns], piece.light, out=light[rows, columns])
        if piece.filled is not None:
            filled = np.zeros(shape, dtype=np.uint8)
            filled[rows, columns] = piece.filled
    np.minimum(cover, 1.0, out=cover)
    ink_tops(scene, cover, light)
    return cover, light, filled


def _texture(scene: Scene, light: Float32s) -> None:
    if scene.material.texture <= 0.0:
        return
    rng = np.random.default_rng([scene.seed, 51])
    scale = scene.camera.mm_per_px(_middle(scene), scene.thickness_mm)
    grain = min(max(1.6, 0.9 * scene.cells.wall_mm / scale), 4.0)
    noise = smooth_noise(rng, light.shape, grain)
    spots = np.float32(2.0 * scene.material.sparks) * np.maximum(noise - np.float32(1.6), 0.0)
    light *= np.clip(1.0 + np.float32(scene.material.texture) * noise + spots, 0.1, 3.0)


def _planes(scene: Scene, block: Relief, filled: Bytes | None) -> list[Float32s]:
    """Light that reaches the sensor, one plane for grey, three for colour."""
    falling = illumination(scene)
    if scene.things:
        falling *= shaded(scene, on_block=True)
    shine = patches(scene)
    walls = block.light * falling if shine is None else block.light * falling * shine
    open_share = 1.0 - block.cover
    table = table_light(scene)
    if scene.things:
        walls *= faded(scene)
        table *= structured(scene) * inked_table(scene) * shaded(scene, on_block=False)
    table = table * open_share * falling
    if scene.things:
        table += mirrored(scene, walls) * open_share
    glare = table_glare(scene) * open_share if scene.light.glare > 0.0 else np.float32(0.0)
    if not scene.sensor.colour:
        planes = [np.asarray(walls + table + glare, dtype=np.float32)]
    else:
        planes = [
            np.asarray(walls * a + table * np.float32(b) + glare, dtype=np.float32)
            for a, b in zip(tints(scene, filled), scene.table.colour, strict=True)
        ]
    if scene.things:
        add_flares(scene, planes, block.cover)
        lay_covers(scene, planes, falling)
    dust(scene, planes)
    return planes
