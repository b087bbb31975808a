"""The simulated controller's eye on its client: every write and every page, held against the protocol."""

from __future__ import annotations

from collections.abc import Sequence

from drivers.controller.layout import MailboxLayout
from drivers.controller.simulated_contour import HEADER, AcceptedContour, PageCopy, signed_area_mm2, u32
from drivers.controller.simulated_verdict import Verdict

HEARTBEAT_LIMIT_S = 1.0
LONGEST_WRITE = 123
TEST_VALUE = 16909060
# Header offsets at which a request may begin or end: between values, and not within an x,y pair of the bounding box.
HEADER_CUTS = frozenset({1, 2, 4, 5, 6, 7, 8, 10, 12, 16, 20, 22, 24, 26, 27, 28, 30, 31, 32})


class ClientWatch:
    """Notes in `verdict` what the client does against the protocol; it changes nothing and answers nothing."""

    def __init__(self, layout: MailboxLayout, verdict: Verdict) -> None:
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

    # --- connection and heartbeat -------------------------------------------------------------------------------

    def connection(self, up: bool) -> None:
        """A client came or went: the pause between its heartbeats starts anew."""
        self._connections += 1 if up else -1
        self._beat = None

    def tick(self, now: float) -> None:
        """Look for a heartbeat that stands still. A serial line shows no connections, so there it is not judged."""
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
        if service <= address and end <= service_end:
            self._service_write(function_code, address, values, now)
        elif contour <= address and end <= contour_end:
            self._contour_write(function_code, address - contour, values, held)
        else:
            self._verdict.note("outside-blocks", f"FC{function_code} of {len(values)} registers at {address}")
            return False
        return True

    def _service_write(self, function_code: int, address: int, values: Sequence[int], now: float) -> None:
        if function_code != 16 or len(values) != 16:
            self._verdict.note("service-block-partial", f"FC{function_code} of {len(values)} registers at {address}")
            return
        self._heard_beat(values[2], now)
        test_value = u32(values, 8, self._layout.word_order)
        for name, seen, right in (
            ("protocol_version", values[0], values[0] == 1),
            ("service_state", values[1], 1 <= values[1] <= 7),
            ("test_value", test_value, test_value == TEST_VALUE),
            ("the reserved part", values[14:16], not any(values[14:16])),
        ):
            if not right:
                self._verdict.note("service-block-content", f"{name} is {seen}")

    def _contour_write(self, function_code: int, offset: int, values: Sequence[int], held: Sequence[int]) -> None:
        contour = self._layout.contour_address
        transfer = held[contour]
        if offset == 0:
            if function_code == 6:
                self._commit(values[0], held)
            else:
                self._verdict.note(
                    "transfer-not-alone", f"FC{function_code} of {len(values)} registers from transfer on"
                )
            return
        if function_code == 6:
            self._verdict.note("page-by-single-registers", f"FC6 at offset {offset}")
        if transfer != 0:
            self._verdict.note("written-while-valid", f"offset {offset} while transfer was {transfer}")
        self._cuts |= {offset, offset + len(values)}

    def _commit(self, transfer: int, held: Sequence[int]) -> None:
        if transfer == 0:
            self._cuts = set()
            return
        layout = self._layout
        block = held[layout.contour_address : layout.blocks["contour_address"][1]]
        copy = PageCopy(block, layout.word_order)
        if block[0] != 0:
            self._verdict.note("commit-without-clearing", f"transfer {transfer} over {block[0]}")
        acknowledged = held[layout.link_address + 6]
        if transfer == self._last_transfer and copy.content != self._last_content:
            self._verdict.note("transfer-reused", f"transfer {transfer}, job {copy.job_id} page {copy.page}")
        elif copy.session != 0 and transfer in (self._last_transfer, acknowledged):
            self._verdict.note("transfer-not-new", f"transfer {transfer}, ack_transfer {acknowledged}")
        self._last_transfer, self._last_content = transfer, copy.content
        split = sorted(cut for cut in self._cuts if not _may_be_cut(cut, copy))
        if split and copy.job_id:  # job 0: the program has restarted and cleared the page in between
            self._verdict.note("value-split", f"requests begin or end at offsets {split} of job {copy.job_id}")

    # --- pages --------------------------------------------------------------------------------------------------

    def page(self, copy: PageCopy, service_block: Sequence[int], session: int) -> None:
        """Judge a page whose CRC is right; `service_block` as it stands now, `session` the controller's."""
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
