"""What is left of a block once its parts are cut out, as outlines: by shapely, whose room this is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from contour.geometry.rings import Contour
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

        from service.parts.shapely_contours import contour_of, polygon_of
    except ImportError as error:
        raise PartFileError("remnants need shapely. Install: pip install 'combtrace[export]'") from error
    cut = [polygon_of(part).buffer(worth.kerf_mm, quad_segs=32) for part in parts]
    left = polygon_of(block).difference(shapely.unary_union(cut))
    # Opened: shrunk and grown again, corners as they are, and never beyond what is there.
    half = worth.min_width_mm / 2
    inner = left.buffer(-half, join_style="mitre")
    kept = inner.buffer(half, join_style="mitre").intersection(left).simplify(_ROUND_MM)
    pieces = [one for one in shapely.get_parts(kept) if one.geom_type == "Polygon" and one.area >= worth.min_area_mm2]
    pieces.sort(key=lambda piece: -piece.area)
    return tuple(contour_of(piece) for piece in pieces)
