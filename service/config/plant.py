"""A plant's broker, and what the daemon tells it."""

from __future__ import annotations

import re
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from service.config.values import FilePath, Host, Model, Port

_NAME = re.compile(r"[^+#/\s\0][^+#/\0]{0,99}")


def _a_name(value: Any) -> Any:
    """A part of a topic: MQTT gives +, # and / a meaning of their own there, and brokers refuse control characters."""
    if isinstance(value, str) and not (_NAME.fullmatch(value) and value.isprintable()):
        raise ValueError(f"is {value[:60]!r}, expected 1 to 100 printable characters without + # /")
    return value


TopicName = Annotated[str, BeforeValidator(_a_name)]


class Tls(Model):
    """The connection to the broker over TLS."""

    ca_file: FilePath | None = Field(
        None, description="Certificates that the broker's is judged by, PEM; none = the system's."
    )
    cert_file: FilePath | None = Field(None, description="Own certificate chain, PEM; none = the broker asks for none.")
    key_file: FilePath | None = Field(None, description="Private key of the own certificate, PEM.")

    @model_validator(mode="after")
    def _certificate_with_key(self) -> Self:
        if (self.cert_file is None) != (self.key_file is None):
            raise ValueError("cert_file and key_file: only one of them is given, expected both or none")
        return self


class Broker(Model):
    """Where the broker is, and how one is known there."""

    host: Host = Field("127.0.0.1", description="The broker's host.")
    port: Port = Field(1883, description="The broker's TCP port; usually 8883 with tls.")
    username: str | None = Field(None, min_length=1, description="Name at the broker; none = nobody's.")
    password_file: FilePath | None = Field(
        None, description="File of mode 0600 whose first line is the password; none = without."
    )
    tls: Tls | None = Field(None, description="TLS; none = plain TCP.")

    @model_validator(mode="after")
    def _a_password_has_a_name(self) -> Self:
        if self.password_file is not None and self.username is None:
            raise ValueError("password_file is given without a username. Give both")
        return self


class Telemetry(Broker):
    """Telemetry by MQTT, Sparkplug B; needs the extra combtrace[mqtt]."""

    kind: Literal["mqtt"] = "mqtt"
    group: TopicName = Field("combtrace", description="Group of cells: Sparkplug's group id.")
    node: TopicName = Field(description="This cell: Sparkplug's edge node id, its own in the group.")
    primary_host: TopicName | None = Field(
        None,
        description="Host application for which results wait while its STATE is not online; none = the broker alone.",
    )
    store: int = Field(
        10_000,
        ge=100,
        le=1_000_000,
        description="Most jobs, and most changes of state, kept while nobody takes them; the oldest go first, counted.",
    )
    page_url: str | None = Field(
        None,
        pattern=r"^https?://[^\s<>\"']{1,200}$",
        description="Address of this cell's own page as others reach it; none = no link to it.",
    )
