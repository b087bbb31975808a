"""The token file is refused unless only its owner can read it; guessing is bounded."""

from __future__ import annotations

from pathlib import Path

import pytest

from service.web.people.tokens import Rate, TokenFile, TokenFileError, network_of

GOOD = "anna 0123456789abcdefghij\n# gone: oleg\n\noleg\tABCDEFGHIJ0123456789\n"


def written(folder: Path, text: str, mode: int = 0o600) -> TokenFile:
    path = folder / "tokens"
    path.write_text(text)
    path.chmod(mode)
    return TokenFile(path)


def test_a_token_tells_whose_it_is_and_nothing_else_does(tmp_path: Path) -> None:
    tokens = written(tmp_path, GOOD)
    assert tokens.holder("0123456789abcdefghij") == "anna"
    assert tokens.holder("ABCDEFGHIJ0123456789") == "oleg"
    for other in ("", "anna", "0123456789abcdefghi", "0123456789ABCDEFGHIJ", "0123456789abcdefghij ", "ключ", "\ud800"):
        assert tokens.holder(other) is None


def test_a_line_taken_out_counts_at_once(tmp_path: Path) -> None:
    tokens = written(tmp_path, GOOD)
    assert tokens.holder("0123456789abcdefghij") == "anna"
    written(tmp_path, "oleg ABCDEFGHIJ0123456789\n")
    assert tokens.holder("0123456789abcdefghij") is None


@pytest.mark.parametrize("mode", [0o644, 0o640, 0o660, 0o400, 0o700, 0o604])
def test_any_mode_but_0600_is_refused(tmp_path: Path, mode: int) -> None:
    with pytest.raises(TokenFileError, match=f"has mode {mode:04o}, expected 0600"):
        written(tmp_path, GOOD, mode).read()


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "holds no token"),
        ("# nobody\n", "holds no token"),
        ("0123456789abcdefghij\n", "line 1 is not 'name token'"),
        ("anna short\n", "line 1: a token of 5 characters, expected 20"),
        (GOOD + "anna aaaaaaaaaaaaaaaaaaaaaaa\n", "line 5: anna is there more than once"),
        ("anna 0123456789abcdefghij more\n", "line 1 is not"),
        ("анна 0123456789abcdefghij\n", "byte 1 is no ASCII"),
    ],
)
def test_a_mistake_in_the_file_is_told_without_showing_a_token(tmp_path: Path, text: str, expected: str) -> None:
    with pytest.raises(TokenFileError, match=expected) as error:
        written(tmp_path, text).read()
    assert "0123456789" not in str(error.value)


def test_a_link_a_folder_and_nothing_are_refused(tmp_path: Path) -> None:
    written(tmp_path, GOOD)
    (tmp_path / "link").symlink_to(tmp_path / "tokens")
    for name in ("link", "nowhere"):
        with pytest.raises(TokenFileError, match="cannot be read"):
            TokenFile(tmp_path / name).read()
    with pytest.raises(TokenFileError, match="is no file"):
        TokenFile(tmp_path).read()


def test_a_rate_holds_for_each_key_and_ends_with_time() -> None:
    now = [100.0]
    rate = Rate(2, 60.0, now=lambda: now[0])
    for _ in range(2):
        assert rate.wait_s("a") == 0
        rate.add("a")
    assert (rate.wait_s("a"), rate.wait_s("b")) == (60, 0)
    now[0] += 45
    assert rate.wait_s("a") == 15
    now[0] += 15
    assert rate.wait_s("a") == 0
    rate.add("a")
    rate.take_back("a")
    assert rate.wait_s("a") == 0


def test_a_rate_remembers_a_bounded_number_of_keys() -> None:
    rate = Rate(1, 60.0, most_keys=3, now=lambda: 0.0)
    for k in range(10):
        rate.add(str(k))
    assert [rate.wait_s(str(k)) > 0 for k in range(10)] == [False] * 7 + [True] * 3


def test_guesses_are_counted_by_what_one_computer_has() -> None:
    assert network_of("192.0.2.7") == "192.0.2.7"
    assert network_of("::ffff:192.0.2.7") == "192.0.2.7"
    assert network_of("2001:db8::1") == network_of("2001:db8::ffff:2") == "2001:db8::/64"
    assert network_of("fe80::1%eth0") == "fe80::/64"
