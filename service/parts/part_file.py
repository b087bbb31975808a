"""A part from its file, whichever form it has."""

from __future__ import annotations

from pathlib import Path

from service.parts.part import LARGEST_FILE, UNITS_MM, Asked, Drawing, Part, PartFileError
from service.parts.rings import outline_of

ENDINGS = (".dxf", ".svg", ".geojson", ".json")


def load_part(path: Path, asked: Asked | None = None) -> Part:
    """The part in a DXF, SVG or GeoJSON file, in millimetres of its own axes; raise PartFileError."""
    asked = asked or Asked()
    try:
        size = path.stat().st_size
    except OSError as error:
        raise PartFileError(f"{path}: cannot be read: {error.strerror}. Correct the part's path") from error
    if not path.is_file():
        raise PartFileError(f"{path}: is no file. Name the part's file")
    if size > LARGEST_FILE:
        raise PartFileError(f"{path}: has {size} bytes, expected {LARGEST_FILE} at most. Save the part's outline alone")
    try:
        drawing = _read(path, asked)
        return Part(path, outline_of(drawing.strokes, UNITS_MM[drawing.unit]), drawing.unit)
    except PartFileError as error:
        raise PartFileError(f"{path}: {error}") from error


def _read(path: Path, asked: Asked) -> Drawing:
    ending = path.suffix.lower()
    if ending == ".dxf":
        from service.parts.dxf_part import read_dxf

        return read_dxf(path, asked)
    if ending == ".svg":
        from service.parts.svg_part import read_svg

        return read_svg(path, asked)
    if ending in ENDINGS:
        from service.parts.geojson_part import read_geojson

        return read_geojson(path, asked)
    raise PartFileError(f"has the ending {path.suffix!r}, expected {', '.join(ENDINGS)}")
