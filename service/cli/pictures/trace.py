"""`combtrace trace IMAGE…`: trace pictures; no controller is needed."""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from service.cli.colour import Colour, painted
from service.cli.errors import EXIT_OK, EXIT_REFUSED, EXIT_UNUSABLE, UserError
from service.cli.file_names import check_outputs, distinct_stems, make_folder, output_path
from service.cli.json_output import json_output
from service.cli.options.export import Exports, add_export_arguments
from service.cli.options.measuring import find_recipe, guard_of, load_config_or_default, thickness_of
from service.cli.pictures.given_pictures import add_pictures_argument, pictures_of
from service.cli.pictures.trace_record import record_of, sentence, unusable_record

if TYPE_CHECKING:
    from service.config.config import Config
    from service.config.recipes import Recipe
    from service.measuring.measure import Measurer
    from service.measuring.measurement import Measurement
    from service.measuring.table_file import TableRecord

HELP = "trace the contour in pictures"
DESCRIPTION = """\
Trace the block's contour in each picture. Without --config, embedded defaults
apply. Sizes that are not given follow from the picture's own cell pitch.

Exit status: 0 traced and accepted, 3 refused with a reason, 2 unusable input or
usage; of several pictures the worst counts (0 < 3 < 2)."""

METHODS = ("wall-tips", "sliding-matrix", "direct-scan", "find-contours")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Pictures, method and its sizes, configuration, outputs."""
    add_pictures_argument(parser, what="picture files")
    parser.add_argument("--method", choices=METHODS)
    parser.add_argument("--core-px", type=int, metavar="PX", help="sliding-matrix: half the window's side")
    parser.add_argument("--step-px", type=int, metavar="PX", help="sliding-matrix: the window's step")
    parser.add_argument("--threshold", type=float, metavar="0…255", help="sliding-matrix: mean that fills a window")
    parser.add_argument("--max-gap-px", type=int, metavar="PX", help="direct-scan: longest dark run inside the block")
    parser.add_argument("--min-width-px", type=int, metavar="PX", help="direct-scan: narrower pairs are noise")
    parser.add_argument("--polarity", choices=("auto", "bright", "dark"), help="walls against the table")
    parser.add_argument("--binarize", type=_binarize, metavar="flat|otsu|0…255", help="how walls are told from gaps")
    parser.add_argument("--edge", choices=("cut", "cells"), help="cells: the border cells are closed")
    parser.add_argument(
        "--roi-px", type=_box, metavar="LEFT,TOP,RIGHT,BOTTOM", help="region of interest: nothing is seen outside of it"
    )
    parser.add_argument("--config", type=Path, metavar="FILE", help="configuration with recipes")
    parser.add_argument("--recipe", metavar="NAME", help="recipe by name or number")
    parser.add_argument("--calibration", type=Path, metavar="FILE", help="pixels to millimetres")
    parser.add_argument("--thickness-mm", type=float, metavar="H", help="height of the traced plane above the table")
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
    with json_output(args.json) as write:
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

    measurer: Measurer
    recipe: Recipe
    thickness_mm: float
    overlays: dict[Path, Path]
    language: str
    exports: Exports

    @classmethod
    def of(cls, args: argparse.Namespace) -> _Setup:
        import numpy as np

        from service.measuring.measure import Measurer

        config = load_config_or_default(args.config)
        recipe = _recipe(config, args)
        guard = guard_of(config, args)
        thickness_mm = thickness_of(args, recipe)
        if guard is None and args.thickness_mm is not None:
            print(
                f"combtrace trace: --thickness-mm {thickness_mm:g} has no effect: without a calibration contours stay "
                "in pixels. Name one by --calibration or --config",
                file=sys.stderr,
            )
        overlays = {} if args.overlay is None else _overlays(args.overlay, args.images, several=args.several)
        exports = Exports.of(args, recipe, calibrated=guard is not None)
        told = [] if args.json in (None, "-") else [("--json", Path(args.json))]
        check_outputs(args.images, [*told, *(("--overlay", file) for file in overlays.values()), *exports.outputs])
        work_area = np.array(config.work_area_mm, dtype=np.float64) if config.work_area_mm else None
        return cls(
            Measurer(
                guard.record.calibration if guard else None, guard=guard, work_area_mm=work_area, table=_table(config)
            ),
            recipe,
            thickness_mm,
            overlays,
            args.language,
            exports,
        )


def _overlays(overlay: Path, images: list[Path], *, several: bool) -> dict[Path, Path]:
    """The overlay file of each picture; the folder for several is made. Raise UserError."""
    if not several and not overlay.is_dir():
        files = {images[0]: overlay}
    else:
        make_folder("--overlay", overlay)
        files = {image: overlay / f"{stem}-contour.png" for image, stem in distinct_stems(images).items()}
    return files


def _recipe(config: Config, args: argparse.Namespace) -> Recipe:
    """The recipe, by name, number or default, with what the command line says otherwise."""
    from service.config.recipes import Recipe

    found = find_recipe(config, args.recipe)
    changes: dict[str, Any] = {
        name: getattr(args, name)
        for name in ("method", "polarity", "binarize", "edge")
        if getattr(args, name) is not None
    }
    given = {
        name: getattr(args, name)
        for name in ("core_px", "step_px", "threshold", "max_gap_px", "min_width_px")
        if getattr(args, name) is not None
    }
    method_changed = changes.get("method", found.method) != found.method
    if args.roi_px is not None:
        changes.update(roi_px=args.roi_px, roi_mm=())
    if given or method_changed:
        kept = {} if method_changed else found.parameters
        changes["parameters"] = {**kept, **given}
    if not changes:
        return found
    from pydantic import ValidationError

    try:
        return Recipe.model_validate({**found.model_dump(), **changes})
    except ValidationError as error:
        from service.config.mistakes import describe

        raise UserError("; ".join(describe(error, Recipe))) from error


def _trace_one(image: Path, setup: _Setup) -> tuple[dict[str, Any], str, int]:
    """The JSON object, the line for people, and the exit status of one picture."""
    from contour.errors import ContourError
    from drivers.camera import CameraError
    from drivers.camera.files.decode import read_picture
    from drivers.camera.files.folder import shown

    started = time.perf_counter()
    try:
        picture = read_picture(image)
        read_ms = (time.perf_counter() - started) * 1000
        measurement = setup.measurer.measure(picture, setup.recipe, setup.thickness_mm)
    except (CameraError, ContourError) as error:
        line = f"{image}: {str(error).removeprefix(f'{shown(image)}: ')}"  # drivers name the file, the tracing does not
        return unusable_record(image, setup.recipe.method, str(error)), line, EXIT_UNUSABLE
    times = {"read": read_ms, **measurement.timings_ms}
    times["total"] = sum(value for name, value in times.items() if name != "total")
    measurement = replace(measurement, timings_ms=times)
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


def _table(config: Config) -> TableRecord | None:
    from service.wiring.errors import WiringError
    from service.wiring.plan import find_table

    try:
        return find_table(config)
    except WiringError as error:
        raise UserError(str(error)) from error


def _box(text: str) -> tuple[float, ...]:
    try:
        left, top, right, bottom = (float(word) for word in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}: expected four numbers, LEFT,TOP,RIGHT,BOTTOM") from None
    return left, top, right, bottom


def _binarize(text: str) -> str | int:
    if text in ("flat", "otsu"):
        return text
    if text.isdigit() and int(text) <= 255:
        return int(text)
    raise argparse.ArgumentTypeError(f"{text!r}: expected flat, otsu, or a number 0 to 255")
