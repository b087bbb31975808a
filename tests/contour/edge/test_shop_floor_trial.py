"""A smoke of the trial that counts what becomes of blocks with things on them."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.accuracy import shop_floor

SEED = 968_007


def row(said: str, name: str) -> list[str]:
    """The row of this name in the table that was printed."""
    return next(
        [cell.strip() for cell in line.split("|")[2:-1]]
        for line in said.splitlines()
        if line[:-1].startswith(f"| {name} |")
    )


def test_a_clean_block_is_right_and_one_below_a_tape_is_refused_as_covered(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    asked = ["--kinds", "undisturbed,tape", "--seeds", "1", "--first", str(SEED), "--alone", "--save", str(tmp_path)]
    assert shop_floor.main(asked) == 0
    said = capsys.readouterr().out
    assert row(said, "undisturbed")[:5] == ["1", "1", "0", "0", "0"]
    assert row(said, "tape")[:5] == ["1", "0", "0", "0", "1 by 117"]
    assert not any(tmp_path.iterdir())


def test_a_block_on_wood_is_right_where_the_table_was_taught() -> None:
    taught = shop_floor.judged("wood", SEED, alone=True, taught=True)
    assert taught.accepted
    assert not taught.wrong
