"""A scenario of the simulated controller on disk: YAML, read with every mistake named."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError, model_validator

from drivers.controller.simulated.faults import FAULT_KINDS, TARGETS, FaultKind, LineFault, Target
from drivers.controller.simulated.scenario import EVENT_KINDS, KINDS_OF, EventKind, MachineSettings, Scenario
from drivers.controller.simulated.scenario import Event as MachineEvent
from service.config.config_file import SCHEMA_DIALECT, ConfigError, line_of, read_yaml, seen_instead_of_keys
from service.config.mistakes import describe
from service.config.values import Model

Word = Annotated[int, Field(ge=1, le=65_535)]
Seconds = Annotated[float, Field(ge=0, le=86_400)]
Scans = Annotated[int, Field(ge=0, le=10_000)]


class Machine(Model):
    """How the controller's program runs."""

    scan_ms: float = Field(10, gt=0, le=10_000, description="Period of the program's scan, ms.")
    clock: bool = Field(True, description="false: `clock` stays 0 for ever.")
    clock_start_ms: int = Field(0, ge=0, lt=2**32, description="`clock` at the start of the program, ms; it wraps.")
    first_trigger: Word = Field(1, description="The first trigger_counter of a session; after 65535 comes 1.")
    sessions: tuple[Word, ...] = Field((), description="Sessions of the starts, in turn; none = a retained counter.")
    copy_scans: Annotated[int, Field(ge=1, le=10_000)] = Field(1, description="Scans over which a page is copied.")
    check_scans: Scans = Field(0, description="Scans from the copy to the answer: late answers.")
    stepwise: bool = Field(False, description="true: the fields of an answer are written one a scan.")
    torn: bool = Field(
        False,
        description="true: `last_job`, `test_echo`, `clock` stand half written for a scan where both halves change.",
    )
    max_registers: int = Field(125, ge=16, le=125, description="Most registers in one request.")
    write_single: bool = Field(True, description="false: no FC6; `transfer` comes by an FC16 of one register.")
    answer_as: int | None = Field(
        None, ge=0, le=255, description="Any device id is answered, as from this one; none = only its own."
    )


class Event(Model):
    """Something that the machine does of its own accord."""

    do: EventKind = Field(description=" ".join(f"{kind}: {text}." for kind, text in EVENT_KINDS.items()))
    at_s: tuple[Seconds, ...] = Field((), description="When, s after the start.")
    every_s: Seconds = Field(0, description="Again and again, s, give or take a fifth; 0 = not.")
    for_s: Seconds = Field(1, description="How long, s.")
    burst: int = Field(1, ge=1, le=10_000, description="Triggers, one after the other.")
    recipe: int = Field(0, ge=0, le=65_535, description="Recipe of the trigger; 0 = the configured default.")
    thickness_mm: float = Field(0, ge=0, le=10_000, description="Thickness of the trigger, mm; 0 = the recipe's.")
    force: bool = Field(False, description="true: trigger though the protocol does not allow it now.")
    answer: Literal[4, 7] = Field(7, description="Answer of a refusal: 4 geometry refused, 7 operator refused.")
    count: int = Field(1, ge=1, le=1_000_000, description="Contours refused.")
    scan_ms: float = Field(100, gt=0, le=60_000, description="Period of slow scans, ms.")
    keep_registers: bool = Field(False, description="true: the registers outlive the restart.")
    keep_memory: bool = Field(True, description="false: last answer and session are forgotten.")

    @model_validator(mode="after")
    def _some_time(self) -> Event:
        if not self.at_s and not self.every_s:
            raise ValueError(f"{self.do} never happens, expected at_s or every_s")
        for key in sorted(self.model_fields_set & KINDS_OF.keys()):
            if self.do not in KINDS_OF[key]:
                raise ValueError(f"{key} is of do: {', '.join(KINDS_OF[key])}, seen with {self.do}")
        return self


class Fault(Model):
    """Something that befalls requests, or their replies."""

    fault: FaultKind = Field(description=" ".join(f"{kind}: {text}." for kind, text in FAULT_KINDS.items()))
    request: Target = Field("any", description=" ".join(f"{name}: {text}." for name, text in TARGETS.items()))
    chance: float = Field(0, ge=0, le=1, description="Chance of each such request.")
    every: int = Field(0, ge=0, le=1_000_000, description="Each n-th of them; 0 = not.")
    at: tuple[Annotated[int, Field(ge=1)], ...] = Field((), description="The n-th ones, counted from 1.")
    times: int = Field(0, ge=0, description="At most so often; 0 = no limit.")
    after_s: Seconds = Field(0, description="Only from so long after the start on, s.")
    before_s: Seconds = Field(0, description="Only until so long after the start, s; 0 = no end.")
    delay_s: Seconds = Field(0.2, description="How late, s.")
    code: Literal[1, 2, 3, 4, 5, 6, 8, 10, 11] = Field(4, description="Exception code.")

    @model_validator(mode="after")
    def _some_request(self) -> Fault:
        if not (self.chance or self.every or self.at):
            raise ValueError(f"{self.fault} strikes no request, expected chance, every or at")
        if "code" in self.model_fields_set and self.fault != "exception":
            raise ValueError(f"code is of fault: exception, seen with {self.fault}")
        if self.before_s and self.before_s <= self.after_s:
            raise ValueError(f"before_s is {self.before_s:g}, expected more than after_s, {self.after_s:g}")
        return self


class ScenarioFile(Model):
    """A machine, what it does, and what befalls the line."""

    seed: int = Field(0, ge=0, description="Of all that is random.")
    machine: Machine = Field(default_factory=Machine, description="How the controller's program runs.")
    events: tuple[Event, ...] = Field((), description="What the machine does of its own accord.")
    faults: tuple[Fault, ...] = Field((), description="What befalls requests; the first rule that strikes counts.")


def load_scenario(path: Path) -> Scenario:
    """The scenario of a file; raise ConfigError, a line for each mistake."""
    data = read_yaml(path, option="--scenario")
    if not isinstance(data, dict):
        raise ConfigError(f"{path}: {seen_instead_of_keys(data)}, expected keys such as machine, events, faults")
    try:
        found = ScenarioFile.model_validate(data)
    except ValidationError as error:
        told = describe(error, ScenarioFile, lambda where: line_of(path, where))
        raise ConfigError("\n".join(f"{path}: {line}" for line in told)) from error
    return Scenario(
        seed=found.seed,
        machine=MachineSettings(**found.machine.model_dump()),
        events=tuple(MachineEvent(**event.model_dump()) for event in found.events),
        faults=tuple(_rule(fault) for fault in found.faults),
    )


def _rule(fault: Fault) -> LineFault:
    values = fault.model_dump()
    return LineFault(kind=values.pop("fault"), **values)


def scenario_schema() -> dict[str, Any]:
    """The JSON schema of a scenario."""
    return {"$schema": SCHEMA_DIALECT, **ScenarioFile.model_json_schema(), "title": "combtrace scenario"}
