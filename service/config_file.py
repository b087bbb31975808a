"""config.yaml on disk: read with line numbers, every mistake named, relative paths counted from the file's folder."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml
from pydantic import ValidationError

from service.config import Config, Recipe, Service
from service.config_mistakes import Location, describe

LARGEST_FILE = 1_000_000
SAMPLES = Path(__file__).parent / "samples"
PATH_KEYS = (
    ("table", "file"),
    ("camera", "path"),
    ("camera", "move_to"),
    ("calibration", "file"),
    ("service", "state_dir"),
    ("journal", "path"),
    ("archive", "path"),
    ("page", "token_file"),
    ("page", "certificate"),
    ("page", "key"),
)
SCHEMA_DIALECT = "https://json-schema.org/draft/2020-12/schema"


class ConfigError(Exception):
    """The configuration cannot be used; one line for each mistake: where, what was seen, what is expected."""


class _Loader(yaml.SafeLoader):
    """YAML as usual, but a key that stands twice is an error: the first would be lost without a word."""


def _unique_mapping(loader: _Loader, node: yaml.MappingNode) -> dict[Any, Any]:
    seen: dict[Any, int] = {}
    for key_node, _ in node.value:
        key = loader.construct_object(key_node)
        line = key_node.start_mark.line + 1
        if not isinstance(key, str | int | float | bool | None):
            raise yaml.constructor.ConstructorError(None, None, "a key is not a plain word", key_node.start_mark)
        if key in seen:
            raise yaml.constructor.ConstructorError(
                None, None, f"key {key!r} stands twice, first in line {seen[key]}", key_node.start_mark
            )
        seen[key] = line
    return loader.construct_mapping(node, deep=True)


_Loader.add_constructor(yaml.resolver.BaseResolver.DEFAULT_MAPPING_TAG, _unique_mapping)


def _decimal_integer(loader: _Loader, node: yaml.ScalarNode) -> int:
    """An integer; YAML 1.1 would read 05020 as octal 2576."""
    digits = node.value.lstrip("+-")
    if len(digits) > 1 and digits[0] == "0" and digits[1].isdigit():
        raise yaml.constructor.ConstructorError(
            None, None, f"{node.value} begins with 0; write {digits.lstrip('0') or '0'}", node.start_mark
        )
    return loader.construct_yaml_int(node)


_Loader.add_constructor("tag:yaml.org,2002:int", _decimal_integer)


def read_yaml(path: Path, option: str = "--config") -> Any:
    """What a YAML file holds; raise ConfigError that names file, line and column."""
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise ConfigError(f"{path}: {path.stat().st_size} bytes, expected {LARGEST_FILE} at most")
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror}. Name another file with {option}") from error
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path}: is no UTF-8 text (byte {error.start}). Save it as UTF-8") from error
    try:
        return yaml.load(text, Loader=_Loader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        where = f"line {mark.line + 1}, column {mark.column + 1}: " if mark else ""
        raise ConfigError(f"{path}: {where}{error.problem or error.context}") from error
    except (yaml.YAMLError, RecursionError, ValueError) as error:  # a date or number that is none is a ValueError
        raise ConfigError(f"{path}: is no YAML: {' '.join(str(error).split())}") from error


def line_of(path: Path, location: Location) -> int | None:
    """The line where a key or entry stands in a YAML file, or the nearest one around it; None where none is known."""
    try:
        node = yaml.compose(path.read_text(encoding="utf-8-sig"), Loader=_Loader)
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


def load_config(path: Path) -> Config:
    """The configuration of a file; raise ConfigError."""
    data = read_yaml(path)
    if not isinstance(data, dict):
        seen = "is empty" if data is None else f"holds a {type(data).__name__}"
        raise ConfigError(f"{path}: {seen}, expected keys such as camera, controller, recipes")
    try:
        config = Config.model_validate(data)
    except ValidationError as error:
        told = describe(error, Config, lambda where: line_of(path, where))
        raise ConfigError("\n".join(f"{path}: {line}" for line in told)) from error
    return _resolved(config, path.resolve().parent)


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
    updates["recipes"] = tuple(_resolved_recipe(recipe, folder) for recipe in config.recipes)
    return config.model_copy(update=updates)


def _resolved_recipe(recipe: Recipe, folder: Path) -> Recipe:
    if recipe.gcode.template is None:
        return recipe
    gcode = recipe.gcode.model_copy(update={"template": folder / recipe.gcode.template})
    return recipe.model_copy(update={"gcode": gcode})
