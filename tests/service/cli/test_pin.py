"""`combtrace pin` prints a line by which its PIN, and no other, is known."""

from __future__ import annotations

import io
from pathlib import Path

import pytest

from service.web.people.pins import PeopleFile
from tests.support.processes.processes import called


def test_the_line_lets_that_pin_in_and_does_not_show_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO("4711\n"))
    done = called("pin", "anna")
    assert (done.returncode, "4711" in done.stdout.split("$")[0]) == (0, False)
    path = tmp_path / "people"
    path.touch(0o600)
    path.write_text(done.stdout)
    assert PeopleFile(path).holds("anna", "4711")
    assert not PeopleFile(path).holds("anna", "4712")


@pytest.mark.parametrize(("name", "pin", "told"), [("anna", "12", "4 to 12 digits"), ("an na", "4711", "no name")])
def test_what_cannot_be_is_told_and_prints_no_line(
    name: str, pin: str, told: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO(f"{pin}\n"))
    done = called("pin", name)
    assert (done.returncode, done.stdout) == (2, "")
    assert told in done.stderr


class Terminal(io.StringIO):
    """Where somebody types."""

    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize(("typed", "status"), [(["4711", "4711"], 0), (["4711", "4712"], 2)])
def test_at_a_terminal_it_is_asked_for_twice(typed: list[str], status: int, monkeypatch: pytest.MonkeyPatch) -> None:
    answers = iter(typed)
    monkeypatch.setattr("sys.stdin", Terminal())
    monkeypatch.setattr("getpass.getpass", lambda _prompt: next(answers))
    assert called("pin", "anna").returncode == status
