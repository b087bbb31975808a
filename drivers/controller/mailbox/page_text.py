"""Pages as text, for whoever keeps them: four hexadecimal digits a register."""

from __future__ import annotations

import sys
from array import array
from collections.abc import Iterable
from dataclasses import replace
from itertools import chain

from drivers.controller.mailbox.pages import HEADER_REGISTERS, Page, header_value


def pages_to_text(pages: Iterable[Page]) -> str:
    """Pages one after the other, header then payload; the last page's part block, where it has one, behind a blank."""
    kept = tuple(pages)
    text = _to_text(chain.from_iterable(chain(page.header, page.payload) for page in kept))
    return f"{text} {_to_text(kept[-1].part)}" if kept and kept[-1].part else text


def _to_text(registers: Iterable[int]) -> str:
    words = array("H", registers)
    if sys.byteorder == "little":
        words.byteswap()
    return words.tobytes().hex()


def _from_text(text: str) -> array[int]:
    """The registers; ValueError where the text was damaged."""
    words = array("H", bytes.fromhex(text))
    if sys.byteorder == "little":
        words.byteswap()
    return words


def pages_from_text(text: str) -> tuple[Page, ...]:
    """The pages that `pages_to_text` wrote; each header says where its page ends. Empty where the text was damaged."""
    of_pages, _, of_part = text.partition(" ")
    try:
        registers, part = _from_text(of_pages), tuple(_from_text(of_part))
    except ValueError:
        return ()
    pages, start = [], 0
    while start < len(registers):
        body = start + HEADER_REGISTERS
        if body > len(registers):
            return ()
        header = tuple(registers[start:body])
        end = body + header_value(header, "payload_length")
        if end > len(registers):
            return ()
        pages.append(Page(header, tuple(registers[body:end])))
        start = end
    if part and pages:
        pages[-1] = replace(pages[-1], part=part)
    return tuple(pages)
