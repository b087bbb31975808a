"""The simulated controller's program, scan by scan."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivers.controller.mailbox.layout import MailboxLayout
from drivers.controller.mailbox.pages import Page, withdrawal
from drivers.controller.simulated.contour import AcceptedContour
from drivers.controller.simulated.memory import RetainedMemory
from drivers.controller.simulated.program import Pace, TriggerNotPossible
from tests.support.controller.protocol_decoder import Link
from tests.support.controller.simulated_bench import EXTERIOR, SESSION, Bench, pages, sealed

# --- the start --------------------------------------------------------------------------------------------------------


def test_the_start_sequence_shows_no_session_until_the_last_answer_is_filled_in() -> None:
    memory = RetainedMemory()
    memory.keep_answer(41, 5, None)
    bench = Bench(memory=memory, started=False)
    bench.registers[0:16] = [7] * 16
    assert bench.scan() == Link()
    assert bench.scan() == Link(last_job=41, last_result=5)
    assert bench.scan() == Link(last_job=41, last_result=5, session=SESSION)
    assert bench.scan().controller_state == 1


def test_a_page_is_not_answered_before_there_is_a_session() -> None:
    bench = Bench(started=False)
    assert bench.send(pages()[0]).ack_transfer == 0
    bench.scan(2)
    assert bench.scan().ack_transfer == 1


@pytest.mark.parametrize("word_order", ["big", "little"])
def test_heartbeat_clock_and_test_echo_run(word_order: str) -> None:
    bench = Bench(layout=MailboxLayout(word_order=word_order))
    bench.write_service(test_value=0x0102FFFF)
    first, second = bench.scan(), bench.scan()
    assert second.controller_heartbeat != first.controller_heartbeat
    assert second.clock - first.clock == 10
    assert second.test_echo == 0x01030000


def test_the_test_echo_wraps_and_so_does_the_clock() -> None:
    bench = Bench()
    bench.write_service(test_value=0xFFFFFFFF)
    bench.now_ms = 2**32 - 5
    link = bench.scan()
    assert (link.test_echo, link.clock) == (0, 5)


def test_a_controller_without_a_clock_shows_0_for_ever_and_takes_contours_without_age() -> None:
    bench = Bench(has_clock=False)
    assert bench.scan(50).clock == 0
    assert bench.send(pages()[0]).ack_result == 1


@pytest.mark.parametrize("word_order", ["big", "little"])
def test_a_program_that_tears_leaves_32_bit_values_half_written_for_one_scan(word_order: str) -> None:
    """And its heartbeat stands still until they are whole."""
    bench = Bench(layout=MailboxLayout(word_order=word_order), clock_start_ms=65_450)
    bench.program.pace = Pace(torn=True)
    bench.write_service(test_value=0x0102FFFF)
    half, whole = (0x0103_0001, 0x0103_0000) if word_order == "big" else (0x0000_0000, 0x0103_0000)
    bench.registers[8:10] = [0, 1] if word_order == "big" else [1, 0]
    torn, after = bench.scan(), bench.scan()
    assert (torn.test_echo, after.test_echo) == (half, whole)
    assert after.controller_heartbeat != torn.controller_heartbeat
    clocks = [(bench.now_ms + 10 + 65_450, bench.scan().clock) for _ in range(15)]
    torn_clocks = [(now, clock) for now, clock in clocks if abs(now - clock) > 10]
    assert len(torn_clocks) == 1
    ((now, clock),) = torn_clocks
    assert now >= 65_536
    assert abs(clock - now - (65_536 if word_order == "big" else -65_536)) <= 10


def test_a_torn_last_job_comes_before_its_acknowledgement_and_no_heartbeat_lies_between() -> None:
    bench = Bench()
    bench.program.pace = Pace(torn=True, stepwise=True)
    bench.registers[10:12] = [0, 65_535]
    links = [bench.send(pages(job_id=65_536)[0]), *(bench.scan() for _ in range(5))]
    assert 65_536 + 65_535 in [link.last_job for link in links]
    assert (links[-1].last_job, links[-1].last_result, links[-1].ack_transfer) == (65_536, 1, 1)
    assert all(link.last_job == 65_536 for link in links if link.ack_result or link.ack_transfer)
    half = [link for link in links if link.last_result and link.last_job != 65_536]
    assert len(half) >= 2
    assert len({link.controller_heartbeat for link in half}) == 1


# --- answers ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("word_order", ["big", "little"])
def test_a_good_page_is_accepted_and_its_contour_is_what_was_sent(word_order: str) -> None:
    bench = Bench(layout=MailboxLayout(word_order=word_order))
    link = bench.send(pages(word_order=word_order, uncertainty_um=150)[0])
    assert (link.ack_transfer, link.ack_result, link.last_job, link.last_result) == (1, 1, 1, 1)
    (contour,) = bench.taken
    assert contour == AcceptedContour(
        job_id=1,
        recipe=2,
        flags=0b1111,
        rings=(((0, 0), (100, 0), (100, 50), (0, 50)), ((10, 10), (10, 20), (20, 20))),
        area_mm2=4950,
        uncertainty_mm=0.15,
    )
    assert bench.verdict.clean, bench.verdict


GOOD = pages()[0]
ANSWERS = {
    "one bit of the payload wrong": (Page(GOOD.header, (*GOOD.payload[:-1], GOOD.payload[-1] ^ 1)), 2),
    "one bit of the header wrong": (Page((GOOD.header[0], GOOD.header[1] ^ 1, *GOOD.header[2:]), GOOD.payload), 2),
    "a payload longer than the capacity": (sealed(GOOD, at7=1986), 3),
    "an unknown layout": (sealed(GOOD, at1=2), 3),
    "another session": (pages(session=SESSION + 1)[0], 8),
    "no session": (pages(session=0)[0], 8),
    "an older job": (pages(job_id=4)[0], 8),
    "the last job": (pages(job_id=5)[0], 7),
    "a withdrawal": (withdrawal(6, SESSION, "big"), 11),
    "too old": (pages(job_id=6, captured_at=2**32 - 1000, valid_for_ms=1000)[0], 5),
    "captured after now": (pages(job_id=6, captured_at=5000, valid_for_ms=1000)[0], 5),
    "another trigger": (pages(job_id=6, trigger=3)[0], 5),
    "page 2 first": (sealed(GOOD, at2=0, at3=6, at4=2, at5=2), 9),
    "page 0": (sealed(GOOD, at3=6, at4=0), 9),
    "page 2 of 1": (sealed(GOOD, at3=6, at5=0), 3),
    "a ring table that says less": (sealed(pages(job_id=6)[0], at11=6), 3),
    "one ring too many": (sealed(pages(job_id=6)[0], at6=3), 3),
    "no ring": (sealed(pages(job_id=6)[0], at6=0), 3),
    "a box too small": (sealed(pages(job_id=6)[0], at17=1), 3),
    "a box too large": (sealed(pages(job_id=6)[0], at16=2), 3),
    "nothing wrong": (pages(job_id=6)[0], 1),
}


@pytest.mark.parametrize(("page", "answer"), ANSWERS.values(), ids=ANSWERS)
def test_each_page_gets_the_answer_that_the_protocol_lists(page: Page, answer: int) -> None:
    memory = RetainedMemory()
    memory.keep_answer(5, 7, None)
    bench = Bench(memory=memory)
    job = page.header[1] << 16 | page.header[2]
    link = bench.send(page)
    assert (link.ack_transfer, link.ack_result) == (1, answer)
    final = answer in (1, 5, 11)
    assert (link.last_job, link.last_result) == ((job, answer) if final else (5, 7))
    assert (memory.last_job, memory.last_result) == (link.last_job, link.last_result)


def test_an_accepted_job_is_answered_6_when_it_comes_again_and_is_not_acted_on_twice() -> None:
    bench = Bench()
    bench.send(pages()[0])
    assert bench.send(pages()[0]).ack_result == 6
    assert bench.send(withdrawal(1, SESSION, "big")).ack_result == 6
    assert len(bench.taken) == 1


def test_a_withdrawn_job_is_answered_11_ever_after() -> None:
    bench = Bench()
    assert bench.send(withdrawal(1, SESSION, "big")).ack_result == 11
    assert bench.send(pages()[0]).ack_result == 11
    assert bench.taken == []


@pytest.mark.parametrize("state", [0, 2, 3])
def test_a_controller_that_is_not_ready_answers_10_but_lets_a_job_be_withdrawn(state: int) -> None:
    bench = Bench()
    bench.program.state = state
    assert bench.send(pages()[0]).ack_result == 10
    assert bench.scan().controller_state == state
    assert bench.send(withdrawal(1, SESSION, "big")).ack_result == 11


@pytest.mark.parametrize("answer", [4, 7])
def test_the_machines_judgement_is_a_final_answer(answer: int) -> None:
    bench = Bench()
    bench.verdicts = lambda contour: answer
    link = bench.send(pages()[0])
    assert (link.ack_result, link.last_job, link.last_result) == (answer, 1, answer)
    assert bench.taken == []


def test_a_ring_that_runs_the_wrong_way_is_refused_as_geometry() -> None:
    bench = Bench()
    good = pages(rings_um=(EXTERIOR,), area_mm2=5000)[0]
    points = [good.payload[start : start + 4] for start in range(2, 18, 4)]
    turned = Page(good.header, (*good.payload[:2], *(word for point in points[::-1] for word in point)))
    assert bench.send(sealed(turned)).ack_result == 4
    assert bench.verdict.counts["contradictory-page"] > 0


def test_the_same_transfer_value_is_answered_once() -> None:
    bench = Bench()
    bench.send(pages()[0])
    bench.program.answered.clear()
    bench.scan(3)
    assert bench.program.answered == []


# --- pages ------------------------------------------------------------------------------------------------------------


def test_pages_in_order_make_one_contour_and_a_repeated_page_is_not_added_twice() -> None:
    bench = Bench(layout=MailboxLayout(payload_capacity=16))
    first, second, *rest = pages(capacity=16)
    assert len(rest) == 0
    assert bench.send(first).ack_result == 1
    assert bench.send(first).ack_result == 1
    assert bench.link.last_job == 0
    assert bench.send(second).last_job == 1
    assert [len(ring) for ring in bench.taken[0].rings] == [4, 3]
    assert bench.verdict.clean, bench.verdict


def test_a_held_page_in_the_middle_is_answered_1_and_the_next_one_is_still_the_next() -> None:
    bench = Bench(layout=MailboxLayout(payload_capacity=8))
    sent = pages(capacity=8)
    for page in (*sent[:3], sent[1], sent[2], *sent[3:]):
        assert bench.send(page).ack_result == 1
    assert len(bench.taken) == 1
    assert bench.verdict.clean, bench.verdict


def test_a_page_left_out_or_of_another_job_is_missing() -> None:
    bench = Bench(layout=MailboxLayout(payload_capacity=8))
    sent = pages(capacity=8)
    bench.send(sent[0])
    assert bench.send(sent[2]).ack_result == 9
    assert bench.send(pages(capacity=8, job_id=2)[1]).ack_result == 9
    assert bench.send(sent[1]).ack_result == 1


def test_a_page_that_differs_from_page_1_in_the_common_part_is_refused() -> None:
    bench = Bench(layout=MailboxLayout(payload_capacity=16))
    first, second = pages(capacity=16)
    bench.send(first)
    assert bench.send(sealed(second, at21=4951)).ack_result == 3
    assert bench.send(second).ack_result == 1


# --- triggers ---------------------------------------------------------------------------------------------------------


def ready_bench() -> Bench:
    bench = Bench()
    bench.write_service()
    bench.scan(2)
    return bench


def test_a_measurement_is_requested_only_from_a_service_that_two_scans_showed_ready() -> None:
    bench = Bench()
    bench.write_service(service_state=3)
    bench.scan(2)
    with pytest.raises(TriggerNotPossible, match="not Ready"):
        bench.program.request_measurement()
    bench.write_service(service_state=5)
    bench.scan()
    assert not bench.program.can_request
    bench.scan()
    assert bench.program.request_measurement(3, 20_000) == 1
    link = bench.scan()
    assert (link.trigger_counter, link.recipe, link.block_thickness) == (1, 3, 20_000)


def test_a_changing_heartbeat_does_not_keep_two_scans_from_agreeing() -> None:
    bench = Bench()
    for beat in range(2):
        bench.write_service(service_heartbeat=beat, test_value=beat)
        bench.scan()
    assert bench.program.can_request


def test_a_trigger_stays_open_until_its_contour_got_a_final_answer() -> None:
    bench = ready_bench()
    counter = bench.program.request_measurement()
    with pytest.raises(TriggerNotPossible):
        bench.program.request_measurement()
    bench.write_service(trigger_ack=counter, session_ack=SESSION, job_id=1)
    bench.scan(2)
    assert bench.program.trigger_open
    bench.program.state = 2
    bench.send(pages(trigger=counter)[0])
    assert bench.program.trigger_open
    bench.program.state = 1
    bench.send(pages(trigger=counter)[0])
    assert not bench.program.trigger_open
    assert bench.verdict.clean, bench.verdict


def test_a_trigger_closes_when_the_acknowledged_job_is_settled_without_a_contour() -> None:
    bench = ready_bench()
    counter = bench.program.request_measurement()
    bench.write_service(trigger_ack=counter, session_ack=SESSION - 1, job_id=8, settled_job=8)
    bench.scan(3)
    assert bench.program.trigger_open
    bench.write_service(trigger_ack=counter, session_ack=SESSION, job_id=8, settled_job=7)
    bench.scan(3)
    assert bench.program.trigger_open
    bench.write_service(trigger_ack=counter, session_ack=SESSION, job_id=9, settled_job=8)
    bench.scan(2)
    assert not bench.program.trigger_open


def test_a_contour_without_a_trigger_is_expired_while_the_controllers_own_is_open() -> None:
    bench = ready_bench()
    bench.program.request_measurement()
    assert bench.send(pages()[0]).ack_result == 5
    assert bench.program.trigger_open


def test_a_contour_for_a_trigger_that_was_never_acknowledged_is_noted() -> None:
    bench = ready_bench()
    bench.send(pages(trigger=bench.program.request_measurement())[0])
    assert set(bench.verdict.counts) == {"contour-before-acknowledgement"}


def test_after_trigger_65535_comes_1() -> None:
    bench = ready_bench()
    bench.registers[2] = 65535
    assert bench.program.request_measurement() == 1


# --- memory -----------------------------------------------------------------------------------------------------------


def test_a_new_start_remembers_the_last_answer_and_counts_the_session(tmp_path: Path) -> None:
    memory = RetainedMemory(tmp_path / "memory.json")
    sessions = [memory.count_session() for _ in range(3)]
    memory.keep_answer(7, 1, None)
    again = RetainedMemory(tmp_path / "memory.json")
    assert (again.last_job, again.last_result) == (7, 1)
    assert again.count_session() not in (0, *sessions)


def test_an_accepted_contour_is_kept_until_it_was_delivered(tmp_path: Path) -> None:
    contour = AcceptedContour(7, 1, 4, (((0.0, 0.0), (1.5, 0.0), (0.0, 1.0)),), 1, None)
    RetainedMemory(tmp_path / "memory.json").keep_answer(7, 1, contour)
    again = RetainedMemory(tmp_path / "memory.json")
    assert again.undelivered == contour
    again.delivered()
    assert RetainedMemory(tmp_path / "memory.json").undelivered is None


def test_sessions_are_never_0_and_no_two_in_a_row_alike() -> None:
    memory = RetainedMemory()
    memory.session = 65534
    assert [memory.count_session() for _ in range(3)] == [65535, 1, 2]


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"session": 1, "last_job": "x", "last_result": 1}', "\xff"])
def test_a_memory_file_that_is_none_is_an_error_that_names_it(tmp_path: Path, content: str) -> None:
    path = tmp_path / "memory.json"
    path.write_text(content, encoding="latin-1")
    with pytest.raises(Exception, match=r"memory\.json is no memory of a simulated controller.*Delete it"):
        RetainedMemory(path)
