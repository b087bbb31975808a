"""`triggers` of config.yaml: what begins a job."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from service.config.values import Model


class IntervalTrigger(Model):
    """A job at equal intervals."""

    kind: Literal["interval"]
    period_s: Annotated[float, Field(ge=0.05, le=86_400)] = Field(description="Period, s.")


class ControllerTrigger(Model):
    """A job when the controller asks for one."""

    kind: Literal["controller"]


class SerialTrigger(Model):
    """A job by hand, over a serial port: by lines of text, by any byte, or by an edge of an input line."""

    kind: Literal["serial"]
    port: str = Field(
        min_length=1,
        description="Serial port; one below /dev/serial/by-id keeps its name. With byte and signal also "
        "rfc2217://HOST:PORT of a serial server.",
    )
    baudrate: int = Field(9600, ge=300, le=4_000_000, description="Baud rate.")
    mode: Literal["text", "byte", "signal"] = Field(
        "text", description="text: lines of TRIG, STAT, PING. byte: any byte. signal: an edge of CTS or DSR."
    )
    debounce_s: Annotated[float, Field(ge=0.001, le=10)] | None = Field(
        None,
        description="byte: bytes closer than this are one trigger, s, else 0.2. signal: how long the new level must "
        "hold, s, else 0.05.",
    )
    signal: Literal["cts", "dsr"] = Field("cts", description="mode signal: the input line that is watched.")
    edge: Literal["rising", "falling"] = Field(
        "rising", description="mode signal: rising = the line becomes asserted (contact closes), falling = it ends."
    )

    @model_validator(mode="after")
    def _a_port_that_the_mode_can_use(self) -> Self:
        if self.mode == "text" and "://" in self.port:
            raise ValueError(f"port is {self.port}, but mode text needs a serial port of this machine")
        if "://" in self.port and not self.port.startswith("rfc2217://"):
            raise ValueError(f"port is {self.port}, expected a serial port of this machine or rfc2217://HOST:PORT")
        return self

    @model_validator(mode="after")
    def _keys_of_the_mode(self) -> Self:
        foreign = self.model_fields_set & _OF_OTHER_MODES[self.mode]
        if foreign:
            raise ValueError(f"{', '.join(sorted(foreign))} is given, but means nothing in mode {self.mode}")
        return self


_OF_OTHER_MODES: dict[str, set[str]] = {
    "text": {"debounce_s", "signal", "edge"},
    "byte": {"signal", "edge"},
    "signal": set(),
}


Trigger = Annotated[IntervalTrigger | ControllerTrigger | SerialTrigger, Field(discriminator="kind")]
