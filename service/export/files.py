"""A contour's exports by their names, and on disk."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from service.atomic_file import write_whole
from service.export.document import ExportDocument, ExportError
from service.export.dxf import to_dxf
from service.export.gcode import GcodeSettings, to_gcode
from service.export.geojson import to_geojson
from service.export.svg import to_svg


def exported(form: str, document: ExportDocument, gcode: Callable[[], GcodeSettings]) -> bytes:
    """The file's content; raise ExportError."""
    makers: dict[str, Callable[[ExportDocument], bytes]] = {
        "dxf": to_dxf,
        "svg": to_svg,
        "geojson": to_geojson,
        "gcode": lambda document: to_gcode(document, gcode()),
    }
    return makers[form](document)


def write_export(path: Path, data: bytes) -> None:
    """Write the file whole or leave what was there: another program may read it at any time. Raise ExportError."""
    try:
        write_whole(path, data)
    except OSError as error:
        raise ExportError(f"{path}: cannot be written: {error.strerror}. Name another file") from error


def read_template(path: Path) -> str:
    """The text of a G-code template; raise ExportError."""
    try:
        return path.read_text(encoding="utf-8")
    except OSError as error:
        raise ExportError(f"G-code template {path}: {error.strerror}; expected a text. Correct its path") from error
    except UnicodeDecodeError as error:
        raise ExportError(f"G-code template {path}: no UTF-8 text; expected one with $rings. Correct it") from error
