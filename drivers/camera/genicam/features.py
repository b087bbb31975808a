"""Features by name: written as the camera's own description allows, and read back."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from drivers.camera import CameraRefused
from drivers.camera.genicam.binding import aravis
from drivers.camera.genicam.errors import told

Value = bool | int | float | str
# A number that the camera rounds to its own steps is told; one that it changes by more is refused.
ROUNDED = 0.01


@dataclass(frozen=True)
class Written:
    """A feature as it was asked for and as it reads back."""

    name: str
    asked: Value
    held: Value

    def __str__(self) -> str:
        return f"{self.name} = {_text(self.held)}" + (
            "" if self.held == self.asked else f" (asked {_text(self.asked)})"
        )


class Features:
    """The features of one open camera. source: what it is called in messages."""

    def __init__(self, device: Any, source: str) -> None:
        self._device, self._source = device, source

    def has(self, name: str) -> bool:
        """True where the camera has the feature and offers it now."""
        with told(self._source, f"tell whether it has {name}"):
            return bool(self._device.get_feature(name) is not None and self._device.is_feature_available(name))

    def allows(self, name: str, entry: str) -> bool:
        """True where an enumeration has the entry."""
        return self.has(name) and entry in self._entries(name)

    def write(self, name: str, value: Value, key: str) -> Written:
        """Write one and read it back; raise CameraRefused, with range or names, CameraUnavailable.

        key: where the value stands in the configuration.
        """
        if not self.has(name):
            raise CameraRefused(f"{self._source}: no feature {name}{self._meant(name)}. Correct {key}.")
        kind = self._kind(name)
        if kind == "command":
            raise CameraRefused(f"{self._source}: {name} is a command and holds no value. Take out {key}.")
        asked = self._checked(kind, name, value, key)
        with told(self._source, f"take {name} = {_text(asked)}"):
            getattr(self._device, f"set_{kind}_feature_value")(name, asked)
        written = Written(name, asked, self.read(name))
        self.check_held(written, key)
        return written

    def check_held(self, written: Written, key: str) -> None:
        """Raise CameraRefused where the camera holds another value than was asked."""
        held, asked = written.held, written.asked
        if held == asked:
            return
        if isinstance(held, float) and isinstance(asked, float) and abs(held - asked) <= ROUNDED * abs(asked):
            return
        raise CameraRefused(
            f"{self._source}: {written.name} was set to {_text(asked)} and reads back {_text(held)}; expected what was "
            f"asked{self._range(written.name)}. Another feature may govern it. Correct {key}."
        )

    def read(self, name: str) -> Value:
        """The present value."""
        with told(self._source, f"tell {name}"):
            value: Value = getattr(self._device, f"get_{self._kind(name)}_feature_value")(name)
            return value

    def run(self, name: str) -> None:
        """Execute a command."""
        with told(self._source, f"do {name}"):
            self._device.execute_command(name)

    def close(self) -> None:
        """Let the camera go."""
        self._device = None

    # --- what the description says --------------------------------------------------------------------------------

    def _kind(self, name: str) -> str:
        kinds = aravis()
        node = self._device.get_feature(name)
        for kind, types in (
            ("command", (kinds.GcCommand,)),
            ("boolean", (kinds.GcBoolean,)),
            ("string", (kinds.GcEnumeration, kinds.GcString)),
            ("float", (kinds.GcFloat,)),
            ("integer", (kinds.GcInteger,)),
        ):
            if isinstance(node, types):
                return kind
        raise CameraRefused(f"{self._source}: {name} is neither number, switch, text nor choice. Take it out.")

    def _checked(self, kind: str, name: str, value: Value, key: str) -> Value:
        """The value in the feature's own type."""
        expected: str
        if kind == "boolean":
            if isinstance(value, bool):
                return value
            expected = "true or false"
        elif kind == "string":
            entries = self._entries(name)
            text = {True: "On", False: "Off"}[value] if isinstance(value, bool) else str(value)
            if not entries or text in entries:
                return text
            near = difflib.get_close_matches(text, entries, 1)
            expected = "one of " + ", ".join(entries) + (f" (did you mean {near[0]}?)" if near else "")
        else:
            if isinstance(value, int | float) and not isinstance(value, bool) and self._within(kind, name, value):
                return float(value) if kind == "float" else int(value)
            expected = ("a number" if kind == "float" else "a whole number") + self._range(name)
        raise CameraRefused(f"{self._source}: {name} = {_text(value)}; expected {expected}. Correct {key}.")

    def _within(self, kind: str, name: str, value: float) -> bool:
        low, high, step = self._bounds(kind, name)
        if not low <= value <= high:
            return False
        return kind == "float" or (value == int(value) and (int(value) - int(low)) % max(1, int(step)) == 0)

    def _bounds(self, kind: str, name: str) -> tuple[float, float, float]:
        with told(self._source, f"tell the range of {name}"):
            low, high = getattr(self._device, f"get_{kind}_feature_bounds")(name)
            step = self._device.get_integer_feature_increment(name) if kind == "integer" else 0
        return low, high, step

    def _range(self, name: str) -> str:
        kind = self._kind(name)
        if kind not in ("float", "integer"):
            return ""
        low, high, step = self._bounds(kind, name)
        return f", {low:.10g} to {high:.10g}" + (f" in steps of {step}" if step > 1 else "")

    def _entries(self, name: str) -> Sequence[str]:
        if not isinstance(self._device.get_feature(name), aravis().GcEnumeration):
            return ()
        with told(self._source, f"tell the choices of {name}"):
            return tuple(self._device.dup_available_enumeration_feature_values_as_strings(name))

    def _meant(self, name: str) -> str:
        near = difflib.get_close_matches(name, sorted(self._below("Root")), 1, 0.5)
        return f"; did you mean {near[0]}?" if near else ""

    def _below(self, category: str) -> set[str]:
        """The names of the features of a category, and of those within it."""
        node = self._device.get_feature(category)
        if not isinstance(node, aravis().GcCategory):
            return {category}
        return {name for entry in node.get_features() for name in self._below(entry)}


def _text(value: Value) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
