"""What the journal is asked for again and again, until it is done."""

from __future__ import annotations

import threading

import pytest

from service.records.durable_journal import DurableJournal
from service.records.journal_file import JournalError


class Troubled:
    """A journal that fails with each of these texts in turn, then gives the thread that it was asked in."""

    def __init__(self, *texts: str) -> None:
        self.texts = list(texts)

    def ask(self) -> int:
        if self.texts:
            raise JournalError(self.texts.pop(0))
        return threading.get_ident()


@pytest.fixture(autouse=True)
def _quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("service.records.durable_journal.PAUSE_S", 0.001)


@pytest.mark.parametrize("here", [False, True])
async def test_it_is_tried_until_it_is_done_and_told_what_is_new(here: bool) -> None:
    said: list[tuple[str, bool] | str] = []
    durable = DurableJournal(
        lambda error, again: said.append((str(error), again)),
        on_done=lambda: said.append("done"),
        feed_watchdog=lambda: said.append("alive"),
    )
    journal = Troubled("full", "full", "gone")
    until_done = durable.until_done_here if here else durable.until_done
    thread = await until_done(journal.ask)
    assert (thread == threading.get_ident()) is here
    assert said == ["alive", ("full", False), "alive", ("full", True), "alive", ("gone", False), "alive", "done"]


async def test_a_defect_of_the_caller_is_not_tried_again() -> None:
    def conflict() -> None:
        raise ValueError("job 7 has ended already")

    durable = DurableJournal(lambda _error, _again: None)
    with pytest.raises(ValueError, match="ended already"):
        await durable.until_done(conflict)
