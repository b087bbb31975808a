"""Reasons carry the protocol's codes, names and outcomes."""

from __future__ import annotations

from pathlib import Path

import pytest

from contour.acceptance.findings import Refusal
from service.cli.main import main
from service.reasons import Language, Outcome, Reason
from service.reasons_doc import page

ROOT = Path(__file__).parents[2]
# written from the protocol's table
PROTOCOL = {
    100: "no_frame", 101: "stale_frame", 102: "image_quality", 103: "scene_moved", 110: "no_block_found",
    111: "touches_border", 112: "area_out_of_limits", 113: "methods_disagree", 114: "uncertainty_too_large",
    115: "outside_work_area", 116: "several_blocks", 117: "edge_covered", 118: "edge_contradicted",
    119: "part_does_not_fit", 120: "busy", 121: "not_ready", 122: "unknown_recipe", 130: "too_many_points",
    131: "self_intersecting", 140: "calibration_missing", 141: "calibration_mismatch", 142: "sentinel_moved",
    150: "controller_timeout", 151: "controller_refused", 152: "controller_lost", 153: "controller_restarted",
    154: "service_restarted", 155: "other_service", 156: "expired", 160: "storage_full", 161: "aborted",
    190: "internal_error",
}  # fmt: skip


def test_codes_and_names_are_the_protocols() -> None:
    assert {int(reason): reason.label for reason in Reason} == PROTOCOL


@pytest.mark.parametrize("code", sorted(PROTOCOL))
def test_outcome_is_refused_for_101_to_142_and_151_and_failed_for_the_others(code: int) -> None:
    refused = 101 <= code <= 142 or code == 151
    assert Reason(code).outcome is (Outcome.REFUSED if refused else Outcome.FAILED)


@pytest.mark.parametrize("language", list(Language))
def test_each_reason_tells_what_it_means_and_what_to_do_next(language: Language) -> None:
    texts = []
    for reason in Reason:
        told = reason.explained(language)
        assert told.sentence.endswith(".")
        assert told.next_action.endswith(".")
        texts.append(told.sentence)
    assert len(set(texts)) == len(texts)


def test_russian_is_russian_and_english_is_not() -> None:
    for reason in Reason:
        letters = [letter for letter in str(reason.explained(Language.RUSSIAN)) if letter.isalpha()]
        assert sum("а" <= letter.lower() <= "я" or letter.lower() == "ё" for letter in letters) > 0.5 * len(letters)
        assert str(reason.explained(Language.ENGLISH)).isascii()


def test_what_the_core_refuses_for_stands_in_the_table_under_the_same_name() -> None:
    assert {int(refusal): refusal.reason for refusal in Refusal}.items() <= PROTOCOL.items()


def test_the_docs_page_is_fresh() -> None:
    fresh = "python -m service.reasons_doc docs/reference/reasons.md"
    assert (ROOT / "docs" / "reference" / "reasons.md").read_text(encoding="utf-8") == page(), f"write it anew: {fresh}"


def test_the_command_prints_all_reasons_or_those_asked_for(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["reasons"]) == 0
    printed = capsys.readouterr().out
    for code, name in PROTOCOL.items():
        assert f"{code} {name} (" in printed
    assert main(["reasons", "--language", "ru", "touches_border", "121"]) == 0
    printed = capsys.readouterr().out
    assert [line.split()[0] for line in printed.splitlines() if not line.startswith(" ")] == ["111", "121"]
    assert Reason.TOUCHES_BORDER.explained(Language.RUSSIAN).next_action in printed


def test_a_reason_that_there_is_not_is_wrong_usage(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["reasons", "999"]) == 2
    assert "999: there is no such reason" in capsys.readouterr().err
