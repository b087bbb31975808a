"""The files of a configuration: calibration, recipes, templates of exports, table."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from contour.calibration.calibration import Calibration
from contour.errors import CalibrationError
from contour.geometry.rings import bounding_box
from service.check_result import CheckResult, fault, ok, warning
from service.commissioning.checkup.opcua import check_opcua
from service.commissioning.checkup.page import check_page
from service.config.adopted_recipes import load_adopted
from service.config.config import Config
from service.config.recipes import Gcode
from service.export.recipe_exports import trial
from service.measuring.calibration_guard import CalibrationGuard
from service.measuring.measure import step_doubt
from service.measuring.part_trial import PartTrial
from service.parts.part import PartFileError
from service.wiring.errors import WiringError
from service.wiring.plan import find_guard, find_table

_SOON = 0.9
"""Share of a calibration's allowed age from which on it is a warning."""


def summary(config: Config) -> str:
    """What a sound configuration holds, in a few words."""
    recipes, triggers = len(config.recipes), len(config.triggers)
    text = f"{recipes} recipe{'s' * (recipes != 1)}, {triggers or 'no'} trigger{'s' * (triggers != 1)}"
    return text if triggers else f"{text}: jobs begin by hand only"


def check_files(config: Config) -> Iterator[CheckResult]:
    """Calibration, sizes of methods, exports, table, and what page and OPC UA need."""
    yield from check_calibration(config)
    yield from _sizes(config)
    yield from _exports(config)
    yield from _parts(config)
    if config.adopted_recipes is not None:
        yield from _adopted(config, config.adopted_recipes)
    if config.table is not None:
        yield _table(config)
    if config.page is not None:
        yield from check_page(config.page)
    if config.opcua is not None:
        yield from check_opcua(config.opcua, config.service.state_dir)


def check_calibration(config: Config) -> Iterator[CheckResult]:
    """The calibration's file, its age, and whether it knows the scale at the recipes' thickness."""
    guard, trouble = find_guard(config)
    if trouble is not None:
        yield fault("calibration", trouble.text)
        return
    if guard is None:
        yield ok("calibration", "none: contours stay in pixels")
        return
    expired = guard.expired()
    yield fault("calibration", expired[1]) if expired else ok("calibration", _told(config, guard))
    allowed, age = guard.limits.max_age_days, guard.age_days
    if not expired and allowed and age is not None and age > _SOON * allowed:
        next_step = "Calibrate again: docs/how-to/calibrating.md"
        yield warning("calibration", f"it expires in {allowed - age:.1f} days", next_step)
    calibration = guard.record.calibration
    blind = [recipe.name for recipe in config.recipes if not calibration.height_known(recipe.thickness_mm)]
    if blind:
        yield warning(
            "calibration",
            f"its scale is not known at the thickness of {', '.join(blind)}",
            "Use the camera form (`combtrace calibrate` with pictures of a board), or the height it was made at",
        )
    yield from _work_area(config, calibration)


def _work_area(config: Config, calibration: Calibration) -> Iterator[CheckResult]:
    """A warning where the work area reaches beyond what the calibration covers: blocks there would be refused."""
    sure = calibration.uncertainty
    if not config.work_area_mm or sure is None:
        return
    corners = np.array(config.work_area_mm, dtype=np.float64)
    heights = sorted({0.0, *(recipe.thickness_mm for recipe in config.recipes)})
    try:
        outside = [
            f"({corner[0]:g}, {corner[1]:g}) mm"
            for corner in corners
            if any(len(sure.uncovered(calibration.to_pixels(corner[None, :], height))) for height in heights)
        ]
    except CalibrationError as error:
        yield warning("calibration", f"work_area_mm is not in view: {error}", "Check work_area_mm and the alignment")
        return
    if outside:
        yield warning(
            "calibration",
            f"of work_area_mm {', '.join(outside)} {'lies' if len(outside) == 1 else 'lie'} where it is not covered",
            "A block there is refused (115): calibrate with views that reach there, or make the work area smaller",
        )


def _told(config: Config, guard: CalibrationGuard) -> str:
    calibration = guard.record.calibration
    age = "age not stated" if guard.age_days is None else f"{guard.age_days:.1f} days old"
    aligned = "aligned to the machine" if calibration.aligned else "not aligned: machine frame = work frame"
    sure = calibration.uncertainty
    heights = sorted({0.0, *(recipe.thickness_mm for recipe in config.recipes)})
    told = ", ".join(f"{sure.figure_mm(height):.3f} at {height:g} mm" for height in heights) if sure else "not stated"
    text = (
        f"for pictures of {calibration.image_width} x {calibration.image_height} px, {age}, {aligned}; "
        f"95 % of positions within, mm: {told}"
    )
    marks = guard.record.sentinels
    return text if marks is None else f"{text}; {len(marks.marks)} fixed marks"


def _sizes(config: Config) -> Iterator[CheckResult]:
    for recipe in config.recipes:
        doubt = step_doubt(recipe)
        if doubt:
            yield warning("recipes", f"recipe {recipe.number}: {doubt}")


def _parts(config: Config) -> Iterator[CheckResult]:
    for recipe in config.recipes:
        for asked in recipe.asked_parts:
            try:
                part = PartTrial().part_of(asked)
            except PartFileError as error:
                yield fault("parts", f"recipe {recipe.number}: {error}")
                continue
            box, holes = bounding_box(part.contour.exterior), len(part.contour.holes)
            size = f"{box.width:.1f} x {box.height:.1f} mm, {holes} hole{'s' * (holes != 1)}, drawn in {part.unit}"
            yield ok("parts", f"recipe {recipe.number}: {part.path.name}, {size}")


def _exports(config: Config) -> Iterator[CheckResult]:
    asked = [recipe for recipe in config.recipes if recipe.exports or recipe.gcode != Gcode()]
    found = [fault("exports", f"recipe {recipe.number}: {text}") for recipe in asked for text in trial(recipe)]
    yield from found
    if asked and not found:
        forms = ", ".join(sorted({form for recipe in asked for form in recipe.exports})) or "gcode on demand"
        yield ok("exports", f"of a plain square: {forms}")


def _adopted(config: Config, path: Path) -> Iterator[CheckResult]:
    """Which recipes are not those of the configuration file, and which of them were superseded there."""
    numbers = {recipe.number for recipe in config.recipes}
    for number, history in load_adopted(path).recipes.items():
        last = history.adoptions[-1]
        told = f"recipe {number}: adopted by {last.who} at {last.at}: {last.note}"
        if number in numbers and history.holds(config.as_written(number)):
            yield ok("adopted", told)
        else:
            what = "was changed" if number in numbers else "is no longer there"
            next_step = "Nothing, if that is meant; else put it back there, or adopt it on the page again"
            yield warning("adopted", f"{told}. The configuration's own {what} since, and goes before", next_step)


def _table(config: Config) -> CheckResult:
    assert config.table is not None
    try:
        found = find_table(config)
    except WiringError as error:
        return fault("table", str(error))
    if found is None:
        next_step = "Teach it with `combtrace teach-table`, or take `table` out"
        return warning("table", f"{config.table.file}: not there, so blocks are told from any table", next_step)
    return ok("table", f"{config.table.file}: taught" + (f" with camera {found.camera}" if found.camera else ""))
