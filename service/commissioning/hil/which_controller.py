"""The controller that a suite is run on: of a URL, of a configuration, or a simulated one."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from urllib.parse import parse_qsl, urlsplit

from pydantic import ValidationError

from drivers.controller import Controller
from drivers.controller.mailbox.layout import MailboxLayout
from service.commissioning.hil.presence import HilError
from service.config.config import Config
from service.config.config_file import ConfigError, load_config
from service.config.mistakes import describe
from service.wiring.devices import make_controller

KINDS = {"tcp": "modbus-tcp", "rtu-over-tcp": "modbus-rtu-over-tcp", "rtu": "modbus-rtu"}


def over_tcp(port: int, layout: MailboxLayout) -> Controller:
    """The simulated controller on a port of this machine."""
    controller = make_controller(
        _config({"kind": "modbus-tcp", "port": port, "word_order": layout.word_order}, "the simulated controller")
    )
    assert controller is not None
    return controller


def config_of(url: str) -> Config:
    """A configuration with the controller of a URL; raise HilError."""
    parts = urlsplit(url)
    if parts.scheme not in KINDS:
        raise HilError(f"{url}: expected tcp://HOST:PORT, rtu-over-tcp://HOST:PORT or rtu:///dev/PORT")
    values: dict[str, Any] = {key: int(value) if value.isdigit() else value for key, value in parse_qsl(parts.query)}
    values["kind"] = KINDS[parts.scheme]
    if parts.scheme == "rtu":
        values["port"] = parts.path
    else:
        try:
            values |= {"host": parts.hostname or "", **({} if parts.port is None else {"port": parts.port})}
        except ValueError as error:
            raise HilError(f"{url}: {error}. Expected {parts.scheme}://HOST:PORT") from error
    return _config(values, url)


def _config(controller: dict[str, Any], where: str) -> Config:
    devices = {"camera": {"kind": "files", "path": "."}, "calibration": {"file": "none.yaml"}}  # none is opened
    data = {**devices, "controller": controller}
    try:
        return Config.model_validate(data)
    except ValidationError as error:
        raise HilError("; ".join(f"{where}: {line}" for line in describe(error, Config))) from error


def loaded(path: Path) -> Config:
    """The configuration of a file; raise HilError."""
    try:
        return load_config(path)
    except ConfigError as error:
        raise HilError(str(error)) from error
