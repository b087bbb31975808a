"""Pages as text, for whoever keeps them: four hexadecimal digits a register."""

from __future__ import annotations

import sys
from array import array
from collections.abc import Iterable
from itertools import chain

from drivers.controller.mailbox.pages import HEADER_REGISTERS, Page, header_value


def pages_to_text(pages: Iterable[Page]) -> str:
    """Pages one after the other, header then payload."""
    registers = array("H", chain.from_iterable(chain(page.header, page.payload) for page in pages))
    if sys.byteorder == "little":
        registers.byteswap()
    return registers.tobytes().hex()


def pages_from_text(text: str) -> tuple[Page, ...]:
    """The pages that `pages_to_text` wrote; each header says where its page ends. Empty where the text was damaged."""
    try:
        registers = array("H", bytes.fromhex(text))
    except ValueError:
        return ()
    if sys.byteorder == "little":
        registers.byteswap()
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
    return tuple(pages)
