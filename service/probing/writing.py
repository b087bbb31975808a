"""What is found out of a controller by writing to it; what stood there is put back."""

from __future__ import annotations

from collections.abc import AsyncIterator
from dataclasses import dataclass, replace
from functools import partial

from drivers.controller import ControllerRefused, ControllerUnavailable
from drivers.controller.mailbox.blocks import BLOCK_REGISTERS, TEST_VALUE
from drivers.controller.modbus.requests import LONGEST_WRITE, read_registers, registers_of, stream_of, write_registers
from service.check_result import CheckResult, fault, ok
from service.probing.link_signature import Signature, from_echo
from service.probing.probed import LOOK_PERIOD_S, Probed, largest, pieces

OWNER_WATCH_S = 3.0  # as long as the protocol lets a service watch another's heartbeat
ECHO_WAIT_S = 3.0
NO_SUCH_FUNCTION = 1  # exception code
OTHER_VALUE = 0xFEFDFCFB  # as a test_value no half of its own or of its echo is one of the right value's
TEAR_TURNS = 10


@dataclass
class WriteProbe:
    """Writes to a controller of whose contour block `readable` registers can be read, `longest_read` in a request."""

    probed: Probed
    longest_read: int
    readable: int
    _echoless: bool = False

    async def results(self) -> AsyncIterator[CheckResult]:
        """All that can be found out, as it is found out; nothing is written where somebody else may be at work."""
        probed = self.probed
        obstacle = await self._obstacle()
        if obstacle:
            yield fault("writing", f"not tried: {obstacle}")
            return
        held = await self._held()
        served = await probed.read(probed.layout.service_address, BLOCK_REGISTERS)
        longest_write, as_before = 1, True
        try:
            await self._write_test_value()
        except ControllerRefused as error:
            yield fault("writing", f"the service block cannot be written: {error}")
            return
        try:
            yield await self._echo()
            if not probed.renumbered:
                if "word_order" not in probed.changes and not self._echoless:
                    yield await self._tearing()
                if single := await self._cleared():
                    yield single
                longest_write = await self._longest_write()
                yield probed.longest("write", longest_write, LONGEST_WRITE)
                yield probed.contour_block("writable", await self._writable(longest_write))
        except ControllerRefused as error:
            held = ()  # nothing but `transfer` was written
            yield fault("writing", f"the contour block cannot be written: {error}")
        finally:
            as_before = await self._put_back(held, served, min(longest_write, self.longest_read))
        if not as_before:
            yield fault("put back", "the contour block does not read as it did before. It is not committed")

    async def _obstacle(self) -> str | None:
        """Why nothing may be written now; None where it may."""
        controller = self.probed.controller
        before = await controller.read_service()
        if before.owner:
            await self.probed.sleep(OWNER_WATCH_S)
            after = await controller.read_service()
            if after.service_heartbeat != before.service_heartbeat or after.owner != before.owner:
                return f"a service (owner {after.owner}) is alive on this controller. Stop it first"
        link = await controller.read_link()
        (reply,) = await self.probed.run(read_registers(self.probed.layout.contour_address, 1))
        (transfer,) = registers_of(reply)
        if link.session and transfer not in (0, link.ack_transfer):
            return f"page {transfer} is committed and not answered yet. Wait until it is, or stop the controller"
        return None

    # --- the contour block --------------------------------------------------------------------------------------------

    async def _held(self) -> tuple[int, ...]:
        """The contour block without `transfer`, as it stands."""
        registers: tuple[int, ...] = ()
        for start, count in pieces(self.readable - 1, self.longest_read):
            registers += await self.probed.read(self.probed.layout.contour_address + 1 + start, count)
        return registers

    async def _cleared(self) -> CheckResult | None:
        """Write `transfer` = 0, by the function that the controller knows; a result where it is another one."""
        controller = self.probed.controller
        try:
            await controller.write_transfer(0)
        except ControllerRefused as error:
            if error.code != NO_SUCH_FUNCTION or controller.single_write == "fc16":
                raise
        else:
            return None
        controller.single_write = "fc16"
        await controller.write_transfer(0)
        self.probed.changes["single_write"] = "fc16"
        return fault("single write", "function code 6 is not known there; 16, of one register, is")

    async def _longest_write(self) -> int:
        most = min(LONGEST_WRITE, self.readable - 1)
        return await largest(most, partial(self._writes_pattern, 1))

    async def _writable(self, longest_write: int) -> int:
        """Registers of the contour block that read back as they were written, from its first on."""
        if not longest_write:
            return 0
        for start, count in pieces(self.readable - 1, min(longest_write, self.longest_read)):
            offset = 1 + start
            if not await self._writes_pattern(offset, count):
                return offset + await largest(count, partial(self._writes_pattern, offset))
        return self.readable

    async def _writes_pattern(self, offset: int, count: int) -> bool:
        return await self._writes(offset, _pattern(count, offset))

    async def _writes(self, offset: int, registers: tuple[int, ...]) -> bool:
        """True where they can be written at `offset` of the contour block and read back alike."""
        first = self.probed.layout.contour_address + offset
        try:
            await self.probed.run(write_registers(first, stream_of(registers)))
        except ControllerRefused:
            return False
        except ControllerUnavailable:
            await self.probed.controller.connect()
            return False
        read: tuple[int, ...] = ()
        for start, count in pieces(len(registers), self.longest_read):
            read += await self.probed.read(first + start, count)
        return read == registers

    # --- the service block --------------------------------------------------------------------------------------------

    async def _write_test_value(self) -> None:
        before = await self.probed.controller.read_service()
        preoperational = 1  # so that the controller asks for nothing
        await self.probed.controller.write_service(
            replace(before, protocol_version=1, service_state=preoperational, test_value=TEST_VALUE)
        )

    async def _echo(self) -> CheckResult:
        """How the controller computed `test_echo` from the value written."""
        probed, layout = self.probed, self.probed.layout
        value = (await probed.controller.read_service()).test_value
        if value != TEST_VALUE:
            text = f"test_value reads back as 0x{value:08X}, written was 0x{TEST_VALUE:08X}"
            step = "Let the controller's program and settings leave the service block to the service"
            return fault("test_echo", f"{text}. {step}")
        until = probed.now() + ECHO_WAIT_S
        ways: list[Signature] = []
        while not ways and probed.now() < until:
            await probed.sleep(LOOK_PERIOD_S)
            served = await probed.read(layout.service_address, BLOCK_REGISTERS)
            known = {**dict(enumerate(served, start=layout.service_address)), **await probed.look()}
            ways = from_echo(known, layout)
        self._echoless = not ways
        if not ways:
            text = "test_echo never became test_value + 1, in any order of words or numbering known here"
            return fault("test_echo", f"{text}. Check that the controller's program runs and computes it")
        return probed.seen("test_echo", ways[0], "is computed")

    async def _tearing(self) -> CheckResult:
        """Whether 32-bit values are seen half written: `test_echo` is, as it follows a value of other halves."""
        controller, now = self.probed.controller, self.probed.now
        half_s, moved, beats, before = 0.0, False, set[int](), TEST_VALUE
        for value in (OTHER_VALUE, TEST_VALUE) * (TEAR_TURNS // 2):
            block = await controller.read_service()
            await controller.write_service(replace(block, test_value=value))
            until, torn_from = now() + ECHO_WAIT_S, None
            while (link := await controller.read_link()).test_echo != value + 1:
                if now() > until:
                    text = f"test_echo does not follow, from {before + 1} to {value + 1}. Compute it as a 32-bit number"
                    return fault("32-bit values", text)
                if link.test_echo != before + 1:
                    torn_from = now() if torn_from is None else torn_from
                    beats.add(link.controller_heartbeat)
            if torn_from is not None:
                half_s = max(half_s, now() - torn_from)
                moved = moved or len(beats) > 1
            beats.clear()
            before = value
        if not half_s:
            return ok("32-bit values", f"none was seen half written in {TEAR_TURNS} changes")
        text = f"they stand half written for up to {1000 * half_s:.0f} ms"
        if moved:
            return fault("32-bit values", f"{text}, and the heartbeat moves meanwhile. Let it wait for them")
        return ok("32-bit values", f"{text}, and the heartbeat waits for them, as it must")

    async def _put_back(self, held: tuple[int, ...], served: tuple[int, ...], longest: int) -> bool:
        """Write what stood there before, `transfer` stays 0; True where it reads back so."""
        alike = True
        if held and not self.probed.renumbered:
            await self.probed.controller.write_transfer(0)
            for start, count in pieces(len(held), longest):
                alike = await self._writes(1 + start, held[start : start + count]) and alike
        await self.probed.run(write_registers(self.probed.layout.service_address, stream_of(served)))
        return alike


def _pattern(count: int, offset: int) -> tuple[int, ...]:
    """Registers that differ from their neighbours, halves and places: what is shifted, cut or swapped shows."""
    return tuple((0xA500 + 31 * (offset + number)) & 0xFFFF for number in range(count))
