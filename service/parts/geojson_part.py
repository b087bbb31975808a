"""A polygon in GeoJSON's form (RFC 7946), in a unit of length that `properties.unit` names."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from service.parts.part import UNITS_MM, Asked, Drawing, PartFileError, Stroke


def read_geojson(path: Path, asked: Asked) -> Drawing:
    """The rings of the one polygon in the file; raise PartFileError without the file's name."""
    try:
        data = json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError) as error:
        raise PartFileError(f"is no GeoJSON ({error}). Save it anew") from error
    feature = _feature(data)
    properties = feature.get("properties") or {}
    unit = properties.get("unit", "") if isinstance(properties, dict) else ""
    if unit not in ("", *UNITS_MM):
        raise PartFileError(f"has the unit {unit!r} in its properties, expected {', '.join(UNITS_MM)}")
    unit = asked.settled(unit)
    if asked.layer:
        raise PartFileError(f"is GeoJSON, which has no layers; part.layer is {asked.layer!r}. Leave it out")
    geometry = feature.get("geometry", feature)
    rings = geometry.get("coordinates") if isinstance(geometry, dict) and geometry.get("type") == "Polygon" else None
    if not isinstance(rings, list):
        kind = geometry.get("type") if isinstance(geometry, dict) else geometry
        raise PartFileError(f"holds a geometry of type {kind!r}, expected one Polygon")
    return Drawing(tuple(_stroke(ring, number) for number, ring in enumerate(rings)), unit)


def _feature(data: Any) -> dict[str, Any]:
    features = data.get("features") if isinstance(data, dict) else None
    if isinstance(features, list):
        if len(features) != 1:
            raise PartFileError(f"holds {len(features)} features, expected one. Keep the part alone")
        data = features[0]
    if not isinstance(data, dict):
        raise PartFileError("holds no GeoJSON object, expected a Feature with a Polygon")
    return data


def _stroke(ring: Any, number: int) -> Stroke:
    name = f"ring {number}"
    try:
        points = np.array([point[:2] for point in ring], dtype=np.float64)
    except (ValueError, TypeError) as error:
        raise PartFileError(f"{name} holds no list of [x, y]. Correct it") from error
    if points.ndim != 2 or points.shape[1] != 2 or len(points) < 4:
        raise PartFileError(f"{name} has {len(points)} points, expected 4 or more, the last like the first")
    # Open here, so that what does not end where it began is told as for every other drawing.
    return Stroke(points, False, name)
