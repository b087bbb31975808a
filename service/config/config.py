"""config.yaml as a whole: its sections, what each of those says that has no file of its own, and what binds them.

Unknown keys are refused everywhere. Paths are resolved by `service.config.config_file`.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal, Self

from pydantic import Field, PrivateAttr, field_validator, model_validator

from contour.geometry.rings import ring_defect
from service.config.cameras import Camera
from service.config.controllers import Controller, ModbusRtu, NoController
from service.config.plant import Telemetry
from service.config.recipes import Recipe
from service.config.triggers import ControllerTrigger, SerialTrigger, Trigger
from service.config.values import FilePath, Host, MistakeAt, Model, Point, Port


class Calibration(Model):
    """Where pixels become millimetres."""

    file: FilePath = Field(description="Calibration file.")
    max_age_days: float = Field(0, ge=0, le=36_500, description="Oldest accepted calibration, days; 0 = no limit.")
    sentinel_tolerance_px: float = Field(
        1.0, ge=0.05, le=1000, description="How far a fixed mark may lie from where the calibration saw it, px."
    )
    sentinels_required: bool = Field(
        True, description="Refuse where the calibration has fixed marks and none of them is seen."
    )


class Table(Model):
    """The empty table as `combtrace teach-table` stores it."""

    file: FilePath = Field(description="File of the taught table; used where it is there.")


class Service(Model):
    """Where the service keeps its state, and how it queues."""

    state_dir: FilePath = Field(Path("var"), description="Folder of the lock and other state.")
    queue_depth: int = Field(
        0, ge=0, le=100, description="Triggers that may wait while a job is executed; 0 = they are refused as busy."
    )


class JournalSettings(Model):
    """Where jobs are kept."""

    path: FilePath = Field(Path("var/journal.sqlite"), description="SQLite file.")
    max_jobs: int = Field(500_000, ge=1000, le=10**9, description="Most jobs kept; the oldest are let go.")
    min_free_bytes: int = Field(
        50_000_000,
        ge=0,
        le=10**15,
        description="Free bytes of the journal's disk below which no trigger is taken (160 storage_full); 0 = none.",
    )


class ArchiveSettings(Model):
    """Where evidence of jobs is kept: frame, overlay, and a document with all that a replay needs."""

    path: FilePath = Field(Path("var/archive"), description="Folder.")
    max_bytes: int = Field(
        2_000_000_000, ge=0, le=10**15, description="Most bytes kept, the oldest are let go; 0 = nothing is kept."
    )
    min_free_bytes: int = Field(
        500_000_000,
        ge=0,
        le=10**15,
        description="Free bytes of the archive's disk that evidence leaves, whatever that costs it.",
    )


class RemnantsSettings(Model):
    """The list of what is left of blocks whose parts were accepted; needs the archive and combtrace[export]."""

    path: FilePath = Field(Path("var/remnants.sqlite"), description="The list's file (SQLite).")
    kerf_mm: float = Field(2, ge=0, le=1000, description="What cutting takes away around each part, mm.")
    min_area_mm2: float = Field(2500, ge=1, le=4e9, description="Smallest piece that is kept, mm².")
    min_width_mm: float = Field(10, ge=0, le=1000, description="What is narrower is cut off the pieces, mm.")


class Metrics(Model):
    """Figures for Prometheus over HTTP; needs the extra combtrace[metrics]."""

    host: Host = Field("127.0.0.1", description="Address to listen on; anything but loopback is open to the network.")
    port: Port = Field(9771, description="TCP port.")


def _certificate_with_key(found: Any) -> Any:
    if (found.certificate is None) != (found.key is None):
        raise ValueError("certificate and key: only one of them is given, expected both or none")
    return found


class Page(Model):
    """The operator's page and its REST interface over HTTP; needs the extra combtrace[page]."""

    host: Host = Field("127.0.0.1", description="Address to listen on; anything but loopback is open to the network.")
    port: Port = Field(9770, description="TCP port.")
    names: tuple[str, ...] = Field(
        (), description="Host names by which browsers may call it, besides its own address and localhost."
    )
    token_file: FilePath | None = Field(
        None, description="File of mode 0600, a line 'name token' a person; none = the page can only be looked at."
    )
    people_file: FilePath | None = Field(
        None,
        description="File of mode 0600, a line of `combtrace pin NAME` a person, who give orders by a short PIN, one "
        "person at a time; none = by tokens alone.",
    )
    language: Literal["auto", "en", "ru"] = Field(
        "auto", description="What the page speaks until a person chooses; auto = as the browser asks, else English."
    )
    certificate: FilePath | None = Field(None, description="TLS certificate chain, PEM; none = plain HTTP.")
    key: FilePath | None = Field(None, description="Private key of the certificate, PEM.")

    _with_key = model_validator(mode="after")(_certificate_with_key)


class Opcua(Model):
    """An OPC UA server by OPC 40100-1 (Machine Vision), signed and encrypted; needs the extra combtrace[opcua]."""

    host: Host = Field("127.0.0.1", description="Address to listen on; anything but loopback is open to the network.")
    port: Port = Field(4840, description="TCP port.")
    users_file: FilePath | None = Field(
        None,
        description="File of mode 0600, a line 'name password' a user, who may halt and reset; none = nobody may, and "
        "clients with a trusted certificate read.",
    )
    certificate: FilePath | None = Field(
        None, description="The server's certificate, PEM; none = made at the first start in opcua/ of the state folder."
    )
    key: FilePath | None = Field(None, description="Private key of the certificate, PEM, mode 0600.")

    _with_key = model_validator(mode="after")(_certificate_with_key)


class Log(Model):
    """The log on standard error."""

    format: Literal["text", "json"] = Field("text", description="json: one object a line, with fields.")
    level: Literal["debug", "info", "warning", "error"] = Field("info", description="Least level that is written.")


def _repeated(values: list[Any]) -> Iterator[tuple[int, Any]]:
    """Index and value of each that stood before already; None counts as none."""
    return ((k, value) for k, value in enumerate(values) if value is not None and value in values[:k])


class Config(Model):
    """Everything that config.yaml says."""

    camera: Camera = Field(description="Where frames come from.")
    calibration: Calibration | None = Field(None, description="Pixels to millimetres; needed where a controller is.")
    controller: Controller = Field(description="The cutting machine's controller.")
    triggers: tuple[Trigger, ...] = Field((), description="What begins a job.")
    default_recipe: int = Field(1, ge=1, le=65_535, description="Recipe of a trigger that names none.")
    recipes: tuple[Recipe, ...] = Field((Recipe(number=1, name="default"),), description="Block types.")
    adopted_recipes: FilePath | None = Field(
        None,
        description="File that the service writes, of recipes that were adopted on the page: each goes before the one "
        "of its number here, until that one is changed; none = none can be adopted.",
    )
    work_area_mm: tuple[Point, ...] = Field((), description="Polygon in the machine frame, mm; empty = not checked.")
    table: Table | None = Field(None, description="The taught table; none = blocks are told from any table.")
    service: Service = Field(default_factory=Service, description="The service itself.")
    journal: JournalSettings = Field(default_factory=JournalSettings, description="The durable list of jobs.")
    archive: ArchiveSettings = Field(default_factory=ArchiveSettings, description="Where evidence is kept.")
    remnants: RemnantsSettings | None = Field(None, description="What is left of blocks; none = it is not kept.")
    metrics: Metrics | None = Field(None, description="Figures for Prometheus; none = not served.")
    page: Page | None = Field(None, description="The operator's page; none = not served.")
    telemetry: Telemetry | None = Field(None, description="What a plant's broker is told; none = nothing.")
    opcua: Opcua | None = Field(None, description="An OPC UA server; none = not served.")
    log: Log = Field(default_factory=Log, description="The log.")

    _written: dict[int, Recipe] = PrivateAttr(default_factory=dict)

    def recipe(self, number: int) -> Recipe:
        """The recipe of a number; raise KeyError."""
        return {recipe.number: recipe for recipe in self.recipes}[number]

    def as_written(self, number: int) -> Recipe:
        """The recipe as the file has it, also where another one was put in its place; raise KeyError."""
        return self._written.get(number) or self.recipe(number)

    def with_recipe(self, recipe: Recipe) -> Self:
        """The same with this recipe in the place of the one of its number; raise KeyError, ValidationError."""
        written = {**self._written, recipe.number: self.as_written(recipe.number)}
        recipes = tuple(recipe if one.number == recipe.number else one for one in self.recipes)
        fresh = type(self).model_validate({**dict(self), "recipes": recipes})
        fresh._written = written
        return fresh

    @model_validator(mode="after")
    def _there_is_a_recipe(self) -> Self:
        if not self.recipes:
            raise ValueError("recipes is empty, expected one or more")
        return self

    @model_validator(mode="after")
    def _each_recipe_has_its_own_number_and_name(self) -> Self:
        for name in ("number", "name"):
            for k, value in _repeated([getattr(recipe, name) for recipe in self.recipes]):
                raise MistakeAt(("recipes", k, name), f"{value} is there more than once. Give each recipe its own")
        return self

    @model_validator(mode="after")
    def _remnants_have_an_archive(self) -> Self:
        if self.remnants is not None and not self.archive.max_bytes:
            raise ValueError("remnants are kept from the archive's evidence, but archive.max_bytes is 0. Set it")
        return self

    @model_validator(mode="after")
    def _the_default_recipe_is_there(self) -> Self:
        if self.default_recipe not in {recipe.number for recipe in self.recipes}:
            numbers = ", ".join(str(recipe.number) for recipe in self.recipes)
            raise ValueError(f"default_recipe is {self.default_recipe}, but recipes have only the numbers {numbers}")
        return self

    @model_validator(mode="after")
    def _recipes_that_need_millimetres_have_a_calibration(self) -> Self:
        needs = next((recipe.needs_millimetres for recipe in self.recipes if recipe.needs_millimetres), None)
        if self.calibration is None and needs:
            raise ValueError(f"calibration is missing: a recipe's {needs} needs millimetres. Set calibration.file")
        return self

    @model_validator(mode="after")
    def _a_controller_has_a_calibration(self) -> Self:
        if self.calibration is None and not isinstance(self.controller, NoController):
            raise ValueError("calibration is missing: a controller needs millimetres. Set calibration.file")
        return self

    @model_validator(mode="after")
    def _a_controller_that_triggers_can_answer(self) -> Self:
        asks = any(isinstance(trigger, ControllerTrigger) for trigger in self.triggers)
        if asks and (isinstance(self.controller, NoController) or self.controller.handshake == "none"):
            raise ValueError("triggers: kind controller needs a controller with handshake full")
        return self

    @model_validator(mode="after")
    def _the_controller_triggers_once(self) -> Self:
        for k, kind in _repeated([trigger.kind for trigger in self.triggers]):
            if kind == "controller":
                raise MistakeAt(("triggers", k), "kind controller is there more than once. Take one out")
        return self

    @model_validator(mode="after")
    def _each_serial_port_serves_one(self) -> Self:
        ports = [self.controller.port if isinstance(self.controller, ModbusRtu) else None]
        ports += [trigger.port if isinstance(trigger, SerialTrigger) else None for trigger in self.triggers]
        for k, port in _repeated(ports):
            raise MistakeAt(("triggers", k - 1, "port"), f"{port} is named more than once. A serial port serves one")
        return self

    @model_validator(mode="after")
    def _each_listener_has_a_port(self) -> Self:
        names = [name for name in ("page", "metrics", "opcua") if getattr(self, name) is not None]
        ports = [getattr(self, name).port for name in names]
        for k, port in _repeated(ports):
            first = names[ports.index(port)]
            raise ValueError(f"{first}.port and {names[k]}.port are both {port}. Give each its own")
        return self

    @field_validator("work_area_mm")
    @classmethod
    def _polygon(cls, value: tuple[Point, ...]) -> tuple[Point, ...]:
        if not value:
            return value
        import numpy as np

        if len(value) < 3:
            raise ValueError(f"has {len(value)} points, expected 3 or more, or none")
        defect = ring_defect(np.array(value, dtype=np.float64))
        if defect:
            raise ValueError(f"is no simple polygon: {defect}")
        return value
