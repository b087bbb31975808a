"""The protocol's rules that the service keeps: by which code, and which test fails without it."""

from __future__ import annotations

import ast
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
TRANSFER, LINK, EXECUTOR, CYCLE = "service/transfer.py", "service/link.py", "service/executor.py", "service/cycle.py"
JOURNAL, OWNERSHIP, CLOCK = "service/journal.py", "service/ownership.py", "service/controller_clock.py"
IN_CLOCK, IN_DOUBT = "tests/service/test_controller_clock.py", "tests/service/test_transfer_in_doubt.py"
TRIGGERS, IN_ANSWERS = "service/triggers.py", "tests/service/test_serial_answers.py"
IN_TRANSFER, IN_PAGES, IN_LINK, IN_EXECUTOR, IN_CYCLE, IN_RESUMING, IN_OWNERSHIP, IN_JOURNAL, IN_RECOVERY = (
    f"tests/service/test_{name}.py"
    for name in (
        *("transfer", "transfer_pages", "link", "executor", "cycle", "cycle_after_restart"),
        *("ownership", "journal", "journal_recovery"),
    )
)


@dataclass(frozen=True)
class Rule:
    """One rule.

    said: its place in protocol.md and what it says. code: `file::Class.function` that keeps it; test: `file::function`
    that fails without it. With the line `there` of the code turned into `without`, the rule is taken out.
    """

    said: str
    code: str
    test: str
    there: str
    without: str

    def taken_out(self) -> str:
        """The text of the code's file without the rule."""
        text = (ROOT / self.code.partition("::")[0]).read_text(encoding="utf-8")
        whole = source_of(self.code)
        return text.replace(whole, whole.replace(self.there, self.without, 1))


RULES = (
    # --- conventions ---
    Rule(
        "Conventions: a block is acted on only when two reads in a row show the same",
        f"{LINK}::Link._shows_the_same",
        f"{IN_LINK}::test_a_block_counts_only_when_two_reads_in_a_row_show_it",
        "if previous is None or previous != shown:",
        "if previous is None:",
    ),
    Rule(
        "Conventions: what an earlier connection said is not combined with what comes next",
        f"{LINK}::Link._forget",
        f"{IN_LINK}::test_what_an_earlier_connection_said_does_not_count_as_one_of_the_two",
        "self._previous: tuple[int, ...] | None = None",
        "self._previous = getattr(self, '_previous', None)",
    ),
    Rule(
        "Conventions: after a write without its reply, step 2 again; after step 5, step 7",
        f"{TRANSFER}::Transfer._attempt",
        f"{IN_TRANSFER}::test_after_a_lost_commit_reply_a_slow_answer_is_waited_for",
        "except ControllerUnavailable as error:  # it may have been done: go on with step 7",
        "except ZeroDivisionError as error:",
    ),
    Rule(
        "Conventions: on a new connection step 2 again, though none of the transfer's own writes was lost",
        f"{TRANSFER}::Transfer._check_may_go_on",
        f"{IN_TRANSFER}::test_a_connection_that_was_opened_anew_begins_again_with_transfer_0",
        "if self._link.connections != clean:",
        "if False:",
    ),
    Rule(
        "Conventions: what rests on last_job alone needs reads alike over two changes of the heartbeat",
        f"{TRANSFER}::Transfer._see",
        f"{IN_DOUBT}::test_without_our_acknowledgement_last_job_settles_only_once_it_holds",
        "(self._link.holds or self._acknowledged(view))",
        "True",
    ),
    Rule(
        "Conventions: so does a last_job above job_id, and another session",
        f"{TRANSFER}::Transfer._see",
        f"{IN_DOUBT}::test_a_last_job_that_stands_half_written_for_a_scan_fails_no_job",
        "if self._link.holds:",
        "if True:",
    ),
    Rule(
        "Conventions: two changes of the heartbeat, all reads between them alike",
        f"{LINK}::Link._shows_the_same",
        f"{IN_LINK}::test_last_job_is_known_once_it_held_over_two_changes_of_the_heartbeat",
        "if self.holds and",
        "if",
    ),
    Rule(
        "Conventions: beside our acknowledgement two reads are enough, where ack_result = last_result",
        f"{TRANSFER}::Transfer._acknowledged",
        f"{IN_DOUBT}::test_an_acknowledgement_that_says_something_else_than_last_result_settles_nothing_at_once",
        "return before or view.ack_result == view.last_result",
        "return True",
    ),
    Rule(
        "Conventions: or where they are 6 and 1",
        f"{TRANSFER}::Transfer._acknowledged",
        f"{IN_DOUBT}::test_accepted_before_is_an_acknowledgement_of_accepted",
        "return before or",
        "return",
    ),
    # --- link block ---
    Rule(
        "Link block: session 0 is disregarded",
        f"{TRANSFER}::Transfer._see",
        f"{IN_TRANSFER}::test_a_session_of_0_is_disregarded",
        "if view.session == 0 or self._link.echo_fault",
        "if self._link.echo_fault",
    ),
    Rule(
        "Link block: the controller's heartbeat changes while its program runs",
        f"{LINK}::Link._beat_fault",
        f"{IN_LINK}::test_a_heartbeat_that_stands_still_is_a_fault_though_the_server_answers",
        "if self._silent_s() > self.settings.heartbeat_timeout_s:",
        "if self._silent_s() > 1e9:",
    ),
    # --- service block ---
    Rule(
        "Service block: written at every change",
        f"{LINK}::Link.publish",
        f"{IN_LINK}::test_a_change_is_written_at_once_and_flush_waits_for_it",
        "self._wake.set()",
        "pass",
    ),
    Rule(
        "Service block: service_heartbeat changes at least once a second",
        f"{LINK}::Link._service_due",
        f"{IN_LINK}::test_our_heartbeat_changes_at_least_once_a_second_and_the_block_is_written_whole",
        "return self._dirty or due or not self.ownership.decided",
        "return self._dirty or not self.ownership.decided",
    ),
    Rule(
        "Service block: what its reply did not confirm is written again",
        f"{LINK}::Link.run",
        f"{IN_LINK}::test_a_service_block_whose_reply_was_lost_is_written_again",
        "except ControllerError as error:\n                    # A",
        "except ZeroDivisionError as error:\n                    # A",
    ),
    Rule(
        "Service block: trigger_ack counts, so no contour goes before it was confirmed",
        f"{TRANSFER}::Transfer._deliver",
        f"{IN_TRANSFER}::test_no_contour_is_sent_before_the_service_block_is_confirmed",
        "if await self._link.flush(self._settings.ack_timeout_s):",
        "if True:",
    ),
    # --- a transfer ---
    Rule(
        "Transfer 1: waits for controller_state 1",
        f"{LINK}::Link.controller_not_ready",
        f"{IN_TRANSFER}::test_nothing_is_written_to_the_contour_block_while_the_controller_is_busy",
        'return None if state == 1 else f"the controller',
        'return None if state else f"the controller',
    ),
    Rule(
        "Transfer 1: at most until the job has expired, then it withdraws",
        f"{TRANSFER}::Transfer._ready",
        f"{IN_TRANSFER}::test_a_job_that_expires_while_it_waits_is_withdrawn_with_156",
        "if self._lifetime.over:",
        "if False:",
    ),
    Rule(
        "Transfer 2: transfer = 0 before payload and header",
        f"{TRANSFER}::Transfer._clear",
        f"{IN_TRANSFER}::test_a_page_is_cleared_written_read_back_and_committed_in_this_order",
        "await self._link.controller.write_transfer(0)",
        "pass",
    ),
    Rule(
        "Transfer 3: the pages are durable before the first request of them",
        f"{TRANSFER}::Transfer._about_to_send",
        f"{IN_TRANSFER}::test_a_page_is_cleared_written_read_back_and_committed_in_this_order",
        "await self._before_sending()",
        "pass",
    ),
    Rule(
        "Transfer 4: a read-back that differs starts again at step 2",
        f"{TRANSFER}::Transfer._attempt",
        f"{IN_TRANSFER}::test_a_readback_that_differs_starts_again_without_a_commit",
        "if self._settings.readback and await controller.read_page(len(page.payload)) != page:",
        "if self._settings.readback and not await controller.read_page(len(page.payload)):",
    ),
    Rule(
        "Transfer 5: the next transfer value is never 0 nor ack_transfer, and new at every attempt",
        f"{TRANSFER}::TransferCounter.next",
        f"{IN_TRANSFER}::test_the_counter_never_gives_0_nor_what_was_last_answered",
        "while value in (0, ack_transfer, self._last):",
        "while value == self._last:",
    ),
    Rule(
        "Transfer 5: a contour that became too old on its way is not committed",
        f"{TRANSFER}::Transfer._too_old",
        f"{IN_TRANSFER}::test_a_contour_that_became_too_old_while_it_was_made_durable_is_not_committed",
        "or not self._lifetime.over",
        "or self._lifetime",
    ),
    Rule(
        "Transfer 7: last_job alone settles, an acknowledgement does not",
        f"{TRANSFER}::Transfer._answer",
        f"{IN_TRANSFER}::test_an_answer_that_last_job_does_not_confirm_is_none_and_told_as_what_it_is",
        "if answer in CAN_BE_REPEATED or answer",
        "if answer is Answer.ACCEPTED:\n"
        "                    raise _Ended(Settlement(Outcome.ACCEPTED))\n"
        "                if answer in CAN_BE_REPEATED or answer",
    ),
    Rule(
        "Transfer 7: the controller's final answer settles the job",
        f"{TRANSFER}::Transfer._see",
        f"{IN_TRANSFER}::test_a_job_that_was_accepted_before_its_withdrawal_arrived_is_accepted",
        "view.last_result != 0 and (",
        "view.last_result > 1 and (",
    ),
    Rule(
        "Transfer 7: last_job > job_id: another service was here (155)",
        f"{TRANSFER}::Transfer._end_without",
        f"{IN_TRANSFER}::test_a_higher_last_job_means_that_another_service_was_here",
        "if view.last_job > self._job_id:",
        "if view.last_job > self._job_id + 10**9:",
    ),
    Rule(
        "Transfer 7: ack_result 1: the next page",
        f"{TRANSFER}::Transfer._deliver",
        f"{IN_PAGES}::test_pages_are_sent_in_order_each_under_a_cleared_and_then_a_new_transfer",
        "page += 1",
        "page += 2",
    ),
    Rule(
        "Transfer 7: 9: page 1 again",
        f"{TRANSFER}::Transfer._deliver",
        f"{IN_PAGES}::test_after_9_it_begins_with_page_1_again",
        "page = 0 if answer is Answer.PAGE_MISSING else page",
        "page = page",
    ),
    Rule(
        "Transfer 7: 10: step 1, and not counted",
        f"{TRANSFER}::Transfer._deliver",
        f"{IN_PAGES}::test_after_10_it_waits_and_sends_the_same_page_again_as_often_as_it_takes",
        "elif answer is Answer.NOT_READY:",
        "elif answer is Answer.WITHDRAWN:",
    ),
    Rule(
        "Transfer 7: 2, 3 or silence: the same page again; after three in vain it withdraws",
        f"{TRANSFER}::Transfer._deliver",
        f"{IN_TRANSFER}::test_after_three_attempts_in_vain_the_job_is_withdrawn_and_failed_with_150",
        "in_vain += 1\n        reason",
        "in_vain += 3\n        reason",
    ),
    Rule(
        "Transfer 7: a page that is missing again and again is in vain",
        f"{TRANSFER}::Transfer._deliver",
        f"{IN_PAGES}::test_a_page_that_is_missing_again_and_again_is_no_progress_and_the_job_is_withdrawn",
        "0 if page > furthest else in_vain",
        "0",
    ),
    Rule(
        "Transfer 8: withdraws again and again until last_job ≥ job_id",
        f"{TRANSFER}::Transfer.withdraw",
        f"{IN_TRANSFER}::test_a_sent_job_stays_in_flight_while_the_controller_is_away_and_is_settled_when_it_is_back",
        "except ControllerUnavailable:\n                    await self._connected()",
        "except ControllerUnavailable:\n"
        "                    return Settlement(Outcome.FAILED, Reason.CONTROLLER_LOST, detail)",
    ),
    Rule(
        "Transfer 8: a job of which anything was sent is never called failed without it",
        f"{TRANSFER}::Transfer.run",
        f"{IN_TRANSFER}::test_a_sent_job_stays_in_flight_while_the_controller_is_away_and_is_settled_when_it_is_back",
        "if not self._sent and self._link.fault() is not None:",
        "if self._link.fault() is not None:",
    ),
    Rule(
        "Transfer 8: why it is withdrawn is durable before the first request that takes it back",
        f"{TRANSFER}::Transfer.withdraw",
        f"{IN_TRANSFER}::test_after_three_attempts_in_vain_the_job_is_withdrawn_and_failed_with_150",
        "await self._before_withdrawal(reason)",
        "pass",
    ),
    Rule(
        "Transfer 9: another session: failed (153), not sent again",
        f"{TRANSFER}::Transfer._end_without",
        f"{IN_TRANSFER}::test_a_restart_of_the_controller_without_memory_fails_the_job_with_153_and_sends_it_never_again",
        "if view.session != self._session:",
        "if view.session == -1:",
    ),
    Rule(
        "Transfer 9: but last_job = job_id settles it also then",
        f"{TRANSFER}::Transfer._see",
        f"{IN_TRANSFER}::test_a_restart_of_the_controller_after_it_accepted_settles_the_job_by_its_memory",
        "if view.last_job == self._job_id and",
        "if view.session == self._session and view.last_job == self._job_id and",
    ),
    Rule(
        "Transfer 2: what was taken longer ago than valid_for by the machine's clock is withdrawn, not sent again",
        f"{TRANSFER}::Lifetime.left_s",
        f"{IN_DOUBT}::test_what_was_taken_longer_ago_than_it_may_live_is_withdrawn_never_sent_again",
        "if self.taken_at_s is not None:",
        "if False:",
    ),
    Rule(
        "Transfer 2: so is what was taken before that clock went back",
        f"{TRANSFER}::Lifetime.left_s",
        f"{IN_DOUBT}::test_what_was_taken_longer_ago_than_it_may_live_is_withdrawn_never_sent_again",
        "if age_s >= 0 else 0.0",
        "",
    ),
    Rule(
        "Transfer 2: also after a restart",
        f"{CYCLE}::Cycle.resume",
        f"{IN_RESUMING}::test_a_job_taken_longer_ago_than_it_is_valid_is_taken_back_after_a_restart_not_sent_again",
        "job.taken_at_s, lasts_s",
        "None, lasts_s",
    ),
    Rule(
        "Transfer 7: nothing is concluded while test_echo is wrong",
        f"{TRANSFER}::Transfer._see",
        f"{IN_DOUBT}::test_nothing_is_concluded_from_a_block_that_is_misread",
        "or self._link.echo_fault(view) is not None",
        "",
    ),
    Rule(
        "Transfer 9: nothing is sent while the session seems to be another, or last_job to be this job or later",
        f"{TRANSFER}::Transfer._may_have_ended",
        f"{IN_DOUBT}::test_nothing_is_sent_while_the_job_may_have_ended",
        "if view.session not in (0, self._session):",
        "return None\n        if view.session not in (0, self._session):",
    ),
    # --- after its own start ---
    Rule(
        "Own start: the job in flight is settled before a trigger is taken",
        f"{EXECUTOR}::Executor.run",
        f"{IN_EXECUTOR}::test_a_job_in_flight_at_the_start_is_settled_before_any_trigger_is_taken",
        "self._found = True\n        while True:",
        "self._found = False\n        while True:",
    ),
    Rule(
        "Own start: sent again bit-identical where the journal holds the pages",
        f"{JOURNAL}::pages_from_text",
        f"{IN_RESUMING}::test_a_sent_job_is_sent_again_bit_identical",
        "end = body + registers[start + PAYLOAD_LENGTH]",
        "end = body + registers[start + PAYLOAD_LENGTH] - 1",
    ),
    Rule(
        "Own start: a withdrawal that was cut short is finished, with its first reason",
        f"{CYCLE}::Cycle.resume",
        f"{IN_RESUMING}::test_a_withdrawal_that_was_cut_short_is_finished_with_its_first_reason",
        "if job.withdraw_reason is not None:",
        "if job.withdraw_reason is None and not job.pages:",
    ),
    Rule(
        "Own start: without a limit of its own a sent job is withdrawn (154)",
        f"{CYCLE}::Cycle.resume",
        f"{IN_RESUMING}::test_a_sent_job_without_a_limit_of_its_own_is_taken_back_after_a_restart",
        "elif not validity.valid_for:",
        "elif validity.valid_for < 0:",
    ),
    Rule(
        "Own start: what the service block says counts also where owner is its own",
        f"{JOURNAL}::_is_later",
        f"{IN_EXECUTOR}::test_a_restored_journal_repeats_no_trigger_and_no_number",
        "return than[0] != session or 0 < (pair[1] - than[1]) % 65536 < LATER",
        "return False",
    ),
    Rule(
        "Own start: but an earlier trigger_ack does not",
        f"{JOURNAL}::_is_later",
        f"{IN_EXECUTOR}::test_an_earlier_trigger_in_the_service_block_takes_nothing_back",
        "return than[0] != session or 0 < (pair[1] - than[1]) % 65536 < LATER",
        "return True",
    ),
    Rule(
        "Own start: a job_id there that the journal does not know is withdrawn (154)",
        f"{JOURNAL}::Journal.go_on_above",
        f"{IN_EXECUTOR}::test_a_job_that_only_the_service_block_knows_is_taken_back",
        "found.job_id > found.settled_job\n",
        "found.job_id < 0\n",
    ),
    Rule(
        "Own start: a job in flight is settled at the controller and layout that it was sent with, by nothing else",
        f"{CYCLE}::Cycle.hindrance",
        f"{IN_RESUMING}::test_a_job_sent_to_another_controller_is_settled_by_nothing_else",
        "if job.target and job.target != dict(target):",
        "if False:",
    ),
    Rule(
        "Own start: and no trigger is taken until then",
        f"{EXECUTOR}::Executor._settle_in_flight",
        f"{IN_EXECUTOR}::test_a_job_in_flight_elsewhere_keeps_every_trigger_out",
        "if hindrance is not None:",
        "if False:",
    ),
    Rule(
        "Own start: numbers from at least 1,000 above all it finds",
        f"{JOURNAL}::Journal.go_on_above",
        f"{IN_EXECUTOR}::test_each_start_numbers_from_a_thousand_above_all_in_the_journal",
        "min(known + room, LARGEST_JOB - 1)",
        "known",
    ),
    Rule(
        "Own start: and above last_job",
        f"{EXECUTOR}::Executor._above",
        f"{IN_EXECUTOR}::test_the_first_number_after_a_start_is_a_thousand_above_last_job",
        "else last_job + self._room",
        "else last_job",
    ),
    Rule(
        "Own start: a last_job more than 1,000,000 above all known is a fault until a person confirms it",
        f"{LINK}::Link._number_fault",
        f"{IN_LINK}::test_a_last_job_that_leaps_is_a_fault_until_it_is_corrected",
        "if self.last_job > known + LARGEST_STEP and",
        "if False and",
    ),
    Rule(
        "A new job_id is above all in the journal",
        f"{JOURNAL}::Journal.take",
        f"{IN_JOURNAL}::test_job_ids_rise_above_the_journal_and_above_what_the_controller_knows",
        "job_id = max(highest, above, found) + 1",
        "job_id = max(above, found) + 1",
    ),
    Rule(
        "A new job_id is above last_job",
        f"{EXECUTOR}::Executor._take",
        f"{IN_EXECUTOR}::test_a_job_id_is_above_the_controllers_last_job",
        "above=self._above()",
        "above=0",
    ),
    Rule(
        "Exactly once: numbers go on above a damaged journal's",
        "service/journal_recovery.py::open_journal",
        f"{IN_RECOVERY}::test_what_was_moved_aside_counts_also_where_the_controller_knows_less",
        "highest = max([highest_archived(archive), *map(highest_job, set_aside(path))])",
        "highest = highest_archived(archive)",
    ),
    Rule(
        "Contours are sent only while test_echo = test_value + 1",
        f"{LINK}::Link.echo_fault",
        f"{IN_TRANSFER}::test_contours_are_sent_only_while_the_test_echo_is_right",
        "if view.test_echo == expected:",
        "if expected:",
    ),
    Rule(
        "A clock reading counts only if it fits the last one that counted within 1 s",
        f"{CLOCK}::ControllerClock.stamp",
        f"{IN_CLOCK}::test_a_reading_counts_when_it_fits_the_last_one_that_counted_within_a_second",
        "if latest is self._counted else None",
        "",
    ),
    Rule(
        "A clock that jumped counts only once it holds",
        f"{CLOCK}::ControllerClock._holds",
        f"{IN_CLOCK}::test_a_value_that_stands_half_written_for_a_whole_scan_never_counts",
        "and self._doubted_beats >= BEATS_TO_HOLD",
        "",
    ),
    Rule(
        "Without a clock captured_at and valid_for are 0",
        f"{CYCLE}::Cycle._envelope",
        f"{IN_CYCLE}::test_without_a_clock_captured_at_and_valid_for_are_0",
        "valid_for_ms=round(self._settings.valid_for_s * 1000) if stamp.clock_ms else 0,",
        "valid_for_ms=round(self._settings.valid_for_s * 1000),",
    ),
    Rule(
        "Without a clock the service itself withdraws what expires",
        f"{TRANSFER}::Transfer._answer",
        f"{IN_TRANSFER}::test_a_contour_that_nobody_answers_is_taken_back_as_soon_as_it_is_too_old",
        "if self._too_old():  # without a clock of the controller's",
        "if False:  # without a clock of the controller's",
    ),
    Rule(
        "captured_at is read before the exposure begins",
        f"{CYCLE}::Cycle._carry_out",
        f"{IN_CYCLE}::test_captured_at_was_read_before_the_exposure",
        "stamp = await self._stamp(job)\n        stamped_at = self._now()\n"
        "        frame = course.frame = await self._frame(course.report)",
        "frame = course.frame = await self._frame(course.report)\n        await asyncio.sleep(0.05)\n"
        "        stamp = await self._stamp(job)\n"
        "        stamped_at = self._now()",
    ),
    # --- one service ---
    Rule(
        "One service: owner is read before each write of the service block",
        f"{LINK}::Link._keep_service",
        f"{IN_OWNERSHIP}::test_owner_is_read_before_each_write_of_the_service_block",
        "found = await self.controller.read_service()",
        "found = self._block",
    ),
    Rule(
        "One service: and the block is written only where what was read allows it",
        f"{LINK}::Link._keep_service",
        f"{IN_OWNERSHIP}::test_what_stands_still_is_not_overwritten_before_it_was_watched",
        "if not self.ownership.saw(found):",
        "if self.ownership.saw(found) is None:",
    ),
    Rule(
        "One service: its own number is watched for 1.5 s at the start",
        f"{OWNERSHIP}::Ownership._watch",
        f"{IN_OWNERSHIP}::test_our_own_number_is_watched_for_1_5_s_before_anything_is_written",
        "WATCH_S if foreign else WATCH_OWN_S",
        "WATCH_S if foreign else 0.0",
    ),
    Rule(
        "One service: a heartbeat beside its own number that moves: Error (155)",
        f"{OWNERSHIP}::Ownership._watch",
        f"{IN_OWNERSHIP}::test_a_copy_of_our_journal_that_lives_is_left_alone",
        "if foreign or self._moved:",
        "if foreign:",
    ),
    Rule(
        "One service: a heartbeat that it did not write, twice in a row, is another service",
        f"{OWNERSHIP}::Ownership._saw_later",
        f"{IN_OWNERSHIP}::test_a_heartbeat_that_we_did_not_write_twice_in_a_row_is_another_with_our_number",
        "block.service_heartbeat not in self._beats",
        "False",
    ),
    Rule(
        "One service: a write without a reply may be found later",
        f"{OWNERSHIP}::Ownership.writing",
        f"{IN_OWNERSHIP}::test_a_heartbeat_of_ours_that_lands_late_is_ours",
        "self._beats.append(beat)",
        "self._beats = deque([beat])",
    ),
    Rule(
        "One service: a foreign one whose heartbeat moves: Error (155), nothing is written",
        f"{OWNERSHIP}::Ownership._watch",
        f"{IN_OWNERSHIP}::test_a_foreign_owner_whose_heartbeat_moves_is_left_alone_for_good",
        "if block.service_heartbeat != self._beat:",
        "if False:",
    ),
    Rule(
        "One service: watched for 3 s before its own is written",
        f"{OWNERSHIP}::Ownership._watch",
        f"{IN_OWNERSHIP}::test_nothing_is_written_over_another_that_moved_or_was_watched_for_less_than_3_s",
        "(WATCH_S if foreign",
        "(WATCH_S / 2 if foreign",
    ),
    Rule(
        "One service: then 3 s more, and only if its own still stands",
        f"{OWNERSHIP}::Ownership._saw_later",
        f"{IN_OWNERSHIP}::test_a_foreign_owner_whose_heartbeat_stands_for_3_s_is_taken_over_and_ours_must_stand_for_3_s_more",
        "if self._now() - self._since_s >= WATCH_S:",
        "if True:",
    ),
    Rule(
        "One service: later a foreign one stops all writing, until a person says so",
        f"{OWNERSHIP}::Ownership.saw",
        f"{IN_OWNERSHIP}::test_a_foreign_owner_later_stops_all_writing_until_a_person_says_so",
        "if self.conflict:\n            return False",
        "",
    ),
    Rule(
        "One service: then a job of which nothing was sent fails (155) at once",
        f"{TRANSFER}::Transfer._stand_by",
        f"{IN_OWNERSHIP}::test_a_job_of_which_nothing_was_sent_fails_with_155_at_once",
        "if ownership.conflict and not self._sent:",
        "if False:",
    ),
    Rule(
        "One service: any other stays in flight, and last_job = job_id settles it",
        f"{TRANSFER}::Transfer._stand_by",
        f"{IN_OWNERSHIP}::test_a_job_that_was_sent_stays_in_flight_beside_another_service_and_its_acceptance_settles_it",
        "if ownership.conflict and not self._sent:",
        "if ownership.conflict:",
    ),
    Rule(
        "One service: valid_for and then ack_timeout gone by on the controller's clock end it (155)",
        f"{TRANSFER}::Transfer._is_over",
        f"{IN_OWNERSHIP}::test_beside_another_service_a_job_ends_with_155_once_the_controller_would_not_accept_it_any_more",
        "self._validity.valid_for + self._settings.ack_timeout_s * 1000",
        "self._validity.valid_for + 10**9",
    ),
    Rule(
        "One service: without valid_for job_timeout ends it",
        f"{TRANSFER}::Transfer._is_over",
        f"{IN_OWNERSHIP}::test_beside_another_service_and_without_a_limit_it_ends_after_job_timeout_and_says_so",
        "return self._lifetime.over",
        "return False",
    ),
    # --- handshake: none ---
    Rule(
        "handshake none: a job ends as written, never as accepted",
        f"{TRANSFER}::Transfer._write_only",
        f"{IN_TRANSFER}::test_without_handshake_a_job_ends_as_written_never_as_accepted",
        "return Settlement(Outcome.WRITTEN)",
        "return Settlement(Outcome.ACCEPTED)",
    ),
    Rule(
        "handshake none: repeats carry the same transfer",
        f"{TRANSFER}::Transfer._write_only",
        f"{IN_TRANSFER}::test_without_handshake_repeats_carry_the_same_transfer_value",
        "await controller.write_transfer(transfer)\n                    return",
        "await controller.write_transfer(self._counter.next(0))\n                    return",
    ),
    Rule(
        "handshake none: a job found in flight after a restart fails (154)",
        f"{CYCLE}::Cycle.resume",
        f"{IN_RESUMING}::test_without_handshake_a_sent_job_found_in_flight_ends_with_154",
        "if not job.sent or self._link is None or not handshake:",
        "if not job.sent or self._link is None:",
    ),
    Rule(
        "handshake none: session, captured_at and trigger are 0",
        f"{CYCLE}::Cycle._envelope",
        f"{IN_CYCLE}::test_without_handshake_the_page_carries_neither_session_nor_clock_nor_trigger",
        "trigger=job.trigger.counter or 0 if self._settings.transfer.handshake else 0,",
        "trigger=7,",
    ),
    # --- triggers ---
    Rule(
        "Trigger 2: (session, trigger_counter) is taken once; the journal keeps the pair",
        f"{EXECUTOR}::Executor._pending",
        f"{IN_EXECUTOR}::test_one_trigger_of_the_controller_gives_one_job_also_after_a_restart",
        "if view.trigger_counter == 0 or pair == self._last_pair:",
        "if view.trigger_counter == 0:",
    ),
    Rule(
        "Trigger 2: the same counter in another session is another trigger",
        f"{EXECUTOR}::Executor._pending",
        f"{IN_EXECUTOR}::test_the_same_counter_in_another_session_is_another_trigger",
        "pair = (view.session, view.trigger_counter)",
        "pair = (self._last_pair[0] or view.session, view.trigger_counter)",
    ),
    Rule(
        "Trigger 2: a busy service takes it once the job in flight is settled",
        f"{EXECUTOR}::Executor.run",
        f"{IN_EXECUTOR}::test_a_trigger_of_the_controller_waits_for_the_job_in_flight",
        "await self._execute_submitted(self._submitted)\n                continue",
        "await self._execute_submitted(self._submitted)\n                await self._wake.wait()",
    ),
    Rule(
        "Trigger 2: values skipped over count as missed",
        f"{EXECUTOR}::Executor._take_pending",
        f"{IN_EXECUTOR}::test_triggers_skipped_over_count_as_missed",
        "skipped = missed_between(self._last_pair, trigger.session, trigger.counter)",
        "skipped = 0",
    ),
    Rule(
        "Trigger 2: triggers of other kinds are refused with 120 while busy, and count as missed",
        f"{EXECUTOR}::Executor._check_free",
        f"{IN_EXECUTOR}::test_two_triggers_at_the_same_instant_give_one_job",
        "if self._health.job is not None or self._submitted is not None or self._taking:",
        "if self._health.job is not None:",
    ),
    Rule(
        "Trigger 2: and with 121 while the controller is not ready",
        f"{EXECUTOR}::Executor._check_free",
        f"{IN_EXECUTOR}::test_a_trigger_of_ours_is_refused_while_the_controller_cuts",
        "why_not = self._link.controller_not_ready() if self._link else None",
        "why_not = self._link.fault() if self._link else None",
    ),
    Rule(
        "Trigger 3: journalled durably before it is acknowledged",
        f"{JOURNAL}::Journal.take",
        f"{IN_EXECUTOR}::test_a_trigger_becomes_a_durable_job_before_the_ticket_is_handed_out",
        "with self._transaction() as db:\n            highest",
        "self._db.execute('BEGIN')\n        for db in (self._db,):\n            highest",
    ),
    Rule(
        "Trigger 3: then job_id, trigger_ack and session_ack are written",
        f"{EXECUTOR}::Executor._take_pending",
        f"{IN_EXECUTOR}::test_a_trigger_of_the_controller_is_acknowledged_with_its_pair_and_job",
        "self._link.publish(job_id=job.job_id, trigger_ack=trigger.counter, session_ack=trigger.session)",
        "self._link.publish(job_id=job.job_id, trigger_ack=trigger.counter)",
    ),
    Rule(
        "Trigger 3: a frame exposed before is refused (101)",
        f"{CYCLE}::Cycle._frame",
        f"{IN_CYCLE}::test_a_frame_of_before_the_trigger_is_refused_with_101",
        "if frame.exposed_at_s < asked_at:",
        "if frame.exposed_at_s < 0:",
    ),
    Rule(
        "Trigger 4: at the end settled_job and reject_reason are written",
        f"{EXECUTOR}::Executor._finish",
        f"{IN_EXECUTOR}::test_a_trigger_of_the_controller_is_acknowledged_with_its_pair_and_job",
        "self._link.publish(settled_job=job.job_id, reject_reason=int(job.reason or 0))",
        "self._link.publish(reject_reason=int(job.reason or 0))",
    ),
    Rule(
        "Always: a contour is never accepted for another trigger than its own, or in another session",
        f"{CYCLE}::Cycle._stamp",
        f"{IN_CYCLE}::test_a_trigger_of_another_session_ends_with_153",
        "if job.trigger.session is not None and stamp.session != job.trigger.session:",
        "if False:",
    ),
    Rule(
        "Always: a job ends once",
        f"{JOURNAL}::Journal._update",
        f"{IN_JOURNAL}::test_a_job_settles_once",
        "WHERE job_id = ? AND {UNSETTLED}",
        "WHERE job_id = ?",
    ),
    Rule(
        "Always: a lost journal repeats no trigger: the service block says which was taken",
        f"{JOURNAL}::Journal.go_on_above",
        f"{IN_EXECUTOR}::test_a_trigger_that_a_lost_journal_held_is_not_taken_again",
        "if later:",
        "if False:",
    ),
    Rule(
        "Always: who got an ACK on a serial line gets its DONE or FAIL, also after a restart",
        f"{TRIGGERS}::SerialTrigger._tell_owed",
        f"{IN_ANSWERS}::test_a_job_that_was_in_flight_at_a_kill_is_told_its_end_after_the_restart",
        "if job.job_id <= self._of_before or job.job_id in self._acknowledged",
        "if job.job_id in self._acknowledged",
    ),
    Rule(
        "Always: who got an ACK hears the end also when the line was away",
        f"{TRIGGERS}::SerialTrigger._serve",
        f"{IN_ANSWERS}::test_what_ended_while_the_line_was_away_is_told_when_it_is_back",
        "self._look.set()",
        "pass",
    ),
    Rule(
        "Always: measurement and evidence of a job are durable before its contour is sent",
        f"{CYCLE}::Cycle._send",
        f"{IN_CYCLE}::test_nothing_is_sent_before_measurement_and_evidence_are_durable",
        "await self._drafted(job, drafted)",
        "pass",
    ),
    Rule(
        "Always: losing the controller never ends the service",
        f"{LINK}::Link.run",
        f"{IN_LINK}::test_a_lost_controller_is_found_and_taken_up_again_alone",
        "self._lost(error)",
        "raise",
    ),
)


def source_of(name: str) -> str:
    """The source of `file::Class.function`; AssertionError where it does not exist."""
    path, _, names = name.partition("::")
    text = (ROOT / path).read_text(encoding="utf-8")
    node: ast.AST = ast.parse(text)
    for part in names.split("."):
        found = [child for child in ast.iter_child_nodes(node) if getattr(child, "name", None) == part]
        assert found, f"{name} does not exist"
        node = found[-1]
    return ast.get_source_segment(text, node) or ""
