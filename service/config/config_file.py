"""config.yaml on disk: read with line numbers, every mistake named, relative paths counted from the file's folder."""

from __future__ import annotations

from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import ValidationError

from service.config.adopted_recipes import AdoptedError, with_adopted
from service.config.config import Config, Service
from service.config.mistakes import Location, describe
from service.config.plant import Broker
from service.config.recipes import Recipe
from service.config.yaml_mistakes import FileLoader, in_words, unreadable

LARGEST_FILE = 1_000_000
SAMPLES = Path(__file__).parents[1] / "samples"
PATH_KEYS = (
    ("table", "file"),
    ("camera", "path"),
    ("camera", "move_to"),
    ("calibration", "file"),
    ("service", "state_dir"),
    ("journal", "path"),
    ("archive", "path"),
    ("remnants", "path"),
    ("page", "token_file"),
    ("page", "people_file"),
    ("page", "certificate"),
    ("page", "key"),
    ("telemetry", "password_file"),
    ("opcua", "users_file"),
    ("opcua", "certificate"),
    ("opcua", "key"),
)
TLS_KEYS = ("ca_file", "cert_file", "key_file")
BrokerSettings = TypeVar("BrokerSettings", bound=Broker)
SCHEMA_DIALECT = "https://json-schema.org/draft/2020-12/schema"


class ConfigError(Exception):
    """The configuration cannot be used; one line for each mistake: where, what was seen, what is expected."""


def read_yaml(path: Path, option: str = "--config") -> Any:
    """What a YAML file holds; raise ConfigError that names file, line and column."""
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise ConfigError(f"{path}: {path.stat().st_size} bytes, expected {LARGEST_FILE} at most")
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        who = "run this as a user who may read it, or name" if isinstance(error, PermissionError) else "name"
        next_step = f"{who[0].upper()}{who[1:]} another file with {option}"
        raise ConfigError(f"{path}: cannot be read: {error.strerror}. {next_step}") from error
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path}: is no UTF-8 text (byte {error.start}). Save it as UTF-8") from error
    try:
        return yaml.load(text, Loader=FileLoader)
    except yaml.MarkedYAMLError as error:
        raise ConfigError(f"{path}: {in_words(error)}") from error
    except (yaml.YAMLError, RecursionError, ValueError, OverflowError) as error:
        raise ConfigError(f"{path}: {unreadable(error, text)}") from error


def line_of(path: Path, location: Location) -> int | None:
    """The line where a key or entry stands in a YAML file, or the nearest one around it; None where none is known."""
    try:
        node = yaml.compose(path.read_text(encoding="utf-8-sig"), Loader=FileLoader)
    except (OSError, UnicodeDecodeError, yaml.YAMLError):
        return None
    line = None
    for part in location:
        if isinstance(node, yaml.MappingNode):
            found = [(key, value) for key, value in node.value if key.value == str(part)]
            if not found:
                return line
            key, node = found[-1]
            line = key.start_mark.line + 1
        elif isinstance(node, yaml.SequenceNode) and isinstance(part, int) and part < len(node.value):
            node = node.value[part]
            line = node.start_mark.line + 1
        else:
            return line
    return line


def seen_instead_of_keys(data: Any) -> str:
    """What a file holds whose content is no mapping."""
    if data is None:
        return "is empty"
    return "holds a list" if isinstance(data, list) else f"holds {str(data)[:40]!r} and no keys"


def load_config(path: Path) -> Config:
    """The configuration of a file, with the recipes that were adopted; raise ConfigError."""
    data = read_yaml(path)
    if not isinstance(data, dict):
        raise ConfigError(f"{path}: {seen_instead_of_keys(data)}, expected keys such as camera: and controller:")
    try:
        config = Config.model_validate(data)
    except ValidationError as error:
        told = describe(error, Config, lambda where: line_of(path, where))
        raise ConfigError("\n".join(f"{path}: {line}" for line in told)) from error
    try:
        return with_adopted(_resolved(config, path.resolve().parent))
    except AdoptedError as error:
        raise ConfigError(str(error)) from error


def default_config() -> Config:
    """The embedded defaults: the shipped pictures with their calibration, and a controller on this machine."""
    return Config.model_validate(
        {
            "camera": {"kind": "files", "path": SAMPLES, "loop": True},
            "calibration": {"file": SAMPLES / "calibration.yaml"},
            "controller": {"kind": "modbus-tcp", "host": "127.0.0.1", "port": 5020},
        }
    )


def config_schema() -> dict[str, Any]:
    """The JSON schema of config.yaml."""
    return {"$schema": SCHEMA_DIALECT, **Config.model_json_schema(), "title": "combtrace configuration"}


def state_dir_of(path: Path) -> Path:
    """The state folder that a file names, also where the rest of it is bad; raise ConfigError where it is no YAML.

    A daemon that runs must stay within reach of a halt while somebody is still writing its next configuration.
    """
    try:
        return load_config(path).service.state_dir
    except ConfigError:
        data = read_yaml(path)
        service = data.get("service") if isinstance(data, dict) else None
        named = service.get("state_dir") if isinstance(service, dict) else None
        default = Service().state_dir
        return path.resolve().parent / (Path(named) if isinstance(named, str) else default)


def _resolved(config: Config, folder: Path) -> Config:
    """The same with relative paths counted from the file's folder."""
    updates: dict[str, Any] = {}
    for section, key in PATH_KEYS:
        model = updates.get(section, getattr(config, section))
        value = getattr(model, key, None)
        if value is not None:
            updates[section] = model.model_copy(update={key: folder / value})
    if config.telemetry is not None:
        updates["telemetry"] = with_tls_files(updates.get("telemetry", config.telemetry), folder)
    if config.adopted_recipes is not None:
        updates["adopted_recipes"] = folder / config.adopted_recipes
    updates["recipes"] = tuple(_resolved_recipe(recipe, folder) for recipe in config.recipes)
    return config.model_copy(update=updates)


def with_tls_files(broker: BrokerSettings, folder: Path) -> BrokerSettings:
    """The same with the paths of its TLS files counted from the folder."""
    if broker.tls is None:
        return broker
    paths = {key: folder / path for key in TLS_KEYS if (path := getattr(broker.tls, key)) is not None}
    return broker.model_copy(update={"tls": broker.tls.model_copy(update=paths)})


def _resolved_recipe(recipe: Recipe, folder: Path) -> Recipe:
    updates: dict[str, Any] = {}
    if recipe.gcode.template is not None:
        updates["gcode"] = recipe.gcode.model_copy(update={"template": folder / recipe.gcode.template})
    if recipe.part is not None:
        updates["part"] = recipe.part.model_copy(update={"file": folder / recipe.part.file})
    if recipe.parts:
        updates["parts"] = tuple(part.model_copy(update={"file": folder / part.file}) for part in recipe.parts)
    return recipe.model_copy(update=updates) if updates else recipe
