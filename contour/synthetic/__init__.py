"""Renders a block of known outline through a known camera: truth for tests, demo, bench and docs.

What it does not model: a lens's blur beyond a Gaussian, interreflection between foils, rolling shutter, colour filter
mosaics.
"""

from contour.synthetic.camera import CameraModel, camera_above
from contour.synthetic.cells import CellGeometry
from contour.synthetic.closed_border import closed_border
from contour.synthetic.coverage import area_coverage
from contour.synthetic.outlines import (
    blob,
    broken_off,
    convex,
    crescent,
    disc_ring,
    l_shape,
    moved,
    polygon,
    rectangle,
    signed_distance,
    thick_line,
    u_shape,
    with_holes,
)
from contour.synthetic.rendering import Rendered, pitch_px, render, render_empty_table, truth_px
from contour.synthetic.scene import Clutter, Light, Material, Scene, Sensor, Table
from contour.synthetic.things import (
    Cover,
    Crush,
    Fade,
    Filling,
    Flare,
    Ink,
    Mirror,
    Shade,
    Slip,
    Strip,
    Structure,
    Thing,
)

__all__ = [
    "CameraModel",
    "CellGeometry",
    "Clutter",
    "Cover",
    "Crush",
    "Fade",
    "Filling",
    "Flare",
    "Ink",
    "Light",
    "Material",
    "Mirror",
    "Rendered",
    "Scene",
    "Sensor",
    "Shade",
    "Slip",
    "Strip",
    "Structure",
    "Table",
    "Thing",
    "area_coverage",
    "blob",
    "broken_off",
    "camera_above",
    "closed_border",
    "convex",
    "crescent",
    "disc_ring",
    "l_shape",
    "moved",
    "pitch_px",
    "polygon",
    "rectangle",
    "render",
    "render_empty_table",
    "signed_distance",
    "thick_line",
    "truth_px",
    "u_shape",
    "with_holes",
]
