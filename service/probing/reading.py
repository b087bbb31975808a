"""What is found out of a controller by reads alone."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from statistics import median

from drivers.controller import ControllerNonsense, ControllerTimeout
from drivers.controller.mailbox.blocks import BLOCK_REGISTERS
from drivers.controller.modbus.requests import LONGEST_READ, people, read_registers
from service.check_result import CheckResult, fault, ok
from service.poll_timing import off_beat
from service.probing.link_signature import Registers, Signature, from_mailbox, from_movement
from service.probing.probed import LOOK_PERIOD_S, Probed, largest, pieces
from service.probing.register_search import SURVEY_S, survey

ROUND_TRIPS = 20
MOVEMENT_WATCH_S = 2.5  # a heartbeat changes at least once a second
NO_WAY_TO_IT = 10  # exception code
USUAL_UNITS = (255, 0, 1)  # over TCP: the device itself, by either name, and the first behind a gateway
MOST_PLACES = 32  # that may hold a mailbox


@dataclass
class ReadProbe:
    """Looks at a controller. timeout_s: as configured."""

    probed: Probed
    timeout_s: float
    _searched: int = 0  # registers, for a mailbox that is elsewhere

    async def link_block(self) -> tuple[int, ...]:
        """Its registers, () where they cannot be read."""
        return await self.probed.read(self.probed.layout.link_address, BLOCK_REGISTERS)

    async def another_unit(self) -> CheckResult | None:
        """The device id by which it answers, where it is another one; from here on it is asked by that."""
        controller, trouble = self.probed.controller, self.probed.trouble
        asked = controller.device_id
        found: int | None = None
        if isinstance(trouble, ControllerNonsense):
            found = trouble.answered_as
        elif isinstance(trouble, ControllerTimeout) or getattr(trouble, "code", None) == NO_WAY_TO_IT:
            others = [] if controller.serial else [unit for unit in USUAL_UNITS if unit != asked]
            found = await self._first_that_answers(others)
        controller.device_id = asked if found is None else found
        if found is None:
            self.probed.trouble = trouble
            return None
        self.probed.changes["device_id"] = found
        return fault("device id", f"it answers as {found}, asked was {asked}")

    async def _first_that_answers(self, units: list[int]) -> int | None:
        probed = self.probed
        for unit in units:
            probed.controller.device_id = unit
            await probed.controller.close()
            if await probed.read(probed.layout.link_address, 1) or probed.lacks_registers:
                return unit
        return None

    def block(self, name: str, address: int, registers: tuple[int, ...]) -> CheckResult:
        """Whether a block could be read."""
        span = people(address, BLOCK_REGISTERS)
        if registers:
            return ok(name, f"registers {span} can be read")
        if not self.probed.lacks_registers:
            return fault(name, f"registers {span} cannot be read: {self.probed.trouble}")
        key = name.replace(" block", "_address")
        return fault(name, f"registers {span} cannot be read. Set {key} to where the controller has them")

    async def round_trip(self) -> CheckResult:
        """How long a read takes, against the time-out."""
        took_ms = []
        for _ in range(ROUND_TRIPS):
            begun = self.probed.now()
            await self.probed.run(read_registers(self.probed.layout.link_address, BLOCK_REGISTERS))
            took_ms.append(1000 * (self.probed.now() - begun))
        text = f"{median(took_ms):.1f} ms, {max(took_ms):.1f} ms at most in {ROUND_TRIPS} reads"
        if max(took_ms) > 1000 * self.timeout_s / 3:
            wanted = round(max(0.1, 5 * max(took_ms) / 1000), 1)
            self.probed.changes["timeout_s"] = wanted
            return fault("round trip", f"{text}, too near to timeout_s, {self.timeout_s:g}")
        return ok("round trip", text)

    async def longest_read(self) -> int:
        """Most registers in one request."""
        most = min(LONGEST_READ, self.probed.contour_registers)
        return await largest(most, partial(self.probed.reads_all, self.probed.layout.contour_address))

    async def readable(self, longest: int) -> int:
        """Registers of the contour block that can be read, from its first on."""
        for start, count in pieces(self.probed.contour_registers, longest):
            first = self.probed.layout.contour_address + start
            if not await self.probed.reads_all(first, count):
                return start + await largest(count, partial(self.probed.reads_all, first))
        return self.probed.contour_registers if longest else 0

    async def part_block(self, address: int, longest: int) -> CheckResult:
        """Whether all of the part block can be read."""
        count = self.probed.layout.blocks["part_address"][1] - address
        for start, length in pieces(count, longest) if longest else ():
            if not await self.probed.reads_all(address + start, length):
                text = f"registers {people(address + start, length)} of {people(address, count)} cannot be read"
                return fault("part block", f"{text}. Set part_block.address to where the controller has them")
        return ok("part block", f"registers {people(address, count)} can be read")

    async def movement(self) -> list[Signature]:
        """Every way of seeing the mailbox in which its heartbeat moves where it is configured, or next to it."""
        looks: list[Registers] = []
        until = self.probed.now() + MOVEMENT_WATCH_S
        while self.probed.now() < until:
            looks.append(await self.probed.look())
            # A heartbeat of one bit that changes in step with looks at equal distances seems to stand still.
            await self.probed.sleep(off_beat(len(looks)) * LOOK_PERIOD_S)
        return from_movement(looks, self.probed.layout)

    async def elsewhere(self) -> list[Signature]:
        """How the mailbox is seen at the one place in all registers where it is and its heartbeat moves, else []."""
        probed, layout = self.probed, self.probed.layout
        until = probed.now() + SURVEY_S
        known = await survey(probed.read, LONGEST_READ, layout.link_address, lambda: probed.now() < until)
        self._searched = len(known)
        ways = from_mailbox(known, layout)[:MOST_PLACES]
        blocks = [layout.link_address + way.shift for way in ways]
        looks: list[Registers] = []
        watched_until = probed.now() + MOVEMENT_WATCH_S
        while blocks and probed.now() < watched_until:
            looks.append({block + n: value for block in blocks for n, value in enumerate(await probed.read(block, 16))})
            await probed.sleep(off_beat(len(looks)) * LOOK_PERIOD_S)
        moving = from_movement(looks, layout, [way.shift for way in ways]) if looks else []
        return [way for way in ways if len(moving) == 1 and way.shift == moving[0].shift]

    def heartbeat(self, ways: list[Signature]) -> CheckResult:
        """Whether the heartbeat moves where it should."""
        if not ways:
            text = (
                "nothing moves where the heartbeat should be, and no mailbox whose heartbeat moves is in the "
                f"{self._searched} registers that can be read: the controller's program does not run, or does not fill "
                "the link block. A controller that cannot answer at all takes handshake: none"
            )
            return fault("heartbeat", text)
        return self.probed.seen("heartbeat", ways[0], "moves")
