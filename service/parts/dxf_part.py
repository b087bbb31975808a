"""Outlines in DXF, read by ezdxf: lines, arcs, circles, ellipses, polylines and splines of the model space."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from service.parts.part import MOST_ENTITIES, Asked, Drawing, PartFileError, Stroke, chord_in

if TYPE_CHECKING:
    from ezdxf.entities.dxfentity import DXFEntity

UNITS = {1: "in", 4: "mm", 5: "cm", 6: "m", 13: "um"}
"""$INSUNITS."""

WRITING = frozenset(
    {"TEXT", "MTEXT", "ATTDEF", "DIMENSION", "ARC_DIMENSION", "LEADER", "MULTILEADER", "TOLERANCE", "POINT", "VIEWPORT"}
)
"""What is written on a drawing and cannot be an outline."""

CURVES = ("LINE", "ARC", "CIRCLE", "ELLIPSE", "SPLINE", "LWPOLYLINE", "POLYLINE")
_CLOSED = frozenset({"CIRCLE"})
_FLAT = 1e-6


def read_dxf(path: Path, asked: Asked) -> Drawing:
    """The strokes of the model space, of one layer where asked; raise PartFileError without the file's name."""
    try:
        from ezdxf.filemanagement import readfile
        from ezdxf.lldxf.const import DXFError
    except ImportError as error:
        raise PartFileError("is DXF, which needs ezdxf. Install: pip install 'combtrace[export]'") from error
    try:
        document = readfile(path)
    except (
        OSError,
        DXFError,
        ValueError,
        LookupError,
        TypeError,
        AttributeError,
    ) as error:  # what it raises of damage
        raise PartFileError(f"is no DXF that can be read ({error}). Save it anew as DXF R2000 or later") from error
    code = int(document.header.get("$INSUNITS", 0))
    if code and code not in UNITS:
        raise PartFileError(
            f"is drawn in unit {code} of $INSUNITS, expected mm, cm, m, um or in. Save it in one of them"
        )
    unit = asked.settled(UNITS.get(code, ""))
    entities = [one for one in document.modelspace() if one.dxftype() not in WRITING]
    layers = {str(one.dxf.get("layer", "0")) for one in entities}
    if asked.layer:
        if asked.layer not in layers:
            raise PartFileError(f"has nothing on layer {asked.layer!r}, but on {', '.join(sorted(layers)) or 'none'}")
        entities = [one for one in entities if one.dxf.get("layer", "0") == asked.layer]
    if len(entities) > MOST_ENTITIES:
        raise PartFileError(
            f"has {len(entities)} entities, expected {MOST_ENTITIES} at most. Save the part alone, or name its layer"
        )
    return Drawing(tuple(_strokes(entities, chord_in(unit))), unit)


def _strokes(entities: Iterable[DXFEntity], chord: float) -> Iterator[Stroke]:
    for entity in entities:
        kind, layer = entity.dxftype(), entity.dxf.get("layer", "0")
        name = f"{kind} #{entity.dxf.handle} on layer {layer!r}"
        if kind not in CURVES:
            raise PartFileError(
                f"holds {name}, expected only {', '.join(CURVES)}. Explode it into these, or name the part's layer"
            )
        try:
            points = np.array([tuple(point) for point in _points(entity, chord)], dtype=np.float64).reshape(-1, 3)
        except (ValueError, TypeError, ArithmeticError, RecursionError) as error:
            raise PartFileError(f"{name}: cannot be drawn ({error}). Correct it") from error
        if len(points) and float(np.ptp(points[:, 2])) > _FLAT:
            raise PartFileError(
                f"{name} is not flat: z runs over {np.ptp(points[:, 2]):.3g}. Draw the part in one plane"
            )
        plane = points[:, :2]
        if len(plane) < 2 or not np.ptp(plane, axis=0).any():
            raise PartFileError(f"{name} has no length. Take it out")
        yield Stroke(plane, kind in _CLOSED or bool(getattr(entity, "is_closed", False)), name)


def _points(entity: Any, chord: float) -> Iterable[Any]:
    """Points along a curve, none farther than a chord from it."""
    kind = entity.dxftype()
    if kind == "LINE":
        return [entity.dxf.start, entity.dxf.end]
    if kind not in ("POLYLINE", "LWPOLYLINE"):
        return list(entity.flattening(chord))
    if kind == "POLYLINE" and not (entity.is_2d_polyline or entity.is_3d_polyline):
        raise ValueError("it is a mesh")
    runs = [list(_points(piece, chord)) for piece in entity.virtual_entities()]
    # An arc runs counter-clockwise, whichever way its polyline does.
    if len(runs) > 1 and min(runs[0][0].distance(end) for end in (runs[1][0], runs[1][-1])) < min(
        runs[0][-1].distance(end) for end in (runs[1][0], runs[1][-1])
    ):
        runs[0].reverse()
    found: list[Any] = runs[0] if runs else []
    for run in runs[1:]:
        if run[0].distance(found[-1]) > run[-1].distance(found[-1]):
            run.reverse()
        found += run[1:]
    return found
