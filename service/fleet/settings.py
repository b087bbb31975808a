"""fleet.yaml: the broker, the page, and what is kept."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Literal, Self

from pydantic import Field, ValidationError, field_validator, model_validator

from service.config.config_file import ConfigError, line_of, read_yaml, seen_instead_of_keys, with_tls_files
from service.config.mistakes import describe
from service.config.plant import Broker, TopicName
from service.config.values import FilePath, Host, Model, Port

_TIME_OF_DAY = re.compile("([01][0-9]|2[0-3]):[0-5][0-9]")


class FleetPage(Model):
    """The page and its REST interface over HTTP."""

    host: Host = Field("127.0.0.1", description="Address to listen on; anything but loopback is open to the network.")
    port: Port = Field(9780, description="TCP port.")
    names: tuple[str, ...] = Field((), description="Host names by which browsers may call it, besides its address.")
    language: Literal["auto", "en", "ru"] = Field("auto", description="auto = as the browser asks, else English.")
    certificate: FilePath | None = Field(None, description="TLS certificate chain, PEM; none = plain HTTP.")
    key: FilePath | None = Field(None, description="Private key of the certificate, PEM.")

    @model_validator(mode="after")
    def _certificate_with_key(self) -> Self:
        if (self.certificate is None) != (self.key is None):
            raise ValueError("certificate and key: only one of them is given, expected both or none")
        return self


class Fleet(Model):
    """Everything that fleet.yaml says; needs the extras combtrace[mqtt,page]."""

    broker: Broker = Field(default_factory=Broker, description="Where cells tell what they do.")
    groups: tuple[TopicName, ...] = Field((), description="Groups of cells that are shown; none given = all.")
    host_id: TopicName = Field(
        "combtrace-fleet", description="Its name as a host application, for `telemetry.primary_host` of cells."
    )
    page: FleetPage = Field(default_factory=FleetPage, description="The page.")
    store: FilePath = Field(Path("fleet.sqlite"), description="SQLite file of what was told; it may be thrown away.")
    keep_days: float = Field(90, ge=9, le=3660, description="How long figures of jobs are kept, days.")
    shifts: tuple[str, ...] = Field(("06:00", "14:00", "22:00"), description="When shifts begin, HH:MM, local time.")
    drift_percent: float = Field(
        20, gt=0, le=1000, description="By how much a day's mean may be worse than the week's before, %."
    )
    calibration_days: float = Field(365, gt=0, le=36_500, description="Older calibrations are pointed out, days.")

    @field_validator("shifts")
    @classmethod
    def _times_of_day(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        for text in value:
            if not _TIME_OF_DAY.fullmatch(text):  # ISO's own forms may name a zone: none of local time
                raise ValueError(f"{text!r} is no time of day, expected HH:MM in quotes")
        if not value:
            raise ValueError("is empty, expected one time of day or more")
        return value


def load_fleet(path: Path) -> Fleet:
    """The settings of a file, relative paths counted from its folder; raise ConfigError."""
    data = read_yaml(path)
    if not isinstance(data, dict):
        raise ConfigError(f"{path}: {seen_instead_of_keys(data)}, expected keys such as broker: and page:")
    try:
        fleet = Fleet.model_validate(data)
    except ValidationError as error:
        told = describe(error, Fleet, lambda where: line_of(path, where))
        raise ConfigError("\n".join(f"{path}: {line}" for line in told)) from error
    folder = path.resolve().parent
    broker, page = with_tls_files(fleet.broker, folder), fleet.page
    if broker.password_file is not None:
        broker = broker.model_copy(update={"password_file": folder / broker.password_file})
    if page.certificate is not None and page.key is not None:
        page = page.model_copy(update={"certificate": folder / page.certificate, "key": folder / page.key})
    return fleet.model_copy(update={"broker": broker, "page": page, "store": folder / fleet.store})
