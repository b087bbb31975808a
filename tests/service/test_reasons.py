"""Reasons carry the protocol's codes, names and outcomes."""

from __future__ import annotations

import pytest

from service.reasons import EXPLANATIONS, Outcome, Reason

# written from the protocol's table
PROTOCOL = {
    100: "no_frame", 101: "stale_frame", 102: "image_quality", 103: "scene_moved", 110: "no_block_found",
    111: "touches_border", 112: "area_out_of_limits", 113: "methods_disagree", 114: "uncertainty_too_large",
    115: "outside_work_area", 116: "several_blocks", 120: "busy", 121: "not_ready", 122: "unknown_recipe",
    130: "too_many_points", 131: "self_intersecting", 140: "calibration_missing", 141: "calibration_mismatch",
    142: "sentinel_moved", 150: "controller_timeout", 151: "controller_refused", 152: "controller_lost",
    153: "controller_restarted", 154: "service_restarted", 155: "other_service", 156: "expired", 160: "storage_full",
    161: "aborted", 190: "internal_error",
}  # fmt: skip


def test_codes_and_names_are_the_protocols() -> None:
    assert {int(reason): reason.label for reason in Reason} == PROTOCOL


@pytest.mark.parametrize("code", sorted(PROTOCOL))
def test_outcome_is_refused_for_101_to_142_and_151_and_failed_for_the_others(code: int) -> None:
    refused = 101 <= code <= 142 or code == 151
    assert Reason(code).outcome is (Outcome.REFUSED if refused else Outcome.FAILED)


def test_each_reason_tells_what_it_means_and_what_to_do_next() -> None:
    assert set(EXPLANATIONS) == set(Reason)
    for explanation in EXPLANATIONS.values():
        assert explanation.sentence.endswith(".")
        assert explanation.next_action.endswith(".")
