"""A polygon in GeoJSON's form (RFC 7946), but in millimetres of the machine frame instead of degrees on the earth."""

from __future__ import annotations

import json

from contour.geometry.rings import Ring
from service.export.document import ExportDocument


def to_geojson(document: ExportDocument) -> bytes:
    """A Feature with one Polygon: rings closed by their first vertex, exterior counter-clockwise, holes clockwise."""
    contour = document.oriented()
    feature = {
        "type": "Feature",
        "geometry": {"type": "Polygon", "coordinates": [_closed(ring) for ring in contour.rings]},
        "properties": {
            "title": document.title,
            "unit": "mm",
            "frame": "machine",
            "thickness_mm": document.thickness_mm,
            "uncertainty_mm": document.uncertainty_mm,
        },
    }
    return (json.dumps(feature, ensure_ascii=False) + "\n").encode()


def _closed(ring: Ring) -> list[list[float]]:
    points = [[round(float(x), 4), round(float(y), 4)] for x, y in ring]
    return [*points, points[0]]
