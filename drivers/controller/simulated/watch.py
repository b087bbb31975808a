"""The simulated controller's eye on its client: every write and every page, held against the protocol."""

from __future__ import annotations

from collections.abc import Sequence

from drivers.controller.mailbox.layout import REGISTERS, MailboxLayout
from drivers.controller.simulated.contour import HEADER, AcceptedContour, PageCopy, signed_area_mm2, u32
from drivers.controller.simulated.parts import HEADER as PART_HEADER
from drivers.controller.simulated.parts import PartCopy, may_be_cut
from drivers.controller.simulated.verdict import Verdict

HEARTBEAT_LIMIT_S = 1.0
OWNER_PAUSE_S = 3.0  # so long a foreign service watches before it takes over
LONGEST_WRITE = 123
TEST_VALUE = 16909060
# Header offsets at which a request may begin or end: between values, and not within an x,y pair of the bounding box.
HEADER_CUTS = frozenset({1, 2, 4, 5, 6, 7, 8, 10, 12, 16, 20, 22, 24, 26, 27, 28, 30, 31, 32})


class ClientWatch:
    """Notes in `verdict` what the client does against the protocol; it changes nothing and answers nothing."""

    def __init__(self, layout: MailboxLayout, verdict: Verdict, *, write_single: bool = True) -> None:
        """write_single: `transfer` is to be written by FC6; else by an FC16 of this one register."""
        self._write_single = write_single
        self._layout = layout
        self._verdict = verdict
        self._connections = 0
        self._beat: int | None = None
        self._beat_at = 0.0
        self._stalled = False
        self._cuts: set[int] = set()
        self._last_transfer = 0
        self._last_content: tuple[int, ...] = ()
        self._highest_job = 0
        self._job = 0
        self._job_session = 0
        self._pages: dict[int, tuple[int, ...]] = {}
        self._lost_write: str | None = None
        self._transfer: int | None = None  # as the client wrote it: late writes of the line's are not its own
        self._service: tuple[int, ...] | None = None
        self._service_at_commit: tuple[int, ...] | None = None
        self._part_cuts: set[int] = set()
        self._page: dict[int, int] = {}  # offsets and values that the client wrote since it cleared `transfer`
        self._owner = 0
        self._owner_at = 0.0
        self._settled = 0
        self._acknowledged = (0, 0)
        self._counters: tuple[int, set[int]] = (0, set())

    # --- connection and heartbeat -------------------------------------------------------------------------------

    def connection(self, up: bool) -> None:
        """A client came or went: the pause between its heartbeats starts anew."""
        self._connections += 1 if up else -1
        self._beat = None

    def excuse(self) -> None:
        """A fault was done to the client: the pause between its heartbeats starts anew."""
        self._beat = None

    def tick(self, now: float, session: int, trigger_counter: int) -> None:
        """Look for a heartbeat that stands still. A serial line shows no connections, so there it is not judged."""
        self.issued(session, trigger_counter)
        if self._connections > 0 and self._beat is not None and now - self._beat_at > HEARTBEAT_LIMIT_S:
            self._gap(now - self._beat_at)

    def _heard_beat(self, beat: int, now: float) -> None:
        if beat == self._beat:
            return
        if self._beat is not None and self._connections > 0:
            self._gap(now - self._beat_at)
        self._beat, self._beat_at, self._stalled = beat, now, False

    def _gap(self, seconds: float) -> None:
        self._verdict.longest_heartbeat_gap_s = max(self._verdict.longest_heartbeat_gap_s, seconds)
        if seconds > HEARTBEAT_LIMIT_S and not self._stalled:
            self._stalled = True
            self._verdict.note("heartbeat-stalled", f"service_heartbeat {self._beat} for {seconds:.2f} s and more")

    # --- requests -----------------------------------------------------------------------------------------------

    def unanswered(self, function_code: int, address: int) -> None:
        """A request's reply never leaves: of contour and part block, only `transfer` = 0 may be written next."""
        of_page = (block for name, block in self._layout.blocks.items() if name in ("contour_address", "part_address"))
        if function_code != 3 and any(start <= address < end for start, end in of_page):
            self._lost_write = f"FC{function_code} at {address}"

    def too_early(self, function_code: int) -> None:
        """A request on a connection that owes a reply."""
        self._verdict.note("too-early", f"FC{function_code} while the reply to the request before is outstanding")

    def too_long(self, address: int, count: int) -> None:
        """An FC16 beyond the standard's limit; it was refused."""
        self._verdict.note("request-too-long", f"{count} registers at {address}, {LONGEST_WRITE} at most")

    def foreign_function(self, function_code: int) -> None:
        """A function code that the protocol does not use; it was refused."""
        self._verdict.note("function-code", f"function code {function_code}")

    def write(self, function_code: int, address: int, values: Sequence[int], held: Sequence[int], now: float) -> bool:
        """Judge a write before it is stored; `held` are all registers. False where it is to be refused."""
        end = address + len(values)
        service, service_end = self._layout.blocks["service_address"]
        contour, contour_end = self._layout.blocks["contour_address"]
        part, part_end = self._layout.blocks.get("part_address", (REGISTERS, REGISTERS))
        if service <= address and end <= service_end:
            self._service_write(function_code, address, values, held, now)
        elif contour <= address and end <= contour_end:
            self._contour_write(function_code, address - contour, values, held)
        elif part <= address and end <= part_end:
            self._part_write(function_code, address - part, values, held)
        else:
            self._verdict.note(
                "outside-blocks", f"FC{function_code} of {len(values)} registers at {address}", address, values
            )
            return False
        return True

    def _service_write(
        self, function_code: int, address: int, values: Sequence[int], held: Sequence[int], now: float
    ) -> None:
        if function_code != 16 or len(values) != 16:
            text = f"FC{function_code} of {len(values)} registers at {address}"
            self._verdict.note("service-block-partial", text, address, values)
            return
        self._service = tuple(values)
        self._trigger_acknowledged(values, held)
        self._owned(values, now)
        self._heard_beat(values[2], now)
        test_value = u32(values, 8, self._layout.word_order)
        for name, seen, right in (
            ("protocol_version", values[0], values[0] == 1),
            ("service_state", values[1], 1 <= values[1] <= 7),
            ("test_value", test_value, test_value == TEST_VALUE),
            ("the reserved part", values[14:16], not any(values[14:16])),
        ):
            if not right:
                self._verdict.note("service-block-content", f"{name} is {seen}", address, values)

    def _trigger_acknowledged(self, values: Sequence[int], held: Sequence[int]) -> None:
        link = self._layout.link_address
        session, counter = held[link + 13], held[link + 2]
        if session and values[10] == session and values[3] not in self.issued(session, counter):
            text = f"trigger_ack {values[3]} of session {session}, whose trigger_counter is {counter}"
            self._verdict.note("unknown-trigger-acknowledged", text, self._layout.service_address, values)
        acknowledged = (session, values[3])
        if session and values[10] == session and values[3] and acknowledged != self._acknowledged:
            self._acknowledged = acknowledged
            job = u32(values, 6, self._layout.word_order)
            self._verdict.tell("acknowledged", session=session, trigger=values[3], job=job)

    def issued(self, session: int, counter: int) -> set[int]:
        """Note that `trigger_counter` had this value; all that it had in this session."""
        if self._counters[0] != session:
            self._counters = (session, set())
        self._counters[1].add(counter)
        return self._counters[1]

    def _owned(self, values: Sequence[int], now: float) -> None:
        owner, job = values[11], u32(values, 6, self._layout.word_order)
        settled = u32(values, 12, self._layout.word_order)
        if owner != self._owner:
            if self._owner and owner and now - self._owner_at < OWNER_PAUSE_S:
                text = f"owner {owner} after {self._owner}, {now - self._owner_at:.1f} s later"
                self._verdict.note("second-service", text, self._layout.service_address, values)
        elif settled < self._settled or (owner and settled > job):
            text = f"settled_job {settled} after {self._settled}, job_id {job}"
            self._verdict.note("settled-went-down", text, self._layout.service_address, values)
        self._owner, self._owner_at, self._settled = owner, now, settled

    def _contour_write(self, function_code: int, offset: int, values: Sequence[int], held: Sequence[int]) -> None:
        contour = self._layout.contour_address
        transfer = held[contour] if self._transfer is None else self._transfer
        alone = function_code == 6 or (len(values) == 1 and not self._write_single)
        if not (offset == 0 and alone and values[0] == 0):
            self._went_on(function_code, contour + offset, values)
        self._lost_write = None
        if offset == 0:
            if alone:
                self._commit(values[0], transfer, held)
                self._transfer = values[0]
            else:
                text = f"FC{function_code} of {len(values)} registers from transfer on"
                self._verdict.note("transfer-not-alone", text, contour, values)
            return
        if function_code == 6:
            self._verdict.note("page-by-single-registers", f"FC6 at offset {offset}", contour + offset, values)
        if transfer != 0:
            text = f"offset {offset} while transfer was {transfer}"
            self._verdict.note("written-while-valid", text, contour + offset, values)
        self._cuts |= {offset, offset + len(values)}
        self._page |= dict(enumerate(values, start=offset))

    def _went_on(self, function_code: int, address: int, values: Sequence[int]) -> None:
        if self._lost_write:
            text = f"FC{function_code} at {address}, after the unanswered {self._lost_write}"
            self._verdict.note("went-on-after-lost-reply", text, address, values)

    def _part_write(self, function_code: int, offset: int, values: Sequence[int], held: Sequence[int]) -> None:
        """The part block is written as a page is: by FC16, with `transfer` 0, no value over two requests."""
        address = self._layout.blocks["part_address"][0] + offset
        transfer = held[self._layout.contour_address] if self._transfer is None else self._transfer
        self._went_on(function_code, address, values)
        self._lost_write = None
        if function_code != 16:
            self._verdict.note("page-by-single-registers", f"FC{function_code} in the part block", address, values)
        if transfer != 0:
            text = f"part block's offset {offset} while transfer was {transfer}"
            self._verdict.note("written-while-valid", text, address, values)
        self._part_cuts |= {offset, offset + len(values)}

    def _commit(self, transfer: int, before: int, held: Sequence[int]) -> None:
        if transfer == 0:
            self._cuts, self._page, self._part_cuts = set(), {}, set()
            return
        layout = self._layout
        block = held[layout.contour_address : layout.blocks["contour_address"][1]]
        copy = PageCopy(block, layout.word_order)
        if before != 0:
            self._verdict.note("commit-without-clearing", f"transfer {transfer} over {before}")
        acknowledged = held[layout.link_address + 6]
        own = self._is_own(copy)
        if own and transfer == self._last_transfer and copy.content != self._last_content:
            self._verdict.note("transfer-reused", f"transfer {transfer}, job {copy.job_id} page {copy.page}")
        elif copy.session != 0 and transfer in (self._last_transfer, acknowledged):
            self._verdict.note("transfer-not-new", f"transfer {transfer}, ack_transfer {acknowledged}")
        self._last_transfer, self._last_content = transfer, copy.content
        self._service_at_commit = self._service
        split = sorted(cut for cut in self._cuts if not _may_be_cut(cut, copy))
        if (
            split and own and copy.layout in (0, 1) and copy.job_id
        ):  # job 0: the program has restarted and cleared the page in between
            self._verdict.note("value-split", f"requests begin or end at offsets {split} of job {copy.job_id}")
        self._judge_part_cuts(held, copy)

    def _judge_part_cuts(self, held: Sequence[int], page: PageCopy) -> None:
        if not self._part_cuts:
            return
        start, end = self._layout.blocks["part_address"]
        block = held[start : min(start + PART_HEADER + held[start + 5], end)]
        split = sorted(cut for cut in self._part_cuts if not may_be_cut(cut, block))
        if split and PartCopy(block, self._layout.word_order).belongs_to(page):
            self._verdict.note("value-split", f"part block: requests begin or end at offsets {split}")

    def _is_own(self, copy: PageCopy) -> bool:
        """True where the page is as the client wrote it, not spoilt by late writes and restarts."""
        registers = dict(enumerate(copy.registers))
        return all(registers.get(offset, value) == value for offset, value in self._page.items())

    # --- pages --------------------------------------------------------------------------------------------------

    def page(self, copy: PageCopy, service_block: Sequence[int], session: int) -> None:
        """Judge a page whose CRC is right; `service_block` as it stands now, `session` the controller's."""
        service_block = self._service_at_commit or service_block
        if not self._is_own(copy) or (self._last_transfer and copy.transfer != self._last_transfer):
            return
        if copy.job_id == 0 or copy.job_id < self._highest_job:
            self._verdict.note("job-went-down", f"job {copy.job_id} after job {self._highest_job}")
        if copy.job_id != self._job:
            self._job, self._job_session, self._pages = copy.job_id, copy.session, {}
        self._highest_job = max(self._highest_job, copy.job_id)
        if copy.session != self._job_session:
            self._verdict.note(
                "job-in-two-sessions", f"job {copy.job_id} in sessions {self._job_session} and {copy.session}"
            )
        if copy.layout == 0:
            self._withdrawal(copy)
            return
        before = self._pages.setdefault(copy.page, copy.content)
        if before != copy.content:
            self._verdict.note("content-changed", f"job {copy.job_id} page {copy.page}")
        own = copy.session == session  # a page of an earlier session is answered 8, whatever it says of triggers
        if own and copy.trigger and (service_block[3], service_block[10]) != (copy.trigger, session):
            self._verdict.note(
                "contour-before-acknowledgement",
                f"job {copy.job_id} for trigger {copy.trigger} of session {session}, "
                f"acknowledged is {service_block[3]} of session {service_block[10]}",
            )
        last, holes = copy.page == copy.page_count, copy.ring_count > 1
        if copy.flags >> 4 or bool(copy.flags & 2) != holes or bool(copy.flags & 4) != last:
            self._verdict.note(
                "contradictory-page",
                f"flags {copy.flags:04b} on page {copy.page} of {copy.page_count}, {copy.ring_count} rings",
            )

    def _withdrawal(self, copy: PageCopy) -> None:
        meant = {2, 3, 8, 9, 30}
        filled = [offset for offset in range(1, HEADER) if offset not in meant and copy.registers[offset]]
        if filled:
            self._verdict.note("withdrawal-not-empty", f"job {copy.job_id}: offsets {filled} are not 0")

    def contradiction(self, copy: PageCopy, text: str) -> None:
        """A page that was answered 3 for what it holds."""
        self._verdict.note("contradictory-page", f"job {copy.job_id}: {text}")

    def contour(self, contour: AcceptedContour) -> None:
        """Judge a whole contour: orientation, repeated vertices, area (to 1 %: it is a mistaken unit that counts)."""
        for number, ring in enumerate(contour.rings):
            fault = ring_fault(ring, number)
            if fault:
                self._verdict.note("contradictory-page", f"job {contour.job_id}: {fault}")
        area = sum(signed_area_mm2(ring) for ring in contour.rings)
        if abs(area - contour.area_mm2) > 1 + 0.01 * abs(area):
            self._verdict.note(
                "contradictory-page", f"job {contour.job_id}: area {contour.area_mm2} mm², the rings hold {area:.1f}"
            )


def ring_fault(ring: Sequence[tuple[float, float]], number: int) -> str | None:
    """Why the ring is none of the protocol's: it repeats a vertex, or runs the wrong way round; None where it is."""
    if any(a == b for a, b in zip(ring, [*ring[1:], ring[0]], strict=True)):
        return f"ring {number} repeats a vertex"
    area = signed_area_mm2(ring)
    if (area > 0) != (number == 0) or area == 0:
        return f"ring {number} has the signed area {area:g} mm²"
    return None


def _may_be_cut(offset: int, copy: PageCopy) -> bool:
    """True where no value of the page lies on both sides of `offset`."""
    if offset <= HEADER:
        return offset in HEADER_CUTS
    table_end = HEADER + (2 * copy.ring_count if copy.page == 1 and copy.layout == 1 else 0)
    if offset <= table_end:
        return offset % 2 == 0
    return (offset - table_end) % 4 == 0
