"""Values of configuration files: what each may hold, and what YAML would make of it without a word."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator

REGISTERS = 65536


class MistakeAt(ValueError):
    """What is wrong at one place within the model that finds it: keys and indices, and a sentence."""

    def __init__(self, location: tuple[int | str, ...], text: str) -> None:
        super().__init__(text)
        self.location = location


Seconds = Annotated[float, Field(gt=0, le=86_400)]
Port = Annotated[int, Field(ge=1, le=65_535)]
Register = Annotated[int, Field(ge=0, lt=REGISTERS)]


@dataclass(frozen=True)
class TruthValue:
    """What stands where no truth value can: of no type that a key takes, so that each key says what it expects."""

    value: bool

    def __str__(self) -> str:
        return "true, as yes and on are read" if self.value else "false, as no and off are read"


def no_truth_value(value: Any) -> Any:
    """The value, refused where YAML read yes, no, on or off."""
    if isinstance(value, bool):
        raise ValueError(f"is {TruthValue(value)}, expected a number")
    return value


def _a_path(value: Any) -> Any:
    """An empty path would be the file's own folder, a NUL ends a name for the system, and only shells know ~."""
    if isinstance(value, str) and value.startswith("~"):
        raise ValueError(f"is {value!r}, and ~ is no folder here. Write the whole path")
    if isinstance(value, str) and (not value.strip() or "\0" in value):
        raise ValueError(f"is {value!r}, expected the path of a file or folder")
    return value


def _a_host(value: Any) -> Any:
    """Only a name or address: what stands around it elsewhere would be looked up with it, in vain, for ever."""
    if isinstance(value, str) and value and not _HOST.fullmatch(value):
        raise ValueError(f"is {value[:60]!r}, expected a host name or address and nothing else; a port has its own key")
    return value


_HOST = re.compile(r"(?=.*\w)[\w.-]{1,253}|[0-9A-Fa-f]*(:[0-9A-Fa-f.]*){2,7}(%[\w.-]+)?")

Host = Annotated[str, Field(min_length=1), BeforeValidator(_a_host)]
Number = Annotated[float, BeforeValidator(no_truth_value)]
Point = tuple[Number, Number]
FilePath = Annotated[Path, BeforeValidator(_a_path)]


class Model(BaseModel):
    """Frozen, and refuses keys it does not know."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, validate_default=True)

    @model_validator(mode="before")
    @classmethod
    def _truth_values_are_no_numbers(cls, data: Any) -> Any:
        """YAML's yes, no, on and off are truth values; pydantic would take them for 1 and 0."""
        if not isinstance(data, dict):
            return data
        fields = cls.model_fields
        return {
            name: TruthValue(value)
            if isinstance(value, bool) and name in fields and fields[name].annotation is not bool
            else value
            for name, value in data.items()
        }
