"""What commands that trace pictures share: the options of a recipe, and the measurer that they make."""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from service.cli.errors import UserError
from service.cli.options.measuring import find_recipe, guard_of, load_config_or_default, thickness_of
from service.config.plain_recipe import PlainRecipe
from service.export.forms import ENDINGS

if TYPE_CHECKING:
    from contour.geometry.arrays import Bytes
    from service.config.config import Config
    from service.config.recipes import AnyRecipe, Recipe
    from service.measuring.measure import Measurer
    from service.measuring.measurement import Measurement
    from service.measuring.table_file import TableRecord

_RECIPE_KEYS = ("method", "polarity", "binarize", "edge")
_PARAMETERS = ("core_px", "step_px", "threshold", "max_gap_px", "min_width_px")
METHODS = ("wall-tips", "sliding-matrix", "direct-scan", "find-contours")


def add_tracing_arguments(parser: argparse.ArgumentParser) -> None:
    """Method and its sizes, configuration, calibration."""
    parser.add_argument("--method", choices=METHODS)
    parser.add_argument("--core-px", type=int, metavar="PX", help="sliding-matrix: half the window's side")
    parser.add_argument("--step-px", type=int, metavar="PX", help="sliding-matrix: the window's step")
    parser.add_argument("--threshold", type=float, metavar="0…255", help="sliding-matrix: mean that fills a window")
    parser.add_argument("--max-gap-px", type=int, metavar="PX", help="direct-scan: longest dark run inside the block")
    parser.add_argument("--min-width-px", type=int, metavar="PX", help="direct-scan: narrower pairs are noise")
    parser.add_argument("--polarity", choices=("auto", "bright", "dark"), help="walls against the table")
    parser.add_argument("--binarize", type=_binarize, metavar="flat|otsu|0…255", help="how walls are told from gaps")
    parser.add_argument(
        "--edge", choices=("auto", "cut", "cells"), help="cells: the border cells are closed; auto: seen"
    )
    parser.add_argument(
        "--roi-px", type=_box, metavar="LEFT,TOP,RIGHT,BOTTOM", help="region of interest: nothing is seen outside of it"
    )
    parser.add_argument("--config", type=Path, metavar="FILE", help="configuration with recipes")
    parser.add_argument("--recipe", metavar="NAME", help="recipe by name or number")
    parser.add_argument("--calibration", type=Path, metavar="FILE", help="pixels to millimetres")
    parser.add_argument("--thickness-mm", type=float, metavar="H", help="height of the traced plane above the table")


@dataclass(frozen=True)
class Tracing:
    """A measurer, with the recipe and the thickness that it measures by."""

    measurer: Measurer
    recipe: AnyRecipe
    thickness_mm: float

    @classmethod
    def of(cls, args: argparse.Namespace) -> Tracing:
        """By the arguments of `add_tracing_arguments`; raise UserError."""
        import numpy as np

        from service.measuring.measure import Measurer

        config = None if _all_is_plain(args) else load_config_or_default(args.config)
        recipe = PlainRecipe() if config is None else _recipe(config, args)
        guard = guard_of(config, args)
        thickness_mm = thickness_of(args, recipe)
        if guard is None and args.thickness_mm is not None:
            print(
                f"combtrace {args.command}: --thickness-mm {thickness_mm:g} has no effect: without a calibration "
                "contours stay in pixels. Name one by --calibration or --config",
                file=sys.stderr,
            )
        work_area = np.array(config.work_area_mm, dtype=np.float64) if config and config.work_area_mm else None
        calibration = guard.record.calibration if guard else None
        measurer = Measurer(calibration, guard=guard, work_area_mm=work_area, table=table_of(config))
        return cls(measurer, recipe, thickness_mm)

    def traced(self, image: Path) -> tuple[Bytes, Measurement]:
        """The picture in the file, and what is measured in it; raise CameraError, ContourError."""
        from drivers.camera.files.decode import read_picture

        started = time.perf_counter()
        picture = read_picture(image)
        read_ms = (time.perf_counter() - started) * 1000
        measurement = self.measurer.measure(picture, self.recipe, self.thickness_mm)
        times = {"read": read_ms, **measurement.timings_ms}
        times["total"] = sum(value for name, value in times.items() if name != "total")
        return picture, replace(measurement, timings_ms=times)


def _all_is_plain(args: argparse.Namespace) -> bool:
    """True where no option asks for anything of a configuration, nor changes a recipe, which would have to be checked.

    What checks them takes longer to load than a picture to trace.
    """
    changing = ("config", "recipe", "roi_px", *_RECIPE_KEYS, *_PARAMETERS, *ENDINGS)
    return all(getattr(args, name, None) is None for name in changing)


def _recipe(config: Config, args: argparse.Namespace) -> Recipe:
    """The recipe, by name, number or default, with what the command line says otherwise."""
    from service.config.recipes import Recipe

    found = find_recipe(config, args.recipe)
    changes: dict[str, Any] = {name: getattr(args, name) for name in _RECIPE_KEYS if getattr(args, name) is not None}
    given = {name: getattr(args, name) for name in _PARAMETERS if getattr(args, name) is not None}
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


def table_of(config: Config | None) -> TableRecord | None:
    """The taught table of a configuration, None where it has none; raise UserError."""
    if config is None or config.table is None:
        return None
    from service.measuring.table_file import TableFileError, find_table

    try:
        return find_table(config.table.file)
    except TableFileError as error:
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
