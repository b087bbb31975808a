"""Rules of the conventions and of the two blocks of 16 registers."""

from __future__ import annotations

from tests.rules.rule import CONNECTION, IN_DOUBT, IN_LINK, IN_TRANSFER, READING, TRANSFER, WRITING, Rule

RULES = (
    # --- conventions ---
    Rule(
        "Conventions: a block is acted on only when two reads in a row show the same",
        f"{READING}::LinkReading._shows_the_same",
        f"{IN_LINK}::test_a_block_counts_only_when_two_reads_in_a_row_show_it",
        "if previous is None or previous != shown:",
        "if previous is None:",
    ),
    Rule(
        "Conventions: what an earlier connection said is not combined with what comes next",
        f"{READING}::LinkReading.forget",
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
        "if (self._link.connection.opened, self._link.ownership.epoch) != clean:",
        "if False:",
    ),
    Rule(
        "Conventions: what rests on last_job alone needs reads alike over two changes of the heartbeat",
        f"{TRANSFER}::Transfer._see",
        f"{IN_DOUBT}::test_without_our_acknowledgement_last_job_settles_only_once_it_holds",
        "(holds or self._acknowledged(view))",
        "True",
    ),
    Rule(
        "Conventions: so does a last_job above job_id, and another session",
        f"{TRANSFER}::Transfer._see",
        f"{IN_DOUBT}::test_a_last_job_that_stands_half_written_for_a_scan_fails_no_job",
        "if holds:",
        "if True:",
    ),
    Rule(
        "Conventions: two changes of the heartbeat, all reads between them alike",
        f"{READING}::LinkReading._shows_the_same",
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
        "if view.session == 0 or echo_fault",
        "if echo_fault",
    ),
    Rule(
        "Link block: the controller's heartbeat changes while its program runs",
        f"{READING}::LinkReading.beat_fault",
        f"{IN_LINK}::test_a_heartbeat_that_stands_still_is_a_fault_though_the_server_answers",
        "if self.silent_s > timeout_s:",
        "if self.silent_s > 1e9:",
    ),
    # --- service block ---
    Rule(
        "Service block: written at every change",
        f"{WRITING}::ServiceBlockWriting.publish",
        f"{IN_LINK}::test_a_change_is_written_at_once_and_flush_waits_for_it",
        "self._on_publish()",
        "pass",
    ),
    Rule(
        "Service block: service_heartbeat changes at least once a second",
        f"{WRITING}::ServiceBlockWriting.due",
        f"{IN_LINK}::test_our_heartbeat_changes_at_least_once_a_second_and_the_block_is_written_whole",
        "return self._dirty or due or not self.ownership.decided",
        "return self._dirty or not self.ownership.decided",
    ),
    Rule(
        "Service block: what its reply did not confirm is written again",
        f"{CONNECTION}::Connection.keep",
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
)
