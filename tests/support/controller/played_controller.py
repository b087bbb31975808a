"""A controller that keeps the rules of `protocol.md`, section "What the controller does", on a list of registers.

Written from the protocol's text alone; pure, so that a test decides when it scans and what its clock says.
"""

from __future__ import annotations

from collections.abc import Callable, MutableSequence, Sequence
from dataclasses import dataclass, field, fields

from tests.support.controller.protocol_decoder import (
    LINK_FIELDS,
    Contour,
    Header,
    Layout,
    Link,
    contradictions,
    decode_header,
    foreign_page,
    geometry_faults,
    page_crc,
    page_faults,
    rings_of,
    words_of,
)

ACCEPTED, BAD_CRC, BAD_LAYOUT, GEOMETRY_REFUSED, EXPIRED, ACCEPTED_BEFORE = 1, 2, 3, 4, 5, 6
OPERATOR_REFUSED, OUTDATED, PAGE_MISSING, NOT_READY, WITHDRAWN = 7, 8, 9, 10, 11
FINAL_ANSWERS = frozenset({ACCEPTED, GEOMETRY_REFUSED, EXPIRED, OPERATOR_REFUSED, WITHDRAWN})


@dataclass
class PlayedController:
    """A controller's program on `memory`, its holding registers; a test calls `scan` as often as it likes.

    A scan answers the page that stands there, whole and at once. `contours` are those it accepted, `faults`
    what was wrong, in words, also what no answer tells: a repeated page that is not bit-identical. `judge` may refuse
    with 4 or 7.
    """

    memory: MutableSequence[int]
    layout: Layout = field(default_factory=Layout)
    session: int = 1
    controller_state: int = 1
    clock: int = 0
    trigger_counter: int = 0
    own_trigger_open: bool = False
    last_job: int = 0
    last_result: int = 0
    judge: Callable[[Contour], int] | None = None
    contours: list[Contour] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)
    answers: list[int] = field(default_factory=list)
    _held: list[tuple[tuple[int, ...], tuple[int, ...]]] = field(default_factory=list)

    def start(self, session: int, *, memory_lost: bool = False) -> None:
        """Begin a new session: session 0 first, then what is remembered, last the new session."""
        self._held = []
        self.trigger_counter, self.own_trigger_open = 0, False
        if memory_lost:
            self.last_job, self.last_result = 0, 0
        self._write(session=0)
        blank = {f.name: 0 for f in fields(Link)} | {"last_job": self.last_job, "last_result": self.last_result}
        self._write(**blank)
        self.session = session
        self.publish()

    def publish(self) -> None:
        """Write what the controller says of itself: state, heartbeat, clock, echo of the service's test value."""
        heartbeat = (self.layout.link(self.memory).controller_heartbeat + 1) & 0xFFFF
        echo = (self.layout.service(self.memory).test_value + 1) & 0xFFFFFFFF
        self._write(controller_state=self.controller_state, controller_heartbeat=heartbeat, test_echo=echo)
        self._write(clock=self.clock, last_result=self.last_result, last_job=self.last_job, session=self.session)

    def trigger(self, recipe: int = 0, block_thickness: int = 0) -> int:
        """Ask for one measurement; the new `trigger_counter`. After 65535 comes 1."""
        self._write(recipe=recipe, block_thickness=block_thickness)
        self.trigger_counter = self.trigger_counter % 0xFFFF + 1
        self.own_trigger_open = True
        self._write(trigger_counter=self.trigger_counter)
        return self.trigger_counter

    def scan(self, elapsed_ms: int = 10) -> int | None:
        """One turn of the program; the answer it gave, None where there was no page to answer."""
        self.clock = (self.clock + elapsed_ms) & 0xFFFFFFFF
        self.publish()
        service, header = self.layout.service(self.memory), self.layout.header_registers(self.memory)
        acknowledged = (service.trigger_ack, service.session_ack) == (self.trigger_counter, self.session)
        if self.own_trigger_open and acknowledged and service.settled_job >= service.job_id > 0:
            self.own_trigger_open = False
        if header[0] in (0, self.layout.link(self.memory).ack_transfer):
            return None
        result = self.answer(header, self.layout.payload(self.memory))
        self.answers.append(result)
        self._write(last_result=self.last_result)
        self._write(last_job=self.last_job)
        self._write(ack_result=result)
        self._write(ack_transfer=header[0])
        return result

    def answer(self, header: Sequence[int], payload: Sequence[int]) -> int:
        """The first answer of the protocol's list that holds; a final one is remembered with the contour."""
        header, payload = tuple(header), tuple(payload)
        seen = decode_header(header, self.layout.word_order)
        result = self._before_paging(seen, header, payload)
        if result is None:
            result = self._paging(seen, header, payload)
        whole = result == ACCEPTED and seen.layout == 1 and seen.page == seen.page_count
        if seen.job_id > self.last_job and (whole or result in FINAL_ANSWERS - {ACCEPTED}):
            self.last_job, self.last_result, self._held = seen.job_id, result, []
            if seen.trigger == self.trigger_counter != 0:
                self.own_trigger_open = False
        return result

    def _before_paging(self, seen: Header, header: tuple[int, ...], payload: tuple[int, ...]) -> int | None:
        age = (self.clock - seen.captured_at) & 0xFFFFFFFF
        other_trigger = seen.trigger not in (0, self.trigger_counter)
        last = ACCEPTED_BEFORE if self.last_result == ACCEPTED else self.last_result
        rules = (
            (seen.payload_length > self.layout.payload_capacity, BAD_LAYOUT),
            (seen.crc32 != page_crc(header, payload), BAD_CRC),
            (seen.layout not in (0, 1) or seen.job_id == 0, BAD_LAYOUT),
            (seen.session != self.session or seen.job_id < self.last_job, OUTDATED),
            (seen.job_id == self.last_job, last),
            (seen.layout == 0, WITHDRAWN),
            (age > seen.valid_for > 0, EXPIRED),
            (other_trigger or (seen.trigger == 0 and self.own_trigger_open), EXPIRED),
            (self.controller_state != 1, NOT_READY),
        )
        return next((result for holds, result in rules if holds), None)

    def _paging(self, seen: Header, header: tuple[int, ...], payload: tuple[int, ...]) -> int:
        """The answer by order, counts and geometry; the page is held where it is 1."""
        if seen.page == 1:
            self._held = []
        held_job = decode_header(self._held[0][0], self.layout.word_order).job_id if self._held else seen.job_id
        if seen.page == 0 or held_job != seen.job_id or seen.page > len(self._held) + 1:
            return PAGE_MISSING
        if seen.page <= len(self._held):
            if (header[1:], payload) != (self._held[seen.page - 1][0][1:], self._held[seen.page - 1][1]):
                self.faults.append(f"page {seen.page} of job {seen.job_id} was repeated with other content")
            return ACCEPTED
        pages = [*self._held, (header, payload)]
        faults = page_faults(header, payload, self.layout.payload_capacity, self.layout.word_order)
        faults += foreign_page(pages[0][0], header)
        if faults:
            self.faults += faults
            return BAD_LAYOUT
        if seen.page == seen.page_count:
            return self._contour(seen, pages)
        self._held = pages
        return ACCEPTED

    def _contour(self, seen: Header, pages: list[tuple[tuple[int, ...], tuple[int, ...]]]) -> int:
        """3 where the numbers contradict the points, 4 or 7 as the machine judges, else 1 and the contour is kept."""
        try:
            rings = rings_of(seen, [register for _, payload in pages for register in payload], self.layout.word_order)
        except ValueError as error:
            self.faults.append(str(error))
            return BAD_LAYOUT
        contradicting, refusable = contradictions(seen, rings), geometry_faults(seen, rings)
        self.faults += contradicting + refusable
        if contradicting or refusable:
            return BAD_LAYOUT if contradicting else GEOMETRY_REFUSED
        contour = Contour(seen, rings)
        verdict = ACCEPTED if self.judge is None else self.judge(contour)
        if verdict == ACCEPTED:
            self.contours.append(contour)
        return verdict

    def _write(self, **values: int) -> None:
        """Write fields of the link block, one after the other in the order given."""
        for name, value in values.items():
            offset, kind = LINK_FIELDS[name]
            words = [value & 0xFFFF] if kind == "u16" else words_of(value, self.layout.word_order)
            start = self.layout.link_address + offset
            self.memory[start : start + len(words)] = words
