"""What jobs are measured by: calibration, recipes, the taught table, the work area."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from service.config.config import Config
from service.config.controllers import NoController
from service.daemon.reload import BadPlan
from service.jobs.cycle_terms import Plan
from service.jobs.health import Fault
from service.measuring import table_file
from service.measuring.calibration_file import CalibrationChanged, CalibrationFileError, load_record
from service.measuring.calibration_guard import CalibrationGuard, GuardLimits
from service.measuring.measure import Measurer
from service.measuring.table_file import TableFileError, TableRecord
from service.parts.part import PartFileError
from service.reasons import Reason
from service.wiring.errors import WiringError


def make_plan(config: Config) -> tuple[Plan, Fault | None]:
    """What jobs are measured by, and the fault of the calibration; raise WiringError."""
    guard, fault = find_guard(config)
    measurer = Measurer(
        guard.record.calibration if guard else None,
        guard=guard,
        work_area_mm=work_area(config),
        table=find_table(config),
    )
    read_parts(measurer, config)
    return plan_of(measurer, config), fault


def plan_of(measurer: Measurer, config: Config) -> Plan:
    return Plan(measurer, {recipe.number: recipe for recipe in config.recipes}, config.default_recipe)


def sound_plan(config: Config) -> Plan:
    """What jobs are measured by; raise BadPlan where the calibration or the table cannot be used."""
    try:
        plan, fault = make_plan(config)
    except WiringError as error:
        raise BadPlan(str(error)) from error
    if fault is not None:
        raise BadPlan(fault.text)
    return plan


def find_guard(config: Config) -> tuple[CalibrationGuard | None, Fault | None]:
    """The calibration with its limits, and the fault where a controller waits for millimetres that cannot be had."""
    if config.calibration is None:
        fault = Fault(Reason.CALIBRATION_MISSING, "no calibration file is configured. Set calibration.file")
        return None, None if isinstance(config.controller, NoController) else fault
    settings = config.calibration
    limits = GuardLimits(settings.max_age_days, settings.sentinel_tolerance_px, settings.sentinels_required)
    try:
        return CalibrationGuard(load_record(settings.file), limits), None
    except CalibrationChanged as error:
        return None, Fault(Reason.CALIBRATION_MISMATCH, str(error))
    except CalibrationFileError as error:
        return None, Fault(Reason.CALIBRATION_MISSING, str(error))


def find_table(config: Config) -> TableRecord | None:
    """The taught table, where there is one; raise WiringError where its file cannot be used."""
    try:
        return None if config.table is None else table_file.find_table(config.table.file)
    except TableFileError as error:
        raise WiringError(str(error)) from error


def read_parts(measurer: Measurer, config: Config) -> None:
    """Have the measurer read the parts of all recipes; raise WiringError where one cannot be used."""
    for recipe in config.recipes:
        for asked in recipe.asked_parts:
            try:
                measurer.parts.part_of(asked)
            except PartFileError as error:
                raise WiringError(f"recipe {recipe.number}: part: {error}") from error


def work_area(config: Config) -> NDArray[np.float64] | None:
    """The machine's work area, None where it is not checked."""
    return np.array(config.work_area_mm, dtype=np.float64) if config.work_area_mm else None
