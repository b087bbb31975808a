"""What is left of a block once its parts are cut out, as outlines: by shapely, whose room this is."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from contour.geometry.rings import Contour, oriented_contour
from service.parts.part import PartFileError

_ROUND_MM = 0.01


@dataclass(frozen=True)
class Worth:
    """What is worth keeping. kerf_mm: what cutting takes away around each part. least: of area and of width."""

    kerf_mm: float = 2.0
    min_area_mm2: float = 2500.0
    min_width_mm: float = 10.0


def remnants_of(block: Contour, parts: Sequence[Contour], worth: Worth) -> tuple[Contour, ...]:
    """Outlines of the pieces that are left, mm, the largest first.

    What is narrower than `min_width_mm` is cut off them. PartFileError: what it needs is not installed.
    """
    try:
        import shapely
    except ImportError as error:
        raise PartFileError("remnants need shapely. Install: pip install 'combtrace[export]'") from error
    shape = shapely.Polygon(block.exterior, list(block.holes))
    cut = [shapely.Polygon(part.exterior, list(part.holes)).buffer(worth.kerf_mm, quad_segs=32) for part in parts]
    left = shape.difference(shapely.unary_union(cut))
    # Opened: shrunk and grown again, corners as they are, and never beyond what is there.
    half = worth.min_width_mm / 2
    inner = left.buffer(-half, join_style="mitre")
    kept = inner.buffer(half, join_style="mitre").intersection(left).simplify(_ROUND_MM)
    pieces = [one for one in shapely.get_parts(kept) if one.geom_type == "Polygon" and one.area >= worth.min_area_mm2]
    pieces.sort(key=lambda piece: -piece.area)
    return tuple(_contour(piece.exterior.coords, (ring.coords for ring in piece.interiors)) for piece in pieces)


def _contour(exterior: Iterable[Sequence[float]], holes: Iterable[Iterable[Sequence[float]]]) -> Contour:
    rings = [np.array([tuple(point)[:2] for point in ring], dtype=np.float64)[:-1] for ring in (exterior, *holes)]
    return oriented_contour(Contour(rings[0], tuple(rings[1:])), counter_clockwise=True)
