"""PINs are kept as hashes only, and cannot be guessed at leisure."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import pytest

from service.web.people.pins import (
    FIRST_LOCK_S,
    FORGOTTEN_S,
    FREE_TRIES,
    LONGEST_LOCK_S,
    MOST_KEYS,
    PeopleFile,
    Tries,
    line_of,
)
from service.web.people.tokens import TokenFileError

ANNA = line_of("anna", "4711")


@dataclass
class Clock:
    """Time that only a test lets pass."""

    now_s: float = 0.0

    def __call__(self) -> float:
        return self.now_s


def people(folder: Path, text: str, mode: int = 0o600) -> PeopleFile:
    path = folder / "people"
    path.write_text(text)
    path.chmod(mode)
    return PeopleFile(path)


def test_a_pin_is_a_persons_own_and_the_file_does_not_hold_it(tmp_path: Path) -> None:
    file = people(tmp_path, f"# the night shift\n\n{ANNA}\n{line_of('oleg', '471100')}\n")
    assert file.holds("anna", "4711")
    assert file.holds("oleg", "471100")
    for name, pin in (
        ("anna", "471100"),
        ("anna", ""),
        ("anna", "47110"),
        ("nobody", "4711"),
        ("", ""),
        ("anna", "४७११"),
    ):
        assert not file.holds(name, pin)
    assert re.search(r"4711\b", file.path.read_text()) is None
    assert line_of("anna", "4711") != ANNA, "the same PIN looks different each time"


def test_a_line_that_is_taken_out_counts_at_once(tmp_path: Path) -> None:
    file = people(tmp_path, f"{ANNA}\n{line_of('oleg', '0815')}\n")
    assert file.holds("oleg", "0815")
    file.path.write_text(f"{ANNA}\n")
    assert not file.holds("oleg", "0815")


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "holds nobody"),
        ("anna 4711\n", "line 1 is not a line of `combtrace pin NAME`"),
        (f"{ANNA}\n{ANNA}\n", "line 2: anna is there more than once"),
        (ANNA.replace("scrypt$14", "scrypt$2"), "line 1 is damaged"),
        (ANNA.replace("scrypt$14", "scrypt$30"), "line 1 is damaged"),
        (ANNA[:-8], "line 1 is damaged"),
        (f"{ANNA}é", "is no ASCII"),
    ],
    ids=["empty", "a plain PIN", "twice", "too cheap", "too costly", "cut off", "no ASCII"],
)
def test_a_file_that_cannot_be_used_says_why_and_shows_no_hash(tmp_path: Path, text: str, told: str) -> None:
    with pytest.raises(TokenFileError, match=re.escape(told)) as error:
        people(tmp_path, text).read()
    assert ANNA.split("$")[-1][:12] not in str(error.value)


def test_a_file_that_others_may_read_is_not_used(tmp_path: Path) -> None:
    with pytest.raises(TokenFileError, match="mode 0640, expected 0600"):
        people(tmp_path, ANNA, mode=0o640).read()
    with pytest.raises(TokenFileError, match="cannot be read"):
        PeopleFile(tmp_path / "nowhere").read()
    (tmp_path / "link").symlink_to(people(tmp_path, ANNA).path)
    with pytest.raises(TokenFileError, match="cannot be read"):
        PeopleFile(tmp_path / "link").read()


@pytest.mark.parametrize("pin", ["", "123", "1" * 13, "12a4", "१२३४", "12 34", "-123"])
def test_what_is_no_pin_is_refused(pin: str) -> None:
    with pytest.raises(ValueError, match="no PIN"):
        line_of("anna", pin)


@pytest.mark.parametrize("name", ["", "anna b", "анна", "a:b", "x" * 41])
def test_what_is_no_name_is_refused(name: str) -> None:
    with pytest.raises(ValueError, match="no name"):
        line_of(name, "4711")


def test_after_some_tries_each_further_one_locks_for_twice_as_long() -> None:
    clock = Clock()
    tries = Tries(FREE_TRIES, now=clock)
    for _ in range(FREE_TRIES):
        assert tries.wait_s("anna") == 0
        tries.wrong("anna")
    locks = []
    for _ in range(12):
        locks.append(tries.wait_s("anna"))
        clock.now_s += locks[-1]
        assert tries.wait_s("anna") == 0
        tries.wrong("anna")
    assert locks[:4] == [FIRST_LOCK_S * factor for factor in (1, 2, 4, 8)]
    assert locks[-1] == LONGEST_LOCK_S
    assert tries.wait_s("oleg") == 0


def test_a_right_one_ends_the_lock_and_so_does_a_quiet_day() -> None:
    clock = Clock()
    tries = Tries(1, now=clock)
    tries.wrong("anna")
    assert tries.wait_s("anna") > 0
    tries.right("anna")
    assert tries.wait_s("anna") == 0
    for _ in range(10):
        tries.wrong("oleg")
    clock.now_s += FORGOTTEN_S + 1
    tries.wrong("oleg")
    assert tries.wait_s("oleg") == FIRST_LOCK_S


def test_many_addresses_do_not_fill_the_memory() -> None:
    tries = Tries(1)
    for number in range(MOST_KEYS + 10):
        tries.wrong(str(number))
    assert tries.wait_s("0") == 0
    assert tries.wait_s(str(MOST_KEYS)) > 0


def test_a_day_of_guessing_tries_fewer_than_forty_pins() -> None:
    clock = Clock()
    tries = Tries(FREE_TRIES, now=clock)
    guesses = 0
    while clock.now_s < 24 * 3600:
        clock.now_s += tries.wait_s("anna")
        tries.wrong("anna")
        guesses += 1
    assert guesses < 40
