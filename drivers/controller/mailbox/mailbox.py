"""The contour mailbox, version 1: what stands in which register. Pure: registers in, dataclasses out, and back.

The one door to the codec; `protocol.md` is normative. Values cross it in the block's units (µm, mm², ms). What a
register cannot hold raises MailboxError before anything is sent.
"""

from __future__ import annotations

from drivers.controller.errors import ContourTooLarge, MailboxError
from drivers.controller.mailbox.blocks import (
    BLOCK_REGISTERS,
    FINAL_ANSWERS,
    LINK_FIELDS,
    SERVICE_FIELDS,
    TEST_VALUE,
    Answer,
    ControllerState,
    LinkBlock,
    ServiceBlock,
    decode_link,
    decode_service,
    encode_link,
    encode_service,
)
from drivers.controller.mailbox.layout import MailboxLayout
from drivers.controller.mailbox.pages import (
    HEADER_FIELDS,
    HEADER_REGISTERS,
    UNKNOWN_UNCERTAINTY,
    ContourMessage,
    Page,
    crc32_of,
    decode_header,
    encode_pages,
    micrometres,
    withdrawal,
)
from drivers.controller.mailbox.words import Field, WordOrder

__all__ = [
    "BLOCK_REGISTERS",
    "FINAL_ANSWERS",
    "HEADER_FIELDS",
    "HEADER_REGISTERS",
    "LINK_FIELDS",
    "SERVICE_FIELDS",
    "TEST_VALUE",
    "UNKNOWN_UNCERTAINTY",
    "Answer",
    "ContourMessage",
    "ContourTooLarge",
    "ControllerState",
    "Field",
    "LinkBlock",
    "MailboxError",
    "MailboxLayout",
    "Page",
    "ServiceBlock",
    "WordOrder",
    "crc32_of",
    "decode_header",
    "decode_link",
    "decode_service",
    "encode_link",
    "encode_pages",
    "encode_service",
    "micrometres",
    "withdrawal",
]
