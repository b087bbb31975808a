"""`combtrace trace IMAGE…`: trace pictures; no controller is needed."""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from service.cli.colour import Colour, painted
from service.cli.errors import EXIT_OK, EXIT_REFUSED, EXIT_UNUSABLE, UserError
from service.cli.file_names import check_outputs, distinct_stems, make_folder, output_path
from service.cli.options.export import Exports, add_export_arguments
from service.cli.options.tracing import Tracing, add_tracing_arguments
from service.cli.pictures.given_pictures import add_pictures_argument, pictures_of
from service.cli.pictures.trace_record import record_of, sentence, unusable_record
from service.cli.text_output import text_output
from service.config.plain_recipe import PlainRecipe

if TYPE_CHECKING:
    from service.measuring.measurement import Measurement

HELP = "trace the contour in pictures"
DESCRIPTION = """\
Trace the block's contour in each picture. Without --config, embedded defaults
apply. Sizes that are not given follow from the picture's own cell pitch.

Exit status: 0 traced and accepted, 3 refused with a reason, 2 unusable input or
usage; of several pictures the worst counts (0 < 3 < 2)."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Pictures, method and its sizes, configuration, outputs."""
    add_pictures_argument(parser, what="picture files")
    add_tracing_arguments(parser)
    parser.add_argument("--json", metavar="FILE", help="JSON Lines, one object a picture; - is standard output")
    parser.add_argument(
        "--overlay", type=output_path, metavar="FILE", help="picture with contour; a folder for several images"
    )
    add_export_arguments(parser)
    parser.add_argument(
        "--language", choices=("en", "ru"), default="en", help="ru: each reason also in Russian, with what to do"
    )


def run(args: argparse.Namespace) -> int:
    """Trace all pictures; the worst exit status."""
    # A folder is several pictures, also where it holds one today: outputs go into a folder then, too.
    args.several = len(args.images) > 1 or args.images[0].is_dir()
    args.images = pictures_of(args.images)
    setup = _Setup.of(args)
    texts = sys.stderr if args.json == "-" else sys.stdout
    worst = EXIT_OK
    with text_output(args.json) as write:
        for image in args.images:
            record, line, status = _trace_one(image, setup)
            stream = texts if status != EXIT_UNUSABLE else sys.stderr
            print(_painted(line, image, status, stream), file=stream, flush=True)
            worst = max(worst, status, key=(EXIT_OK, EXIT_REFUSED, EXIT_UNUSABLE).index)
            write(json.dumps(record, ensure_ascii=False) + "\n")
    return worst


def _painted(line: str, image: Path, status: int, stream: TextIO) -> str:
    """The line with the picture's name, and that it is refused, in the verdict's colour."""
    head = next(head for head in (f"{image}: refused:", f"{image}:", "") if line.startswith(head))
    return painted(head, Colour.GOOD if status == EXIT_OK else Colour.BAD, stream) + line.removeprefix(head)


@dataclass(frozen=True)
class _Setup:
    """What all pictures share."""

    tracing: Tracing
    overlays: dict[Path, Path]
    language: str
    exports: Exports

    @classmethod
    def of(cls, args: argparse.Namespace) -> _Setup:
        tracing = Tracing.of(args)
        overlays = {} if args.overlay is None else _overlays(args.overlay, args.images, several=args.several)
        exports = Exports()
        if not isinstance(tracing.recipe, PlainRecipe):
            exports = Exports.of(args, tracing.recipe, calibrated=tracing.measurer.calibrated)
        told = [] if args.json in (None, "-") else [("--json", Path(args.json))]
        check_outputs(args.images, [*told, *(("--overlay", file) for file in overlays.values()), *exports.outputs])
        return cls(tracing, overlays, args.language, exports)


def _overlays(overlay: Path, images: list[Path], *, several: bool) -> dict[Path, Path]:
    """The overlay file of each picture; the folder for several is made. Raise UserError."""
    if not several and not overlay.is_dir():
        files = {images[0]: overlay}
    else:
        make_folder("--overlay", overlay)
        files = {image: overlay / f"{stem}-contour.png" for image, stem in distinct_stems(images).items()}
    return files


def _trace_one(image: Path, setup: _Setup) -> tuple[dict[str, Any], str, int]:
    """The JSON object, the line for people, and the exit status of one picture."""
    from contour.errors import ContourError
    from drivers.camera import CameraError
    from drivers.camera.files.folder import shown

    try:
        picture, measurement = setup.tracing.traced(image)
    except (CameraError, ContourError) as error:
        line = f"{image}: {str(error).removeprefix(f'{shown(image)}: ')}"  # drivers name the file, the tracing does not
        return unusable_record(image, setup.tracing.recipe.method, str(error)), line, EXIT_UNUSABLE
    overlay = setup.overlays.get(image)
    note = ""
    if overlay is not None:
        _write_overlay(overlay, picture, measurement)
        note = f"  [{overlay}]"
    exports = setup.exports.write(image, measurement)
    if exports:
        note += f"  [{', '.join(exports)}]"
    status = EXIT_REFUSED if measurement.findings else EXIT_OK
    return record_of(image, measurement), f"{image}: {sentence(measurement, setup.language)}{note}", status


def _write_overlay(path: Path, picture: Any, measurement: Measurement) -> None:
    from service.records.pictures import PictureFileError, write_overlay

    try:
        write_overlay(path, picture, measurement)
    except PictureFileError as error:
        raise UserError(str(error)) from error
