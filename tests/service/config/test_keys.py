"""Keys put into a configuration's text: what else stands there stays."""

from __future__ import annotations

import pytest

from service.config.keys import KeysNotSet, with_keys

BLOCK = """\
# our line
camera: {kind: files, path: x}
controller:   # the cutter
  # by the door
  kind: modbus-tcp
  port: 502   # as always
  host: "10.0.0.1"

log: {level: info}
"""


def test_keys_are_changed_in_place_and_new_ones_come_to_the_section() -> None:
    fresh = with_keys(BLOCK, "controller", {"port": 1502, "device_id": 255, "host": "b"})
    assert fresh == BLOCK.replace("  kind: modbus", "  device_id: 255\n  kind: modbus").replace(
        "502   #", "1502   #"
    ).replace('"10.0.0.1"', "b")


def test_a_section_in_braces_stays_in_braces() -> None:
    text = "controller: {kind: modbus-tcp, port: 502}  # one line\n"
    fresh = with_keys(text, "controller", {"port": 1, "word_order": "little"})
    assert fresh == "controller: {kind: modbus-tcp, port: 1, word_order: little}  # one line\n"


@pytest.mark.parametrize(
    "text", ["", "camera: {}\n", "controller: none\n", "controller: {}\n", "controller: {a: [1]}\n"]
)
def test_what_cannot_be_changed_is_told(text: str) -> None:
    with pytest.raises(KeysNotSet, match="by hand"):
        with_keys(text, "controller", {"a": 1})
