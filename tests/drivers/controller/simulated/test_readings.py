"""The simulated controller's program against another reading of the protocol's text."""

from __future__ import annotations

from dataclasses import replace

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from drivers.controller.mailbox.layout import MailboxLayout
from drivers.controller.mailbox.pages import Page, withdrawal
from tests.support.controller.played_controller import PlayedController
from tests.support.controller.protocol_decoder import Layout
from tests.support.controller.simulated_bench import EXTERIOR, SESSION, Bench, pages, sealed

SMALL = MailboxLayout(payload_capacity=16)
STEPS = st.sampled_from([1, 1, 1, 2, 0, -1])


class TwoReadings(RuleBasedStateMachine):
    """The simulated program and an independent one get the same registers; they must give the same answers."""

    def __init__(self) -> None:
        super().__init__()
        self.bench = Bench(layout=SMALL)
        self.session = SESSION
        self.bench.now_ms = 0
        self.other = PlayedController([0] * 65536, Layout(payload_capacity=16))
        self.other.start(SESSION)
        self.both_scan(10)

    def both_scan(self, elapsed_ms: int) -> None:
        # When a trigger closes is compared elsewhere; here both have the same idea of it.
        self.other.own_trigger_open = self.bench.program.trigger_open
        self.other.scan(elapsed_ms)
        self.bench.now_ms = self.other.clock - elapsed_ms
        self.bench.scan(1, elapsed_ms)

    def send_to_both(self, page: Page, elapsed_ms: int) -> None:
        transfer = self.bench.transfer % 0xFFFF + 1
        self.bench.transfer = transfer
        for registers in (self.bench.registers, self.other.memory):
            registers[32 : 64 + len(page.payload)] = [transfer, *page.header, *page.payload]
        self.both_scan(elapsed_ms)

    def job(self, step: int) -> int:
        return max(1, self.other.last_job + step)

    def contour_pages(self, job: int, session: int, trigger: int, age_ms: int, valid_for_ms: int) -> tuple[Page, ...]:
        captured_at = (self.other.clock - age_ms) % 2**32
        return pages(
            capacity=16,
            job_id=job,
            session=session,
            trigger=trigger,
            captured_at=captured_at,
            valid_for_ms=valid_for_ms,
        )

    @rule(
        step=STEPS,
        number=st.integers(0, 1),
        old_session=st.sampled_from([False, False, True]),
        trigger=st.sampled_from([0, 0, 1, 2]),
        valid_for_ms=st.sampled_from([0, 0, 40]),
        age_ms=st.sampled_from([0, 0, 30, 31, 100]),
    )
    def a_page(self, step: int, number: int, old_session: bool, trigger: int, valid_for_ms: int, age_ms: int) -> None:
        session = self.session - old_session
        self.send_to_both(self.contour_pages(self.job(step), session, trigger, age_ms, valid_for_ms)[number], 10)

    @rule(step=STEPS, own_trigger=st.sampled_from([True, True, False]))
    def all_pages(self, step: int, own_trigger: bool) -> None:
        trigger = self.other.trigger_counter if own_trigger else 0
        for page in self.contour_pages(self.job(step), self.session, trigger, 0, 0):
            self.send_to_both(page, 1)

    @rule(answer=st.sampled_from([1, 1, 4, 7]))
    def the_machines_judgement(self, answer: int) -> None:
        self.bench.verdicts = self.other.judge = lambda contour: answer

    @rule(step=STEPS, at=st.integers(0, 46), bit=st.integers(0, 15))
    def a_damaged_page(self, step: int, at: int, bit: int) -> None:
        page = self.contour_pages(self.job(step), self.session, 0, 0, 0)[0]
        registers = [*page.header, *page.payload]
        registers[at] ^= 1 << bit
        self.send_to_both(Page(tuple(registers[:31]), tuple(registers[31:])), 1)

    @rule(
        step=STEPS,
        offset=st.sampled_from([1, 6, 7, 10, 11, 12, 13, 14, 16, 17, 18, 19]),
        value=st.sampled_from([0, 1, 2, 3, 10, 18, 20, 65535]),
    )
    def a_contradictory_page(self, step: int, offset: int, value: int) -> None:
        triangle = EXTERIOR[:3]
        (page,) = pages(capacity=16, job_id=self.job(step), session=self.session, rings_um=(triangle,), area_mm2=2500)
        changed = sealed(page, **{f"at{offset}": value})
        if changed.header[6] < len(changed.payload):  # its CRC covers what it says to carry
            changed = sealed(Page(changed.header, changed.payload[: changed.header[6]]))
        self.send_to_both(changed, 1)

    @rule(step=STEPS)
    def a_withdrawal(self, step: int) -> None:
        self.send_to_both(withdrawal(self.job(step), self.session, "big"), 1)

    @rule(state=st.sampled_from([1, 1, 1, 0, 2, 3]))
    def the_machines_state(self, state: int) -> None:
        self.bench.program.state = self.other.controller_state = state
        self.both_scan(10)

    @precondition(lambda self: not self.bench.program.trigger_open)
    @rule()
    def a_trigger(self) -> None:
        assert self.bench.program.request_measurement(1, 2, force=True) == self.other.trigger(1, 2)
        self.both_scan(10)

    @rule(forget=st.booleans())
    def a_restart(self, forget: bool) -> None:
        self.session += 1
        if forget:
            self.bench.memory.forget()
        self.bench.restart(self.session)
        self.bench.program.state = self.other.controller_state
        self.other.start(self.session, memory_lost=forget)
        self.other.clock = 0
        self.bench.scan(3)
        self.both_scan(10)

    @invariant()
    def both_say_the_same(self) -> None:
        mine, theirs = self.bench.link, Layout().link(self.other.memory)
        assert replace(mine, controller_heartbeat=0) == replace(theirs, controller_heartbeat=0)
        assert len(self.bench.taken) == len(self.other.contours)
        if self.bench.taken:
            assert self.bench.taken[-1].rings == self.other.contours[-1].millimetres


TestTwoReadings = TwoReadings.TestCase
TestTwoReadings.settings = settings(max_examples=60, stateful_step_count=30, deadline=None)
