"""What commands that measure pictures share: configuration, recipe, calibration with its limits, the trend."""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from service.cli.errors import UserError

if TYPE_CHECKING:
    from service.config.config import Config
    from service.config.recipes import AnyRecipe, Recipe
    from service.measuring.calibration_guard import CalibrationGuard
    from service.measuring.measure import Measurer
    from service.measuring.trend_file import TrendLine


PLOT_SUFFIX = ".svg"


def load_config_or_default(path: Path | None) -> Config:
    """The configuration of a file, or the embedded defaults; raise UserError."""
    from service.config.config_file import ConfigError, default_config, load_config

    try:
        return default_config() if path is None else load_config(path)
    except ConfigError as error:
        raise UserError(str(error)) from error


def guard_of(config: Config | None, args: argparse.Namespace) -> CalibrationGuard | None:
    """The calibration that the command line or a given configuration names, with its limits; None where none is."""
    settings = config.calibration if config is not None and args.config is not None else None
    path = args.calibration or (settings.file if settings is not None else None)
    if path is None:
        return None
    from service.measuring.calibration_file import CalibrationFileError, load_record
    from service.measuring.calibration_guard import CalibrationGuard, GuardLimits

    limits = GuardLimits()
    if settings is not None:
        limits = GuardLimits(settings.max_age_days, settings.sentinel_tolerance_px, settings.sentinels_required)
    try:
        return CalibrationGuard(load_record(path), limits)
    except CalibrationFileError as error:
        raise UserError(str(error)) from error


def find_recipe(config: Config, wanted: str | None) -> Recipe:
    """The recipe by name or number, or the default one; raise UserError."""
    name = str(config.default_recipe) if wanted is None else wanted
    found = next((recipe for recipe in config.recipes if name in (recipe.name, str(recipe.number))), None)
    if found is None:
        known = ", ".join(f"{recipe.name} ({recipe.number})" for recipe in config.recipes)
        raise UserError(f"--recipe {name}: there is no such recipe, there are: {known}")
    return found


def thickness_of(args: argparse.Namespace, recipe: AnyRecipe) -> float:
    """The thickness by --thickness-mm, or else the recipe's; raise UserError."""
    if args.thickness_mm is None:
        return recipe.thickness_mm
    if not 0 <= args.thickness_mm <= 10_000:
        raise UserError(f"--thickness-mm {args.thickness_mm:g}: expected 0 to 10000")
    return float(args.thickness_mm)


def add_measuring_arguments(parser: argparse.ArgumentParser) -> None:
    """Configuration, recipe, calibration, thickness, limit and trend."""
    parser.add_argument("--config", type=Path, metavar="FILE", help="configuration with recipes and calibration")
    parser.add_argument("--recipe", metavar="NAME", help="recipe by name or number")
    parser.add_argument("--calibration", type=Path, metavar="FILE", help="pixels to millimetres")
    parser.add_argument("--thickness-mm", type=float, metavar="H", help="height of the traced plane above the table")
    parser.add_argument("--tolerance-mm", type=float, default=0.3, metavar="MM", help="limit of a pass; default 0.3")
    parser.add_argument(
        "--trend", type=Path, metavar="FILE", help="CSV that gets a line a check; its plot beside it, .svg"
    )


@dataclass(frozen=True)
class Measuring:
    """A measurer in millimetres, with what it measures by."""

    config: Config
    measurer: Measurer
    recipe: Recipe
    thickness_mm: float
    calibration_hash: str

    @classmethod
    def of(cls, args: argparse.Namespace) -> Measuring:
        """By the arguments of `add_measuring_arguments`; raise UserError, also where there is no calibration."""
        from service.measuring.measure import Measurer

        if not 0 < args.tolerance_mm < 1e4:
            raise UserError(f"--tolerance-mm {args.tolerance_mm:g}: expected a number above 0")
        if args.trend is not None and args.trend.suffix == PLOT_SUFFIX:
            raise UserError(f"--trend {args.trend}: its plot would overwrite it. End it in .csv")
        config = load_config_or_default(args.config)
        recipe = find_recipe(config, args.recipe)
        guard = guard_of(config, args)
        if guard is None:
            raise UserError("deviations are in millimetres: name the calibration by --calibration or --config")
        measurer = Measurer(guard.record.calibration, guard=guard)
        return cls(config, measurer, recipe, thickness_of(args, recipe), guard.record.digest[:15])


def note_check(args: argparse.Namespace, config: Config, line: TrendLine) -> None:
    """Keep a check in the journal that a given configuration names, and in the trend file; raise UserError."""
    from service.trends.kept import NotKept, keep_check

    if args.config is not None:
        try:
            keep_check(config.journal.path, line)
        except NotKept as error:
            print(f"journal   the check is not kept: {error}", file=sys.stderr)
    note_trend(args.trend, line)


def note_trend(path: Path | None, line: TrendLine) -> None:
    """Add a line to the trend file, tell how it compares with the last, and draw them all; raise UserError."""
    from service.atomic_file import write_whole
    from service.measuring.trend_file import TrendFileError, append_trend, read_trend
    from service.measuring.trend_plot import trend_svg

    if path is None:
        return
    try:
        trend = read_trend(path)
        append_trend(path, line)
    except TrendFileError as error:
        raise UserError(str(error)) from error
    for text in trend.skipped:
        print(f"trend     {text}", file=sys.stderr)
    before = trend.last(line.check)
    last = "first line" if before is None else f"worst {line.worst_mm:.3f} mm, last time {before.worst_mm:.3f} mm"
    print(f"trend     {path}: {last}")
    if not path.is_file():  # a device or pipe has no picture beside it
        return
    plot = path.with_suffix(PLOT_SUFFIX)
    try:
        write_whole(plot, trend_svg([*trend.lines, line]).encode())
    except OSError as error:
        print(f"trend     {plot}: cannot be written: {error.strerror}; the line is in {path}", file=sys.stderr)
    else:
        print(f"plot      {plot}")
