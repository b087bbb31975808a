"""What a controller on the other end of the wire can do, measured for the one who puts it into operation.

Reads stay within the configured blocks and one register beside the link block; only where no program's heartbeat is
seen there, the mailbox is looked for in all registers. Writes, only where they are asked for, stay within the service
block and, under `transfer` = 0, the contour block; what stood there is put back. Nothing is written while another
service is alive, nor while a page is being answered.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from dataclasses import dataclass, field, replace
from statistics import median

from drivers.controller import (
    ControllerError,
    ControllerNonsense,
    ControllerRefused,
    ControllerTimeout,
    ControllerUnavailable,
)
from drivers.controller.mailbox.mailbox import BLOCK_REGISTERS, HEADER_REGISTERS, TEST_VALUE, MailboxLayout
from drivers.controller.modbus.client import ModbusController
from drivers.controller.modbus.requests import (
    LONGEST_READ,
    LONGEST_WRITE,
    SHORTEST_LIMIT,
    Request,
    people,
    read_registers,
    registers_of,
    stream_of,
    write_registers,
)
from service.commissioning.link_signature import Registers, Signature, from_echo, from_mailbox, from_movement
from service.commissioning.register_search import SURVEY_S, survey
from service.poll_timing import off_beat

ROUND_TRIPS = 20
OWNER_WATCH_S = 3.0  # as long as the protocol lets a service watch another's heartbeat
MOVEMENT_WATCH_S = 2.5  # a heartbeat changes at least once a second
ECHO_WAIT_S = 3.0
LOOK_PERIOD_S = 0.25
HEADER = 1 + HEADER_REGISTERS
NO_SUCH_FUNCTION, NO_SUCH_REGISTER, NO_WAY_TO_IT = 1, 2, 10  # exception codes
USUAL_UNITS = (255, 0, 1)  # over TCP: the device itself, by either name, and the first behind a gateway
MOST_PLACES = 32  # that may hold a mailbox
OTHER_VALUE = 0xFEFDFCFB  # as a test_value no half of its own or of its echo is one of the right value's
TEAR_TURNS = 10


@dataclass(frozen=True)
class Finding:
    """One thing that was tried: whether it is well, and what was seen in a sentence."""

    part: str
    well: bool
    text: str


@dataclass
class Probe:
    """One look at a controller. changes: keys of the configuration's `controller`, and what they should be.

    controller: connected by `findings`, closed by the caller. sleep, now: s.
    """

    controller: ModbusController
    timeout_s: float
    changes: dict[str, object] = field(default_factory=dict)
    sleep: Callable[[float], Awaitable[None]] = asyncio.sleep
    now: Callable[[], float] = time.monotonic
    _trouble: ControllerError | None = None  # of the last read that failed
    _searched: int = 0  # registers, for a mailbox that is elsewhere
    _echoless: bool = False

    @property
    def layout(self) -> MailboxLayout:
        """As configured."""
        return self.controller.layout

    async def findings(self, *, write: bool) -> AsyncIterator[Finding]:
        """All that can be found out, as it is found out; raise ControllerUnavailable where nothing can be."""
        await self.controller.connect()
        yield Finding("connection", True, f"{self.controller}: it is open")
        linked = await self._reads(read_registers(self.layout.link_address, BLOCK_REGISTERS))
        if not linked and (unit := await self._another_unit()):
            yield unit
            linked = await self._reads(read_registers(self.layout.link_address, BLOCK_REGISTERS))
        yield self._block("link block", self.layout.link_address, linked)
        served = await self._reads(read_registers(self.layout.service_address, BLOCK_REGISTERS))
        yield self._block("service block", self.layout.service_address, served)
        if not linked and not served and not self._lacks_registers:
            raise ControllerUnavailable("it answers nothing as it should; what else it can do was not tried")
        if linked:
            yield await self._round_trip()
        ways = await self._movement()
        if not ways and (elsewhere := await self._elsewhere()):
            yield self._moving(elsewhere)
            yield Finding("all else", False, "not tried: change the addresses, then probe again")
            return
        longest_read = await self._longest_read()
        yield self._longest("read", longest_read, LONGEST_READ)
        readable = await self._readable(longest_read)
        yield self._window("readable", readable)
        yield self._moving(ways)
        if not write:
            return
        if readable < HEADER or not served:
            yield Finding("writing", False, "not tried: the service block or the contour block cannot be read")
        elif self._renumbered:  # a neighbour's register would be written
            yield Finding("writing", False, "not tried: change the addresses, then probe again")
        else:
            async for finding in self._written(longest_read, readable):
                yield finding

    # --- reading ------------------------------------------------------------------------------------------------

    async def _reads(self, request: Request) -> tuple[int, ...]:
        """The registers, () where the controller refuses them or does not answer."""
        try:
            (reply,) = await self._run(request)
        except ControllerError as error:
            self._trouble = error
            return ()
        return registers_of(reply)

    @property
    def _lacks_registers(self) -> bool:
        """True where the last read failed because the registers are not there."""
        return isinstance(self._trouble, ControllerRefused) and self._trouble.code == NO_SUCH_REGISTER

    async def _run(self, *requests: Request) -> list[bytes]:
        """The replies; after a request that was not answered the connection is opened anew."""
        if not self.controller.connected:
            await self.controller.connect()
        return await self.controller.run(requests)

    async def _another_unit(self) -> Finding | None:
        """The device id by which it answers, where it is another one; from here on it is asked by that."""
        asked, trouble = self.controller.device_id, self._trouble
        found: int | None = None
        if isinstance(trouble, ControllerNonsense):
            found = trouble.answered_as
        elif isinstance(trouble, ControllerTimeout) or getattr(trouble, "code", None) == NO_WAY_TO_IT:
            others = [] if self.controller.serial else [unit for unit in USUAL_UNITS if unit != asked]
            found = await self._first_that_answers(others)
        self.controller.device_id = asked if found is None else found
        if found is None:
            self._trouble = trouble
            return None
        self.changes["device_id"] = found
        return Finding("device id", False, f"it answers as {found}, asked was {asked}")

    async def _first_that_answers(self, units: list[int]) -> int | None:
        for unit in units:
            self.controller.device_id = unit
            await self.controller.close()
            if await self._reads(read_registers(self.layout.link_address, 1)) or self._lacks_registers:
                return unit
        return None

    def _block(self, name: str, address: int, registers: tuple[int, ...]) -> Finding:
        span = people(address, BLOCK_REGISTERS)
        if registers:
            return Finding(name, True, f"registers {span} can be read")
        if not self._lacks_registers:
            return Finding(name, False, f"registers {span} cannot be read: {self._trouble}")
        key = name.replace(" block", "_address")
        return Finding(name, False, f"registers {span} cannot be read. Set {key} to where the controller has them")

    async def _round_trip(self) -> Finding:
        took_ms = []
        for _ in range(ROUND_TRIPS):
            begun = self.now()
            await self._run(read_registers(self.layout.link_address, BLOCK_REGISTERS))
            took_ms.append(1000 * (self.now() - begun))
        text = f"{median(took_ms):.1f} ms, {max(took_ms):.1f} ms at most in {ROUND_TRIPS} reads"
        if max(took_ms) > 1000 * self.timeout_s / 3:
            wanted = round(max(0.1, 5 * max(took_ms) / 1000), 1)
            self.changes["timeout_s"] = wanted
            return Finding("round trip", False, f"{text}, too near to timeout_s, {self.timeout_s:g}")
        return Finding("round trip", True, text)

    async def _longest_read(self) -> int:
        address, window = self.layout.contour_address, HEADER + self.layout.payload_capacity
        return await self._largest(min(LONGEST_READ, window), lambda count: self._reads_all(address, count))

    async def _reads_all(self, address: int, count: int) -> bool:
        return len(await self._reads(read_registers(address, count))) == count

    async def _largest(self, most: int, works: Callable[[int], Awaitable[bool]]) -> int:
        """The largest count up to `most` that works, 0 where none does; beyond one that fails all are taken to fail."""
        if await works(most):
            return most
        low, high = 0, most
        while high - low > 1:
            middle = (low + high) // 2
            if await works(middle):
                low = middle
            else:
                high = middle
        return low

    def _longest(self, kind: str, count: int, most: int) -> Finding:
        most = min(most, HEADER + self.layout.payload_capacity)
        text = f"{count} registers in one request"
        if count >= most:
            return Finding(f"longest {kind}", True, text)
        if count < SHORTEST_LIMIT:
            text += f", expected {SHORTEST_LIMIT} or more. Check contour_address, and what limits a request on its way"
            return Finding(f"longest {kind}", False, text)
        self.changes[f"longest_{kind}"] = count
        return Finding(f"longest {kind}", False, f"{text}, the standard's limit is {most}")

    async def _readable(self, longest: int) -> int:
        """Registers of the contour block that can be read, from its first on."""
        window = HEADER + self.layout.payload_capacity
        for start, count in _pieces(window, longest):
            if not await self._reads_all(self.layout.contour_address + start, count):
                first = self.layout.contour_address + start
                return start + await self._largest(count, lambda part, first=first: self._reads_all(first, part))  # type: ignore[misc]
        return window if longest else 0

    def _window(self, kind: str, count: int) -> Finding:
        window = HEADER + self.layout.payload_capacity
        address = self.layout.contour_address
        if count >= window:
            return Finding(kind, True, f"the whole contour block, registers {people(address, window)}")
        usable = (count - HEADER) // 2 * 2
        if usable < 8:
            text = f"{count} registers from {people(address, 1)} on, expected {window}"
            if kind == "writable":
                step = "Nothing written reads back: let the controller's program and settings leave them to the service"
            else:
                step = "Set contour_address to where the controller has them"
            return Finding(kind, False, f"{text}. {step}")
        self.changes["payload_capacity"] = min(usable, int(str(self.changes.get("payload_capacity", usable))))
        return Finding(kind, False, f"the contour block up to register {people(address + count - 1, 1)}, not all of it")

    async def _look(self) -> Registers:
        """The link block and, where the controller lets it be read, one register on either side."""
        link = self.layout.link_address
        for first, end in ((link - 1, link + 17), (link, link + 17), (link, link + 16), (link + 1, link + 17)):
            registers = await self._reads(read_registers(first, end - first)) if first >= 0 else ()
            if registers:
                return dict(enumerate(registers, start=first))
        return {}

    async def _movement(self) -> list[Signature]:
        looks: list[Registers] = []
        until = self.now() + MOVEMENT_WATCH_S
        while self.now() < until:
            looks.append(await self._look())
            # A heartbeat of one bit that changes in step with looks at equal distances seems to stand still.
            await self.sleep(off_beat(len(looks)) * LOOK_PERIOD_S)
        return from_movement(looks, self.layout)

    async def _elsewhere(self) -> list[Signature]:
        """How the mailbox is seen at the one place in all registers where it is and its heartbeat moves, else []."""

        async def read(first: int, count: int) -> tuple[int, ...]:
            return await self._reads(read_registers(first, count))

        until = self.now() + SURVEY_S
        known = await survey(read, LONGEST_READ, self.layout.link_address, lambda: self.now() < until)
        self._searched = len(known)
        ways = from_mailbox(known, self.layout)[:MOST_PLACES]
        blocks = [self.layout.link_address + way.shift for way in ways]
        looks: list[Registers] = []
        until = self.now() + MOVEMENT_WATCH_S
        while blocks and self.now() < until:
            looks.append({block + n: value for block in blocks for n, value in enumerate(await read(block, 16))})
            await self.sleep(off_beat(len(looks)) * LOOK_PERIOD_S)
        moving = from_movement(looks, self.layout, [way.shift for way in ways]) if looks else []
        return [way for way in ways if len(moving) == 1 and way.shift == moving[0].shift]

    def _moving(self, ways: list[Signature]) -> Finding:
        if not ways:
            text = (
                "nothing moves where the heartbeat should be, and no mailbox whose heartbeat moves is in the "
                f"{self._searched} registers that can be read: the controller's program does not run, or does not fill "
                "the link block. A controller that cannot answer at all takes handshake: none"
            )
            return Finding("heartbeat", False, text)
        return self._judged("heartbeat", ways[0], "moves")

    def _judged(self, part: str, way: Signature, verb: str) -> Finding:
        """What a signature asks to be changed."""
        texts = []
        if way.shift:
            distance = "one register" if abs(way.shift) == 1 else f"{abs(way.shift)} registers"
            texts.append(f"it {verb} {distance} {self._shifted(way.shift)}")
        if way.word_order not in (None, self.layout.word_order):
            self.changes["word_order"] = way.word_order
            texts.append(f"32-bit values have the other order of words: {way.word_order}")
        if texts:
            return Finding(part, False, "; ".join(texts))
        order = f", 32-bit values are {way.word_order}" if way.word_order else ""
        return Finding(part, True, f"it {verb} where it should{order}")

    @property
    def _renumbered(self) -> bool:
        """True where the controller was seen to number registers otherwise than configured."""
        return "contour_address" in self.changes

    def _shifted(self, shift: int) -> str:
        """What another numbering asks to be changed, and in words."""
        addresses = {name: first + shift for name, (first, _) in self.layout.blocks.items()}
        if min(addresses.values()) < 0:
            return "below the configured 0, where no register is. Let its blocks begin one register later"
        self.changes.update(addresses)
        why = {1: ": the controller counts registers from 1", -1: ": the controller counts registers from 0"}
        return ("higher" if shift > 0 else "lower") + " than configured" + why.get(shift, "")

    # --- writing ------------------------------------------------------------------------------------------------

    async def _written(self, longest_read: int, readable: int) -> AsyncIterator[Finding]:
        obstacle = await self._obstacle()
        if obstacle:
            yield Finding("writing", False, f"not tried: {obstacle}")
            return
        layout = self.layout
        held = await self._held(longest_read, readable)
        served = await self._reads(read_registers(layout.service_address, BLOCK_REGISTERS))
        longest_write, as_before = 1, True
        try:
            await self._write_test_value()
        except ControllerRefused as error:
            yield Finding("writing", False, f"the service block cannot be written: {error}")
            return
        try:
            yield await self._echo()
            if not self._renumbered:
                if "word_order" not in self.changes and not self._echoless:
                    yield await self._tearing()
                if single := await self._cleared():
                    yield single
                longest_write = await self._longest_write(longest_read, readable)
                yield self._longest("write", longest_write, LONGEST_WRITE)
                yield self._window("writable", await self._writable(longest_write, longest_read, readable))
        except ControllerRefused as error:
            held = ()  # nothing but `transfer` was written
            yield Finding("writing", False, f"the contour block cannot be written: {error}")
        finally:
            as_before = await self._put_back(held, served, min(longest_write, longest_read))
        if not as_before:
            yield Finding("put back", False, "the contour block does not read as it did before. It is not committed")

    async def _obstacle(self) -> str | None:
        """Why nothing may be written now; None where it may."""
        before = await self.controller.read_service()
        if before.owner:
            await self.sleep(OWNER_WATCH_S)
            after = await self.controller.read_service()
            if after.service_heartbeat != before.service_heartbeat or after.owner != before.owner:
                return f"a service (owner {after.owner}) is alive on this controller. Stop it first"
        link = await self.controller.read_link()
        (reply,) = await self._run(read_registers(self.layout.contour_address, 1))
        (transfer,) = registers_of(reply)
        if link.session and transfer not in (0, link.ack_transfer):
            return f"page {transfer} is committed and not answered yet. Wait until it is, or stop the controller"
        return None

    async def _held(self, longest: int, readable: int) -> tuple[int, ...]:
        """The contour block without `transfer`, as it stands."""
        registers: tuple[int, ...] = ()
        for start, count in _pieces(readable - 1, longest):
            registers += await self._reads(read_registers(self.layout.contour_address + 1 + start, count))
        return registers

    async def _cleared(self) -> Finding | None:
        """Write `transfer` = 0, by the function that the controller knows; a finding where it is another one."""
        try:
            await self.controller.write_transfer(0)
        except ControllerRefused as error:
            if error.code != NO_SUCH_FUNCTION or self.controller.single_write == "fc16":
                raise
        else:
            return None
        self.controller.single_write = "fc16"
        await self.controller.write_transfer(0)
        self.changes["single_write"] = "fc16"
        return Finding("single write", False, "function code 6 is not known there; 16, of one register, is")

    async def _longest_write(self, longest_read: int, readable: int) -> int:
        most = min(LONGEST_WRITE, readable - 1)
        return await self._largest(most, lambda count: self._writes(1, _pattern(count, 1), longest_read))

    async def _writable(self, longest_write: int, longest_read: int, readable: int) -> int:
        """Registers of the contour block that read back as they were written, from its first on."""
        if not longest_write:
            return 0
        for start, count in _pieces(readable - 1, min(longest_write, longest_read)):
            offset = 1 + start
            if not await self._writes(offset, _pattern(count, offset), longest_read):
                works = lambda part, offset=offset: self._writes(offset, _pattern(part, offset), longest_read)  # noqa: E731
                return offset + await self._largest(count, works)
        return readable

    async def _writes(self, offset: int, registers: tuple[int, ...], longest_read: int) -> bool:
        """True where they can be written at `offset` of the contour block and read back alike."""
        first = self.layout.contour_address + offset
        try:
            await self._run(write_registers(first, stream_of(registers)))
        except ControllerRefused:
            return False
        except ControllerUnavailable:
            await self.controller.connect()
            return False
        read: tuple[int, ...] = ()
        for start, count in _pieces(len(registers), longest_read):
            read += await self._reads(read_registers(first + start, count))
        return read == registers

    async def _write_test_value(self) -> None:
        before = await self.controller.read_service()
        preoperational = 1  # so that the controller asks for nothing
        await self.controller.write_service(
            replace(before, protocol_version=1, service_state=preoperational, test_value=TEST_VALUE)
        )

    async def _echo(self) -> Finding:
        """How the controller computed `test_echo` from the value written."""
        layout = self.layout
        value = (await self.controller.read_service()).test_value
        if value != TEST_VALUE:
            text = f"test_value reads back as 0x{value:08X}, written was 0x{TEST_VALUE:08X}"
            step = "Let the controller's program and settings leave the service block to the service"
            return Finding("test_echo", False, f"{text}. {step}")
        until = self.now() + ECHO_WAIT_S
        ways: list[Signature] = []
        while not ways and self.now() < until:
            await self.sleep(LOOK_PERIOD_S)
            served = await self._reads(read_registers(layout.service_address, BLOCK_REGISTERS))
            known = {**dict(enumerate(served, start=layout.service_address)), **await self._look()}
            ways = from_echo(known, layout)
        self._echoless = not ways
        if not ways:
            text = "test_echo never became test_value + 1, in any order of words or numbering known here"
            return Finding("test_echo", False, f"{text}. Check that the controller's program runs and computes it")
        return self._judged("test_echo", ways[0], "is computed")

    async def _tearing(self) -> Finding:
        """Whether 32-bit values are seen half written: `test_echo` is, as it follows a value of other halves."""
        half_s, moved, beats, before = 0.0, False, set[int](), TEST_VALUE
        for value in (OTHER_VALUE, TEST_VALUE) * (TEAR_TURNS // 2):
            block = await self.controller.read_service()
            await self.controller.write_service(replace(block, test_value=value))
            until, torn_from = self.now() + ECHO_WAIT_S, None
            while (link := await self.controller.read_link()).test_echo != value + 1:
                if self.now() > until:
                    text = f"test_echo does not follow, from {before + 1} to {value + 1}. Compute it as a 32-bit number"
                    return Finding("32-bit values", False, text)
                if link.test_echo != before + 1:
                    torn_from = self.now() if torn_from is None else torn_from
                    beats.add(link.controller_heartbeat)
            if torn_from is not None:
                half_s = max(half_s, self.now() - torn_from)
                moved = moved or len(beats) > 1
            beats.clear()
            before = value
        if not half_s:
            return Finding("32-bit values", True, f"none was seen half written in {TEAR_TURNS} changes")
        text = f"they stand half written for up to {1000 * half_s:.0f} ms"
        if moved:
            return Finding("32-bit values", False, f"{text}, and the heartbeat moves meanwhile. Let it wait for them")
        return Finding("32-bit values", True, f"{text}, and the heartbeat waits for them, as it must")

    async def _put_back(self, held: tuple[int, ...], served: tuple[int, ...], longest: int) -> bool:
        """Write what stood there before, `transfer` stays 0; True where it reads back so."""
        alike = True
        if held and not self._renumbered:
            await self.controller.write_transfer(0)
            for start, count in _pieces(len(held), longest):
                alike = await self._writes(1 + start, held[start : start + count], longest) and alike
        await self._run(write_registers(self.layout.service_address, stream_of(served)))
        return alike


def _pieces(length: int, longest: int) -> Iterator[tuple[int, int]]:
    """Offset and count of the pieces of at most `longest` that make up `length`; none where `longest` is 0."""
    for start in range(0, length, longest) if longest else ():
        yield start, min(longest, length - start)


def _pattern(count: int, offset: int) -> tuple[int, ...]:
    """Registers that differ from their neighbours, halves and places: what is shifted, cut or swapped shows."""
    return tuple((0xA500 + 31 * (offset + number)) & 0xFFFF for number in range(count))
