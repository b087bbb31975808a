"""What a controller on the other end of the wire can do, measured for the one who puts it into operation.

Reads stay within the configured blocks and one register beside the link block; only where no program's heartbeat is
seen there, the mailbox is looked for in all registers. Writes, only where they are asked for, stay within the service
block and, under `transfer` = 0, the contour block; what stood there is put back. Nothing is written while another
service is alive, nor while a page is being answered.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from dataclasses import dataclass

from drivers.controller import ControllerError, ControllerUnavailable
from drivers.controller.mailbox.blocks import BLOCK_REGISTERS
from drivers.controller.modbus.client import ModbusController
from drivers.controller.modbus.requests import LONGEST_READ
from service.check_result import CheckResult, fault, ok
from service.probing.probed import HEADER, Probed
from service.probing.reading import ReadProbe
from service.probing.writing import WriteProbe


@dataclass(frozen=True)
class ProbeFindings:
    """All that was found out, and keys of the configuration's `controller` with what they should be."""

    results: tuple[CheckResult, ...]
    changes: dict[str, object]


async def probed(controller: ModbusController, timeout_s: float, *, write: bool) -> ProbeFindings:
    """What one look at a controller finds out; it is closed then."""
    probe = Probe(controller, timeout_s)
    results = []
    try:
        async for result in probe.results(write=write):
            results.append(result)
    except ControllerError as error:
        results.append(fault("controller", str(error)))
    finally:
        await controller.close()
    return ProbeFindings(tuple(results), probe.changes)


class Probe:
    """One look at a controller, which `results` connects and the caller closes. sleep, now: s."""

    def __init__(
        self,
        controller: ModbusController,
        timeout_s: float,
        *,
        sleep: Callable[[float], Awaitable[None]] = asyncio.sleep,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self.controller = controller
        self._probed = Probed(controller, sleep, now)
        self._reading = ReadProbe(self._probed, timeout_s)

    @property
    def changes(self) -> dict[str, object]:
        """Keys of the configuration's `controller`, and what they should be."""
        return self._probed.changes

    async def results(self, *, write: bool) -> AsyncIterator[CheckResult]:
        """All that can be found out, as it is found out; raise ControllerUnavailable where nothing can be."""
        probed, reading, layout = self._probed, self._reading, self._probed.layout
        await self.controller.connect()
        yield ok("connection", f"{self.controller}: it is open")
        linked = await reading.link_block()
        if not linked and (unit := await reading.another_unit()):
            yield unit
            linked = await reading.link_block()
        yield reading.block("link block", layout.link_address, linked)
        served = await probed.read(layout.service_address, BLOCK_REGISTERS)
        yield reading.block("service block", layout.service_address, served)
        if not linked and not served and not probed.lacks_registers:
            raise ControllerUnavailable("it answers nothing as it should; what else it can do was not tried")
        if linked:
            yield await reading.round_trip()
        ways = await reading.movement()
        if not ways and (elsewhere := await reading.elsewhere()):
            yield reading.heartbeat(elsewhere)
            yield fault("all else", "not tried: change the addresses, then probe again")
            return
        longest_read = await reading.longest_read()
        yield probed.longest("read", longest_read, LONGEST_READ)
        readable = await reading.readable(longest_read)
        yield probed.contour_block("readable", readable)
        if layout.part_address is not None:
            yield await reading.part_block(layout.part_address, longest_read)
        yield reading.heartbeat(ways)
        if not write:
            return
        if readable < HEADER or not served:
            yield fault("writing", "not tried: the service block or the contour block cannot be read")
        elif probed.renumbered:  # a neighbour's register would be written
            yield fault("writing", "not tried: change the addresses, then probe again")
        else:
            async for result in WriteProbe(probed, longest_read, readable).results():
                yield result
