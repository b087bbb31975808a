"""The simulated controller's program: what the protocol says that a controller does, one scan a call. No I/O."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import IntEnum

from drivers.controller.errors import ControllerError
from drivers.controller.mailbox.layout import MailboxLayout
from drivers.controller.simulated import parts
from drivers.controller.simulated.contour import HEADER, AcceptedContour, Assembly, Contradiction, PageCopy, u32
from drivers.controller.simulated.memory import RetainedMemory
from drivers.controller.simulated.parts import PartCopy
from drivers.controller.simulated.watch import ClientWatch, ring_fault

MODULUS = 1 << 32


class Reply(IntEnum):
    """`ack_result`, as the protocol numbers the answers."""

    ACCEPTED = 1
    BAD_CRC = 2
    BAD_LAYOUT = 3
    GEOMETRY_REFUSED = 4
    EXPIRED = 5
    ACCEPTED_BEFORE = 6
    OPERATOR_REFUSED = 7
    OUTDATED = 8
    PAGE_MISSING = 9
    NOT_READY = 10
    WITHDRAWN = 11


FINAL = frozenset({Reply.ACCEPTED, Reply.GEOMETRY_REFUSED, Reply.EXPIRED, Reply.OPERATOR_REFUSED, Reply.WITHDRAWN})
SERVICE_READY = 5
READY, NOT_READY_STATE = 1, 0
LAST_JOB = 10  # its offset in the link block

Judge = Callable[[AcceptedContour], int]


class TriggerNotPossible(ControllerError):
    """The protocol does not let the controller request a measurement now."""


@dataclass(frozen=True)
class Pace:
    """How many scans the program takes for a page, within what the protocol allows.

    copy_scans: copying header and payload, a part a scan: what is written meanwhile makes a torn copy.
    check_scans: from the copy to the answer. stepwise: the fields of an answer are written one a scan.
    torn: `last_job`, `test_echo` and `clock` stand half written for a scan wherever both of their registers change.
    """

    copy_scans: int = 1
    check_scans: int = 0
    stepwise: bool = False
    torn: bool = False


@dataclass(frozen=True)
class ProgramStart:
    """What the program is given at its start.

    new_session: makes its session. judge: 1, 4 or 7 for a contour that is otherwise in order.
    has_clock, clock_start_ms: whether `clock` runs, and from where. first_trigger: the first `trigger_counter`.
    """

    new_session: Callable[[], int]
    judge: Judge
    has_clock: bool = True
    clock_start_ms: int = 0
    first_trigger: int = 1


class ControllerProgram:
    """One run of the controller's program over its registers, from the start sequence on.

    registers: all holding registers, changed in place. state: `controller_state` from the next scan on.
    pace: see Pace; it may be changed between scans.
    """

    def __init__(
        self,
        registers: list[int],
        layout: MailboxLayout,
        memory: RetainedMemory,
        watch: ClientWatch,
        start: ProgramStart,
        pace: Pace | None = None,
    ) -> None:
        self.state = READY
        self.pace = pace or Pace()
        self.answered: list[tuple[PageCopy, int]] = []
        self._registers = registers
        self._layout = layout
        self._memory = memory
        self._watch = watch
        self._startup = start
        self._scans = 0
        self._copied: list[int] = []
        self._to_copy: list[int] = []
        self._part_copy: PartCopy | None = None
        self._checks_left = 0
        self._to_write: deque[dict[int, int]] = deque()
        self._second_halves: dict[int, int] = {}
        self._session = 0
        self._clock = 0
        self._assembly = Assembly()
        self._service_before: tuple[int, ...] | None = None
        self._service: tuple[int, ...] | None = None
        self._trigger_open = False
        self._job_of_trigger: int | None = None

    # --- registers ----------------------------------------------------------------------------------------------

    def _link(self, offset: int) -> int:
        return self._registers[self._layout.link_address + offset]

    def _set(self, offset: int, value: int) -> None:
        self._registers[self._layout.link_address + offset] = value & 0xFFFF

    def _set32(self, offset: int, value: int) -> None:
        first, second = self._words(value)
        self._set(offset, first)
        self._set(offset + 1, second)

    def _write32(self, offset: int, value: int) -> None:
        """The same, in two scans where the program is one that tears it."""
        first, second = self._words(value)
        torn = self.pace.torn and first != self._link(offset) and second != self._link(offset + 1)
        self._set(offset, first)
        if torn:
            self._second_halves[offset + 1] = second
        else:
            self._set(offset + 1, second)

    @property
    def _half_written(self) -> bool:
        """True while `last_result` stands there without its `last_job`, during which the heartbeat may not change."""
        return bool(self._to_write) and LAST_JOB in self._to_write[0]

    def _words(self, value: int) -> tuple[int, int]:
        high, low = value >> 16 & 0xFFFF, value & 0xFFFF
        return (high, low) if self._layout.word_order == "big" else (low, high)

    @property
    def _last_job(self) -> int:
        start = self._layout.link_address
        return u32(self._registers[start : start + 16], 10, self._layout.word_order)

    def _service_registers(self) -> tuple[int, ...]:
        start = self._layout.service_address
        return tuple(self._registers[start : start + 16])

    # --- the scan -----------------------------------------------------------------------------------------------

    def scan(self, run_ms: int) -> AcceptedContour | None:
        """One scan, `run_ms` after the program's start; the contour that it accepted, if it did."""
        self._scans += 1
        while self._second_halves:
            self._set(*self._second_halves.popitem())
        if self._scans <= 3:
            self._start()
            return None
        if not self._half_written:
            self._set(1, self._link(1) + 1)
        self._set(0, self.state)
        if self._startup.has_clock:
            self._clock = (self._startup.clock_start_ms + run_ms) % MODULUS
            self._write32(14, self._clock)
        self._look_at_service()
        return self._look_at_contour()

    def _start(self) -> None:
        """The start sequence, in three scans, so that a client can see each step of it."""
        if self._scans == 1:
            for offset in range(16):
                self._set(offset, 0)
        elif self._scans == 2:
            self._set(12, self._memory.last_result)
            self._write32(10, self._memory.last_job)
        else:
            self._session = self._startup.new_session()
            self._set(13, self._session)

    def _look_at_service(self) -> None:
        block = self._service_registers()
        self._write32(8, u32(block, 8, self._layout.word_order) + 1)
        # Heartbeat (2) and test_value (8, 9) may differ between the two scans that must agree.
        seen = tuple(value for offset, value in enumerate(block) if offset not in (2, 8, 9))
        self._service = block if seen == self._service_before else None
        self._service_before = seen
        self._follow_trigger()

    # --- triggers -----------------------------------------------------------------------------------------------

    @property
    def session(self) -> int:
        """This run's session, 0 while the program starts."""
        return self._session

    @property
    def trigger_open(self) -> bool:
        """True from a request for a measurement until its contour got a final answer, or there will be none."""
        return self._trigger_open

    @property
    def can_request(self) -> bool:
        """True while the protocol lets this controller request a measurement."""
        return self._service is not None and self._service[1] == SERVICE_READY and not self._trigger_open

    def request_measurement(self, recipe: int = 0, thickness_um: int = 0, *, force: bool = False) -> int:
        """Write recipe and thickness, then the next `trigger_counter`, and return it.

        TriggerNotPossible: the service is not Ready, or a trigger is open. force: do it all the same, as a controller
        that ignores the rule would.
        """
        if self._session == 0 or (not force and not self.can_request):
            raise TriggerNotPossible(
                "no measurement can be requested: the service is not Ready, or a trigger is open. Wait for can_request"
            )
        self._set(3, recipe)
        self._set32(4, thickness_um)
        counter = self._link(2) % 0xFFFF + 1 if self._link(2) else self._startup.first_trigger
        self._set(2, counter)
        self._trigger_open, self._job_of_trigger = True, None
        return counter

    def _follow_trigger(self) -> None:
        if not self._trigger_open or self._service is None:
            return
        order = self._layout.word_order
        if self._job_of_trigger is None and (self._service[3], self._service[10]) == (self._link(2), self._session):
            self._job_of_trigger = u32(self._service, 6, order)
        if self._job_of_trigger is not None and u32(self._service, 12, order) >= self._job_of_trigger:
            self._trigger_open = False

    # --- the contour block --------------------------------------------------------------------------------------

    def _look_at_contour(self) -> AcceptedContour | None:
        if self._to_write:
            self._write_answer()
            return None
        block = self._copy()
        if block is None:
            return None
        copy = PageCopy(block, self._layout.word_order)
        reply, contour = self._reply(copy)
        if reply in FINAL and copy.job_id > self._last_job and (contour or reply != Reply.ACCEPTED):
            self._memory.keep_answer(copy.job_id, reply, contour)
            self._to_write += [{12: reply}, {LAST_JOB: copy.job_id}]
            self._assembly.drop()
            if copy.trigger and copy.trigger == self._link(2):
                self._trigger_open = False
        self._to_write += [{7: reply}, {6: copy.transfer}]
        self.answered.append((copy, reply))
        self._write_answer()
        return contour

    def _copy(self) -> list[int] | None:
        """The page as copied, once the last share of it was, and checked for long enough; else None."""
        start, end = self._layout.blocks["contour_address"]
        if not self._copied and self._registers[start] in (0, self._link(6)):
            return None
        if not self._copied:
            page = range(start, min(start + HEADER + self._registers[start + 7], end))
            self._to_copy = [*page, *self._part_registers()]
        if len(self._copied) < len(self._to_copy):
            share = -(-len(self._to_copy) // max(1, self.pace.copy_scans))
            here = len(self._copied)
            self._copied += [self._registers[address] for address in self._to_copy[here : here + share]]
            self._checks_left = self.pace.check_scans
            if len(self._copied) < len(self._to_copy):
                return None
        if self._checks_left > 0:
            self._checks_left -= 1
            return None
        block, self._copied = self._copied, []
        return self._without_part(block)

    def _part_registers(self) -> range:
        """Addresses of the part block, as long as it says that it is; none where the controller has no such block."""
        address = self._layout.part_address
        if address is None:
            return range(0)
        end = self._layout.blocks["part_address"][1]
        return range(address, min(address + parts.HEADER + self._registers[address + parts.LENGTH], end))

    def _without_part(self, block: list[int]) -> list[int]:
        """The page of what was copied; the part block behind it is put aside."""
        if self._layout.part_address is None:
            return block
        length = next(k for k, address in enumerate(self._to_copy) if address == self._layout.part_address)
        self._part_copy = PartCopy(block[length:], self._layout.word_order)
        return block[:length]

    def _write_answer(self) -> None:
        """Write the next field of the answer, or all up to one that is torn, in the protocol's order."""
        while self._to_write:
            for offset, value in self._to_write.popleft().items():
                (self._write32 if offset == LAST_JOB else self._set)(offset, value)
            if self.pace.stepwise or self._second_halves:
                return

    def _reply(self, copy: PageCopy) -> tuple[int, AcceptedContour | None]:
        """The first answer that holds, in the protocol's order; with an acceptance of the last page the contour."""
        if copy.payload_length > self._layout.payload_capacity:
            return Reply.BAD_LAYOUT, None
        if not copy.crc_is_right():
            return Reply.BAD_CRC, None
        self._watch.page(copy, self._service_registers(), self._session)
        early = self._reply_before_geometry(copy)
        return (early, None) if early is not None else self._reply_to_geometry(copy)

    def _reply_before_geometry(self, copy: PageCopy) -> int | None:  # noqa: PLR0911 - one line an answer, in order
        if copy.layout not in (0, 1):
            return Reply.BAD_LAYOUT
        if copy.session != self._session or copy.job_id < self._last_job:
            return Reply.OUTDATED
        if copy.job_id == self._last_job:
            # job_id is never 0; one that is 0 all the same meets last_job 0, which has no answer to repeat.
            return {0: Reply.BAD_LAYOUT, 1: Reply.ACCEPTED_BEFORE}.get(self._link(12), self._link(12))
        if copy.layout == 0:
            return Reply.WITHDRAWN
        if self._expired(copy):
            return Reply.EXPIRED
        if self.state != READY:
            return Reply.NOT_READY
        return None

    def _expired(self, copy: PageCopy) -> bool:
        age = (self._clock - copy.captured_at) % MODULUS
        if age > copy.valid_for > 0:
            return True
        return copy.trigger != self._link(2) if copy.trigger else self._trigger_open

    def _reply_to_geometry(self, copy: PageCopy) -> tuple[int, AcceptedContour | None]:
        place = self._assembly.place(copy)
        if place == "missing":
            return Reply.PAGE_MISSING, None
        if place == "held":
            return Reply.ACCEPTED, None
        own = self._part_copy if copy.page == copy.page_count else None
        if own is not None and not own.belongs_to(copy):
            return Reply.BAD_CRC, None
        try:
            placed = None if own is None else own.parts()
            contour = self._assembly.take(copy)
        except Contradiction as contradiction:
            self._watch.contradiction(copy, str(contradiction))
            return Reply.BAD_LAYOUT, None
        if contour is None:
            return Reply.ACCEPTED, None
        contour = replace(contour, parts=placed)
        self._watch.contour(contour)
        verdict = self._startup.judge(contour)
        return verdict, contour if verdict == Reply.ACCEPTED else None


def judge_by_geometry(contour: AcceptedContour) -> int:
    """4 for rings that repeat a vertex or run the wrong way round, else 1."""
    return Reply.GEOMETRY_REFUSED if any(map(ring_fault, contour.rings, range(len(contour.rings)))) else Reply.ACCEPTED
