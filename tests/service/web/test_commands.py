"""Orders are noted before they are carried out, or not carried out."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from service.daemon.control import CommandRefused
from service.reasons import Reason
from service.records.journal import Journal
from service.records.journal_reader import Note, reading
from service.web.commands import Commands, Known, Order, RequestRefused
from service.web.people.lease import Lease

ORDER = Order("adopt recipe", "recipe 1: margin_mm 0.0 -> 2.0; new blade", "nothing is adopted")


def commands(journal: Journal) -> Commands:
    daemon: Any = SimpleNamespace(lease=Lease())
    return Commands(daemon, journal, Known())


async def test_an_order_that_cannot_be_noted_is_not_carried_out(tmp_path: Path) -> None:
    journal = Journal(tmp_path / "journal.sqlite")
    journal.refuse_writes()

    async def do() -> tuple[None, str]:
        pytest.fail("it was carried out")

    with pytest.raises(RequestRefused, match="cannot be written, so nothing is adopted") as refused:
        await commands(journal).carry_out("anna", "10.0.0.9", ORDER, do)
    assert (refused.value.status, refused.value.reason) == (503, Reason.STORAGE_FULL)
    journal.close()


async def test_the_note_is_there_before_it_is_carried_out_and_says_afterwards_what_became_of_it(tmp_path: Path) -> None:
    path = tmp_path / "journal.sqlite"
    journal = Journal(path)
    seen: list[Note] = []

    async def do() -> tuple[int, str]:
        with reading(path) as reader:
            seen.extend(reader.notes(1))
        return 7, "adoption 7"

    async def refuse() -> tuple[int, str]:
        raise CommandRefused("recipe 1 is no longer what it was")

    assert await commands(journal).carry_out("anna", "10.0.0.9", ORDER, do) == 7
    assert (seen[0].who, seen[0].action, seen[0].detail, seen[0].result) == ("anna", ORDER.action, ORDER.detail, None)
    with pytest.raises(RequestRefused, match="no longer what it was"):
        await commands(journal).carry_out("anna", "10.0.0.9", ORDER, refuse)
    with reading(path) as reader:
        results = [note.result for note in reader.notes(2)]
    assert results == ["refused: recipe 1 is no longer what it was", "adoption 7"]
    journal.close()
