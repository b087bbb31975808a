"""SVG whose size on paper is the contour's: 1 user unit is 1 mm, coordinates are the machine frame's."""

from __future__ import annotations

from xml.sax.saxutils import escape

from contour.geometry.rings import Ring, bounding_box
from service.export.document import EXTERIOR, HOLES, PART, PART_HOLES, ExportDocument

MARGIN_MM = 5.0
LINE_MM = 0.2


def to_svg(document: ExportDocument) -> bytes:
    """The contour as an SVG file, UTF-8; one path an element, its group upside down as SVG's y runs down."""
    contour = document.oriented()
    box = bounding_box(contour.exterior)
    left, bottom = box.min_x - MARGIN_MM, box.min_y - MARGIN_MM
    width, height = box.max_x + MARGIN_MM - left, box.max_y + MARGIN_MM - bottom
    paths = [f'    <path id="{EXTERIOR}" d="{_path(contour.exterior)}"/>']
    paths += [f'    <path id="{HOLES}-{number}" d="{_path(hole)}"/>' for number, hole in enumerate(contour.holes, 1)]
    parts = document.oriented_parts()
    for number, part in enumerate(parts, 1):
        of = f"-{number}" if len(parts) > 1 else ""
        named = [(PART + of, part.exterior), *((f"{PART_HOLES}{of}-{k}", hole) for k, hole in enumerate(part.holes, 1))]
        paths += [f'    <path id="{name}" stroke="magenta" d="{_path(ring)}"/>' for name, ring in named]
    return "\n".join(
        [
            '<?xml version="1.0" encoding="UTF-8"?>',
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.4f}mm" height="{height:.4f}mm"'
            f' viewBox="{left:.4f} {-(bottom + height):.4f} {width:.4f} {height:.4f}">',
            f"  <title>{escape(document.title)}</title>",
            f"  <desc>{escape(document.note)}</desc>",
            f'  <g transform="scale(1 -1)" fill="none" stroke="black" stroke-width="{LINE_MM}">',
            *paths,
            "  </g>",
            "</svg>",
            "",
        ]
    ).encode()


def _path(ring: Ring) -> str:
    points = " L ".join(f"{x:.4f},{y:.4f}" for x, y in ring)
    return f"M {points} Z"
