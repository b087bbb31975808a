"""Events of the cell, by the companion specification's types."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from typing import Any

from asyncua import Node, Server, ua
from asyncua.server.event_generator import EventGenerator

# Numbers of the types in the nodeset.
TYPES = {
    "StateChanged": 1018,
    "Error": 1019,
    "ErrorResolved": 1020,
    "JobStarted": 1013,
    "ResultReady": 1024,
    "VisionInformation": 1038,
}
NOTICE, REFUSAL, FAULT = 100, 500, 800  # severities, 1 to 1000


def variant(value: Any) -> ua.Variant:
    """The value as it goes out: whole numbers are Int32, lists hold whatever they hold."""
    if isinstance(value, list):
        return ua.Variant(value, ua.VariantType.Variant)
    return ua.Variant(value, ua.VariantType.Int32) if type(value) is int else ua.Variant(value)


class Events:
    """What is told of the cell; `open` before anything else."""

    def __init__(self, server: Server, cell: Node, namespace: int) -> None:
        self._server = server
        self._cell = cell
        self._namespace = namespace
        self._generators: dict[str, EventGenerator] = {}

    async def open(self) -> None:
        """Make clients see that the cell tells of these."""
        for name, number in TYPES.items():
            generator = EventGenerator(self._server.iserver.isession)
            await generator.init(ua.NodeId(number, self._namespace), emitting_node=self._cell)
            self._generators[name] = generator

    async def tell(self, name: str, message: str, severity: int, at: datetime, fields: Mapping[str, Any]) -> None:
        """An event of the cell, and, as all of a server, of the server's own object."""
        generator = self._generators[name]
        event = generator.event
        for field, value in fields.items():
            event.add_property(field, value, variant(value).VariantType)  # of an empty one its type is not known
        event.Severity, event.emitting_node = severity, self._cell.nodeid
        await generator.trigger(at, message)
        event.emitting_node = ua.NodeId(ua.ObjectIds.Server)
        await self._server.iserver.subscription_service.trigger_event(event)
