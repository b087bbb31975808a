"""Rules of a transfer."""

from __future__ import annotations

from tests.rules.rule import CYCLE, IN_DOUBT, IN_PAGES, IN_RESUMING, IN_TRANSFER, LINK, TRANSFER, TRANSFER_TERMS, Rule

RULES = (
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
        "await self._steps.before_sending()",
        "pass",
    ),
    Rule(
        "Transfer 4: a read-back that differs starts again at step 2",
        f"{TRANSFER}::Transfer._attempt",
        f"{IN_TRANSFER}::test_a_readback_that_differs_starts_again_without_a_commit",
        "if self._settings.readback and not await self._reads_back(page):",
        "if self._settings.readback and (await self._reads_back(page)) is None:",
    ),
    Rule(
        "Transfer 5: the next transfer value is never 0 nor ack_transfer, and new at every attempt",
        f"{TRANSFER_TERMS}::TransferCounter.next",
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
        "await self._steps.before_withdrawal(reason)",
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
        f"{TRANSFER_TERMS}::Lifetime.left_s",
        f"{IN_DOUBT}::test_what_was_taken_longer_ago_than_it_may_live_is_withdrawn_never_sent_again",
        "if self.taken_at_s is not None:",
        "if False:",
    ),
    Rule(
        "Transfer 2: so is what was taken before that clock went back",
        f"{TRANSFER_TERMS}::Lifetime.left_s",
        f"{IN_DOUBT}::test_what_was_taken_longer_ago_than_it_may_live_is_withdrawn_never_sent_again",
        "if age_s >= 0 else 0.0",
        "",
    ),
    Rule(
        "Transfer 2: also after a restart",
        f"{CYCLE}::Cycle._lifetime",
        f"{IN_RESUMING}::test_a_job_taken_longer_ago_than_it_is_valid_is_taken_back_after_a_restart_not_sent_again",
        "job.taken_at_s, lasts_s",
        "None, lasts_s",
    ),
    Rule(
        "Transfer 7: nothing is concluded while test_echo is wrong",
        f"{TRANSFER}::Transfer._see",
        f"{IN_DOUBT}::test_nothing_is_concluded_from_a_block_that_is_misread",
        "or echo_fault(view) is not None",
        "",
    ),
    Rule(
        "Transfer 9: nothing is sent while the session seems to be another, or last_job to be this job or later",
        f"{TRANSFER}::Transfer._may_have_ended",
        f"{IN_DOUBT}::test_nothing_is_sent_while_the_job_may_have_ended",
        "if view.session not in (0, self._session):",
        "return None\n        if view.session not in (0, self._session):",
    ),
)
