"""A controller that is being probed: its registers as it gives them, and what is to be changed to meet it."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterator
from dataclasses import dataclass, field

from drivers.controller import ControllerError, ControllerRefused
from drivers.controller.mailbox.layout import MailboxLayout
from drivers.controller.mailbox.pages import HEADER_REGISTERS
from drivers.controller.modbus.client import ModbusController
from drivers.controller.modbus.requests import SHORTEST_LIMIT, Request, people, read_registers, registers_of
from service.check_result import CheckResult, fault, ok
from service.probing.link_signature import Registers, Signature

HEADER = 1 + HEADER_REGISTERS
NO_SUCH_REGISTER = 2  # exception code
LOOK_PERIOD_S = 0.25


@dataclass
class Probed:
    """changes: keys of the configuration's `controller`, and what they should be. sleep, now: s."""

    controller: ModbusController
    sleep: Callable[[float], Awaitable[None]]
    now: Callable[[], float]
    changes: dict[str, object] = field(default_factory=dict)
    trouble: ControllerError | None = None  # of the last read that failed

    @property
    def layout(self) -> MailboxLayout:
        """As configured."""
        return self.controller.layout

    @property
    def contour_registers(self) -> int:
        """The length of the contour block."""
        return HEADER + self.layout.payload_capacity

    @property
    def lacks_registers(self) -> bool:
        """True where the last read failed because the registers are not there."""
        return isinstance(self.trouble, ControllerRefused) and self.trouble.code == NO_SUCH_REGISTER

    @property
    def renumbered(self) -> bool:
        """True where the controller was seen to number registers otherwise than configured."""
        return "contour_address" in self.changes

    async def run(self, *requests: Request) -> list[bytes]:
        """The replies; after a request that was not answered the connection is opened anew."""
        if not self.controller.connected:
            await self.controller.connect()
        return await self.controller.run(requests)

    async def read(self, address: int, count: int) -> tuple[int, ...]:
        """The registers, () where the controller refuses them or does not answer."""
        try:
            (reply,) = await self.run(read_registers(address, count))
        except ControllerError as error:
            self.trouble = error
            return ()
        return registers_of(reply)

    async def reads_all(self, address: int, count: int) -> bool:
        """Whether all of them can be read in one request."""
        return len(await self.read(address, count)) == count

    async def look(self) -> Registers:
        """The link block and, where the controller lets it be read, one register on either side."""
        link = self.layout.link_address
        for first, end in ((link - 1, link + 17), (link, link + 17), (link, link + 16), (link + 1, link + 17)):
            registers = await self.read(first, end - first) if first >= 0 else ()
            if registers:
                return dict(enumerate(registers, start=first))
        return {}

    def longest(self, kind: str, count: int, most: int) -> CheckResult:
        """Whether the longest request that it takes is as long as one may be."""
        most = min(most, self.contour_registers)
        text = f"{count} registers in one request"
        if count >= most:
            return ok(f"longest {kind}", text)
        if count < SHORTEST_LIMIT:
            text += f", expected {SHORTEST_LIMIT} or more. Check contour_address, and what limits a request on its way"
            return fault(f"longest {kind}", text)
        self.changes[f"longest_{kind}"] = count
        return fault(f"longest {kind}", f"{text}, the standard's limit is {most}")

    def contour_block(self, kind: str, count: int) -> CheckResult:
        """Whether all of the contour block is readable or writable, of which `count` registers are."""
        whole, address = self.contour_registers, self.layout.contour_address
        if count >= whole:
            return ok(kind, f"the whole contour block, registers {people(address, whole)}")
        usable = (count - HEADER) // 2 * 2
        if usable < 8:
            text = f"{count} registers from {people(address, 1)} on, expected {whole}"
            if kind == "writable":
                step = "Nothing written reads back: let the controller's program and settings leave them to the service"
            else:
                step = "Set contour_address to where the controller has them"
            return fault(kind, f"{text}. {step}")
        self.changes["payload_capacity"] = min(usable, int(str(self.changes.get("payload_capacity", usable))))
        return fault(kind, f"the contour block up to register {people(address + count - 1, 1)}, not all of it")

    def seen(self, part: str, way: Signature, verb: str) -> CheckResult:
        """What a signature asks to be changed."""
        texts = []
        if way.shift:
            distance = "one register" if abs(way.shift) == 1 else f"{abs(way.shift)} registers"
            texts.append(f"it {verb} {distance} {self._shifted(way.shift)}")
        if way.word_order not in (None, self.layout.word_order):
            self.changes["word_order"] = way.word_order
            texts.append(f"32-bit values have the other order of words: {way.word_order}")
        if texts:
            return fault(part, "; ".join(texts))
        order = f", 32-bit values are {way.word_order}" if way.word_order else ""
        return ok(part, f"it {verb} where it should{order}")

    def _shifted(self, shift: int) -> str:
        """What another numbering asks to be changed, and in words."""
        addresses = {name: first + shift for name, (first, _) in self.layout.blocks.items()}
        if min(addresses.values()) < 0:
            return "below the configured 0, where no register is. Let its blocks begin one register later"
        part = addresses.pop("part_address", None)
        self.changes.update(addresses)
        if part is not None:
            self.changes["part_block"] = {"address": part, "capacity": self.layout.part_capacity}
        why = {1: ": the controller counts registers from 1", -1: ": the controller counts registers from 0"}
        return ("higher" if shift > 0 else "lower") + " than configured" + why.get(shift, "")


async def largest(most: int, works: Callable[[int], Awaitable[bool]]) -> int:
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


def pieces(length: int, longest: int) -> Iterator[tuple[int, int]]:
    """Offset and count of the pieces of at most `longest` that make up `length`; none where `longest` is 0."""
    for start in range(0, length, longest) if longest else ():
        yield start, min(longest, length - start)
