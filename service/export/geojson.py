"""A polygon in GeoJSON's form (RFC 7946), but in millimetres of the machine frame instead of degrees on the earth."""

from __future__ import annotations

import json
from typing import Any

from contour.geometry.rings import Contour, Ring
from service.export.document import ExportDocument


def to_geojson(document: ExportDocument) -> bytes:
    """A Feature with one Polygon: rings closed by their first vertex, exterior counter-clockwise, holes clockwise.

    With parts a FeatureCollection, of the block's and each part's, as their property `role` says.
    """
    block, parts = document.oriented(), document.oriented_parts()
    feature = _feature(document, block, {"uncertainty_mm": document.uncertainty_mm})
    if parts:
        feature["properties"]["role"] = "block"
        all_of_them = [feature, *(_feature(document, part, {"role": "part"}) for part in parts)]
        feature = {"type": "FeatureCollection", "features": all_of_them}
    return (json.dumps(feature, ensure_ascii=False) + "\n").encode()


def _feature(document: ExportDocument, contour: Contour, more: dict[str, Any]) -> dict[str, Any]:
    return {
        "type": "Feature",
        "geometry": {"type": "Polygon", "coordinates": [_closed(ring) for ring in contour.rings]},
        "properties": {
            "title": document.title,
            "unit": "mm",
            "frame": "machine",
            "thickness_mm": document.thickness_mm,
            **more,
        },
    }


def _closed(ring: Ring) -> list[list[float]]:
    points = [[round(float(x), 4), round(float(y), 4)] for x, y in ring]
    return [*points, points[0]]
