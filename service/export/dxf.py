"""DXF by ezdxf: closed LWPOLYLINEs, exteriors and holes of block and part, each on a layer of its own; millimetres."""

from __future__ import annotations

import io

from service.export.document import EXTERIOR, HOLES, PART, PART_HOLES, ExportDocument, ExportError

COLOURS = {EXTERIOR: 7, HOLES: 1, PART: 6, PART_HOLES: 6}  # white or black after the background, red, magenta
VERSION = "R2010"


def to_dxf(document: ExportDocument) -> bytes:
    """The contour as a DXF file of AutoCAD 2010, text form; raise ExportError where ezdxf is not installed."""
    try:
        from ezdxf import units
        from ezdxf.document import Drawing
    except ImportError as error:
        raise ExportError("DXF needs ezdxf, which is not here. Install: pip install 'combtrace[export]'") from error
    drawing = Drawing.new(VERSION)
    drawing.units = units.MM
    drawing.header["$MEASUREMENT"] = 1
    drawing.header.custom_vars.append("combtrace", document.note)
    space = drawing.modelspace()
    contour, parts = document.oriented(), document.oriented_parts()
    layers = [(EXTERIOR, (contour.exterior,)), (HOLES, contour.holes)]
    if parts:
        holes = tuple(hole for part in parts for hole in part.holes)
        layers += [(PART, tuple(part.exterior for part in parts)), (PART_HOLES, holes)]
    for layer, rings in layers:
        drawing.layers.add(layer, color=COLOURS[layer])
        for ring in rings:
            space.add_lwpolyline(ring.tolist(), close=True, dxfattribs={"layer": layer})
    text = io.StringIO()
    drawing.write(text)
    return text.getvalue().encode(drawing.output_encoding, "dxfreplace")
