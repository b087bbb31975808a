"""`combtrace fit IMAGE --part FILE`: whether a part can be cut from the block in a picture, and where it lies best."""

from __future__ import annotations

import argparse
import dataclasses
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from service.cli.colour import Colour, painted
from service.cli.errors import EXIT_OK, EXIT_REFUSED, EXIT_UNUSABLE, UserError
from service.cli.file_names import check_outputs, output_path
from service.cli.options.export import Exports, add_export_arguments
from service.cli.options.part import add_part_arguments, with_part
from service.cli.options.tracing import Tracing, add_tracing_arguments
from service.cli.pictures.trace_record import sentence
from service.cli.text_output import text_output
from service.config.plain_recipe import PlainRecipe

if TYPE_CHECKING:
    from service.measuring.measurement import Measurement

HELP = "say whether a part fits into the block in a picture"
DESCRIPTION = """\
Trace the block as `combtrace trace` does, and lay the part into it where its least
margin to edge and holes is largest. It fits where that is the margin asked for and the
contour's own 95 % bound together. Of a recipe with several `parts` as many as fit are
laid. The pose moves the part as drawn, its file's origin
and axes, into the machine frame: first the turn, counter-clockwise, then the shift.

Exit status: 0 it fits, 3 it does not or the block was refused, 2 unusable input or
usage."""

_NOTHING = {"fits": False, "pose": None, "margin_mm": None, "needed_mm": None, "tightest_mm": None}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The picture, the part, how the block is traced, outputs."""
    parser.add_argument("image", type=Path, metavar="IMAGE", help="picture file")
    add_part_arguments(parser)
    add_tracing_arguments(parser)
    parser.add_argument("--json", metavar="FILE", help="one JSON object; - is standard output")
    parser.add_argument("--overlay", type=output_path, metavar="FILE", help="picture with block, part and margin")
    parser.add_argument("--remnants", type=Path, metavar="FILE", help="note in this list what is left of the block")
    parser.add_argument("--kerf-mm", type=float, default=2.0, metavar="MM", help="what cutting takes away; default 2")
    add_export_arguments(parser)
    parser.add_argument(
        "--language", choices=("en", "ru"), default="en", help="ru: each reason also in Russian, with what to do"
    )


def run(args: argparse.Namespace) -> int:
    """Trace, lay the part, tell."""
    tracing = Tracing.of(args)
    if not tracing.measurer.calibrated:
        raise UserError("a part is in millimetres: name the calibration by --calibration or --config")
    tracing = dataclasses.replace(tracing, recipe=with_part(tracing.recipe, args))
    files = _checked_parts(tracing)
    args.images, args.several = [args.image], False
    exports = Exports()
    if not isinstance(tracing.recipe, PlainRecipe):
        exports = Exports.of(args, tracing.recipe, calibrated=True)
    outputs = [("--json", Path(args.json))] if args.json not in (None, "-") else []
    outputs += [("--overlay", args.overlay)] if args.overlay is not None else []
    check_outputs([args.image, *files], [*outputs, *exports.outputs])
    with text_output(args.json) as write:
        record, line, status = _fitted(args, tracing, exports)
        stream = sys.stderr if args.json == "-" or status == EXIT_UNUSABLE else sys.stdout
        print(painted(line, Colour.GOOD if status == EXIT_OK else Colour.BAD, stream), file=stream, flush=True)
        write(json.dumps(record, ensure_ascii=False) + "\n")
    return status


def _checked_parts(tracing: Tracing) -> list[Path]:
    """The parts' files, read before any picture is; raise UserError."""
    from service.parts.part import PartFileError

    recipe = tracing.recipe
    asked = recipe.asked_parts
    try:
        for part in asked:
            tracing.measurer.parts.part_of(part)
    except PartFileError as error:
        raise UserError(str(error)) from error
    return [part.file for part in asked]


def _fitted(args: argparse.Namespace, tracing: Tracing, exports: Exports) -> tuple[dict[str, Any], str, int]:
    """The JSON object, the line for people, and the exit status."""
    from contour.errors import ContourError
    from drivers.camera import CameraError
    from drivers.camera.files.folder import shown

    try:
        picture, measurement = tracing.traced(args.image)
    except (CameraError, ContourError) as error:
        return _record(args.image, None, "error", str(error)), f"combtrace fit: {error}", EXIT_UNUSABLE
    note = "" if args.overlay is None else f"  [{args.overlay}]"
    if args.overlay is not None:
        _write_overlay(args.overlay, picture, measurement)
    if args.remnants is not None and measurement.laid and not measurement.findings:
        note += f"  [remnants {_kept(args, picture, measurement)}]"
    written = exports.write(args.image, measurement)
    note += f"  [{', '.join(written)}]" if written else ""
    fits = bool(measurement.laid) and not measurement.findings
    told = measurement.part.sentence if fits and measurement.part else sentence(measurement, args.language)
    told += f", {measurement.ribbon.words}" if fits and measurement.part and measurement.ribbon else ""
    line = f"{shown(args.image)}: {'fits: ' if fits else ''}{told}{note}"
    return _record(args.image, measurement), line, EXIT_OK if fits else EXIT_REFUSED


def _record(image: Path, measurement: Measurement | None, status: str = "ok", detail: str = "") -> dict[str, Any]:
    """The contract's object; what is not known of a block that was refused, or a picture that was not read, is null."""
    from drivers.camera.files.folder import shown

    part = None if measurement is None else measurement.part
    told = {**_NOTHING, "part_mm": None, "short_by_mm": None} if part is None else part.fields()
    told["fits"] = measurement is not None and bool(measurement.laid) and not measurement.findings
    if measurement is None:
        return {"image": shown(image), "status": status, "reasons": [], **told, "details": [detail]}
    return {
        "image": shown(image),
        "status": "refused" if measurement.findings else "ok",
        "reasons": [reason.label for reason in measurement.reasons],
        **told,
        **({} if measurement.ribbon is None else {"ribbon": measurement.ribbon.fields()}),
        **({"parts": _parts(measurement), "not_laid": _not_laid(measurement)} if measurement.parts else {}),
        "uncertainty_mm": measurement.uncertainty_mm,
        "timings_ms": {name: round(value, 3) for name, value in measurement.timings_ms.items()},
        "details": list(measurement.texts),
    }


def _kept(args: argparse.Namespace, picture: Any, measurement: Measurement) -> str:
    """The numbers of what is left of the block, noted in the list."""
    from drivers.camera import Frame
    from service.parts.part import PartFileError
    from service.parts.remnant import Worth
    from service.records.evidence import overlay_bytes
    from service.records.remnants import Remnants, RemnantsError

    if not 0 <= args.kerf_mm <= 1000:
        raise UserError(f"--kerf-mm {args.kerf_mm:g}: expected 0 to 1000")
    drawn = overlay_bytes(Frame(picture, 0.0, True, str(args.image), 0, ""), measurement)
    try:
        numbers = Remnants(args.remnants).keep(str(args.image.resolve()), measurement, Worth(args.kerf_mm), drawn)
    except (RemnantsError, PartFileError) as error:
        raise UserError(str(error)) from error
    return ", ".join(map(str, numbers)) or "none"


def _parts(measurement: Measurement) -> list[dict[str, Any]]:
    """Each of several parts, in the order in which they were laid, with its number in the recipe and its drawing."""
    return [{"part": fit.number, "file": fit.part.path.name, **fit.fields()} for fit in measurement.parts]


def _not_laid(measurement: Measurement) -> list[dict[str, int]]:
    """Of several parts the numbers of those that found no more room, and how many of each."""
    each = measurement.laid_of_each
    return [{"part": number, "missing": wanted - laid} for number, laid, wanted in each if laid < wanted]


def _write_overlay(path: Path, picture: Any, measurement: Measurement) -> None:
    from service.records.pictures import PictureFileError, write_overlay

    try:
        write_overlay(path, picture, measurement)
    except PictureFileError as error:
        raise UserError(str(error)) from error
