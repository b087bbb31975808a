"""The configuration's reference as Markdown, made from the models, so that it cannot say what is not so.

`python -m service.config.reference docs/reference/configuration.md config.schema.json` writes both generated files.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from service.config import cameras, config, controllers, plant, recipes, triggers
from service.config.config_file import config_schema

HEAD = """\
# Configuration

Made from the models in `service/config/`; a test keeps it fresh. Unknown keys are refused with their path, and
relative paths count from the file's folder. `combtrace check` tries a configuration, `combtrace schema` prints its
JSON schema.
"""

SECTIONS: tuple[tuple[str, tuple[type[BaseModel], ...]], ...] = (
    ("Top level", (config.Config,)),
    ("`camera`", (cameras.FilesCamera, cameras.V4l2Camera, cameras.GenicamCamera)),
    ("`calibration`", (config.Calibration,)),
    (
        "`controller`",
        (controllers.ModbusTcp, controllers.ModbusRtu, controllers.ModbusRtuOverTcp, controllers.NoController),
    ),
    ("`controller.rs485`", (controllers.Rs485,)),
    ("`controller.part_block`", (controllers.PartBlock,)),
    ("`triggers`", (triggers.IntervalTrigger, triggers.ControllerTrigger, triggers.SerialTrigger)),
    ("`recipes`", (recipes.Recipe,)),
    ("A recipe's `gcode`", (recipes.Gcode,)),
    ("A recipe's `part`", (recipes.PartToCut,)),
    ("Each of a recipe's `parts`", (recipes.OneOfParts,)),
    ("`table`", (config.Table,)),
    ("`service`", (config.Service,)),
    ("`journal`", (config.JournalSettings,)),
    ("`archive`", (config.ArchiveSettings,)),
    ("`remnants`", (config.RemnantsSettings,)),
    ("`metrics`", (config.Metrics,)),
    ("`page`", (config.Page,)),
    ("`telemetry`", (plant.Telemetry,)),
    ("`telemetry.tls`", (plant.Tls,)),
    ("`opcua`", (config.Opcua,)),
    ("`log`", (config.Log,)),
)
TYPES = {
    "integer": "whole number",
    "object": "keys",
    "null": "none",
    "array": "list",
    "string": "text",
    "boolean": "true, false",
}


def reference() -> str:
    """The whole page."""
    return HEAD + "".join(_section(title, models) for title, models in SECTIONS) + _parameters()


def schema_text() -> str:
    """The JSON schema as it stands in config.schema.json."""
    return json.dumps(config_schema(), indent=2, ensure_ascii=False) + "\n"


def _section(title: str, models: tuple[type[BaseModel], ...]) -> str:
    text = f"\n## {title}\n"
    for model in models:
        kind = model.model_fields.get("kind")
        if kind is not None:
            text += f"\n### kind: {_choices(kind)}\n"
        text += f"\n{(model.__doc__ or '').strip()}\n"
        table = list(rows(model))
        if table:
            text += "\n| key | value | default | meaning |\n|---|---|---|---|\n" + "".join(table)
    return text


def rows(model: type[BaseModel]) -> Iterator[str]:
    """The table's rows of a model's keys, but for `kind`."""
    properties = model.model_json_schema()["properties"]
    for name, field in model.model_fields.items():
        if name != "kind":
            yield f"| `{name}` | {_value(properties[name])} | {_default(field)} | {field.description or ''} |\n"


def _choices(kind: FieldInfo) -> str:
    return ", ".join(str(word) for word in getattr(kind.annotation, "__args__", ()))


def _value(schema: dict[str, Any]) -> str:
    """What may stand there, with bounds."""
    if "anyOf" in schema:
        return " or ".join(_value(branch) for branch in schema["anyOf"])
    if "enum" in schema:
        return ", ".join(str(word) for word in schema["enum"])
    if "const" in schema:
        return str(schema["const"])
    kind = TYPES.get(schema.get("type", "object"), "number")
    low = schema.get("minimum", schema.get("exclusiveMinimum"))
    high = schema.get("maximum", schema.get("exclusiveMaximum"))
    if low is None or high is None:
        return kind
    return f"{kind}, {'above ' if 'exclusiveMinimum' in schema else ''}{low:g} to {high:.10g}"


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "must be given"
    value = field.get_default(call_default_factory=True, validated_data={})
    if value is PydanticUndefined or isinstance(value, BaseModel):
        return "see below"
    if value is None or value in ({}, ()):
        return "none"
    if isinstance(value, tuple):
        return "one, named default" if isinstance(value[0], BaseModel) else ", ".join(f"`{one}`" for one in value)
    if isinstance(value, bool):
        return str(value).lower()
    return f"`{value:g}`" if isinstance(value, float) else f"`{value}`"


def _parameters() -> str:
    text = "\n## A recipe's `parameters`\n\n| method | parameter | bounds |\n|---|---|---|\n"
    for method, parameters in recipes.METHOD_PARAMETERS.items():
        for name, (low, high) in parameters.items():
            text += f"| {method} | `{name}` | {low:g} to {high:g} |\n"
    return text


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(reference(), encoding="utf-8")
    Path(sys.argv[2]).write_text(schema_text(), encoding="utf-8")
