"""The two blocks of 16 registers: the controller's link block and the service's; states and answers in them."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from enum import IntEnum

from drivers.controller.errors import MailboxError
from drivers.controller.mailbox.words import Unpacking, WordOrder, fields, pack

BLOCK_REGISTERS = 16
TEST_VALUE = 0x01020304


class Answer(IntEnum):
    """The controller's answer to a page (`ack_result`, `last_result`)."""

    ACCEPTED = 1
    BAD_CRC = 2
    BAD_LAYOUT = 3
    GEOMETRY_REFUSED = 4
    EXPIRED = 5
    ACCEPTED_BEFORE = 6
    OPERATOR_REFUSED = 7
    OUTDATED = 8
    PAGE_MISSING = 9
    NOT_READY = 10
    WITHDRAWN = 11

    @property
    def final(self) -> bool:
        """True where the answer ends the job."""
        return self in FINAL_ANSWERS


FINAL_ANSWERS = frozenset(
    {Answer.ACCEPTED, Answer.GEOMETRY_REFUSED, Answer.EXPIRED, Answer.OPERATOR_REFUSED, Answer.WITHDRAWN}
)


class ControllerState(IntEnum):
    """`controller_state`: what the cutting machine is doing."""

    NOT_READY = 0
    READY = 1
    BUSY = 2
    FAULT = 3


@dataclass(frozen=True)
class LinkBlock:
    """What the controller writes, 16 registers; names as in the protocol. Lengths in µm, times in ms."""

    controller_state: int = 0
    controller_heartbeat: int = 0
    trigger_counter: int = 0
    recipe: int = 0
    block_thickness: int = 0
    ack_transfer: int = 0
    ack_result: int = 0
    test_echo: int = 0
    last_job: int = 0
    last_result: int = 0
    session: int = 0
    clock: int = 0


@dataclass(frozen=True)
class ServiceBlock:
    """What the service writes, 16 registers; names as in the protocol."""

    protocol_version: int = 1
    service_state: int = 1
    service_heartbeat: int = 0
    trigger_ack: int = 0
    missed_triggers: int = 0
    reject_reason: int = 0
    job_id: int = 0
    test_value: int = TEST_VALUE
    session_ack: int = 0
    owner: int = 0
    settled_job: int = 0


LINK_FIELDS = fields(
    (0, "controller_state", "u16"),
    (1, "controller_heartbeat", "u16"),
    (2, "trigger_counter", "u16"),
    (3, "recipe", "u16"),
    (4, "block_thickness", "u32"),
    (6, "ack_transfer", "u16"),
    (7, "ack_result", "u16"),
    (8, "test_echo", "u32"),
    (10, "last_job", "u32"),
    (12, "last_result", "u16"),
    (13, "session", "u16"),
    (14, "clock", "u32"),
)
SERVICE_FIELDS = fields(
    (0, "protocol_version", "u16"),
    (1, "service_state", "u16"),
    (2, "service_heartbeat", "u16"),
    (3, "trigger_ack", "u16"),
    (4, "missed_triggers", "u16"),
    (5, "reject_reason", "u16"),
    (6, "job_id", "u32"),
    (8, "test_value", "u32"),
    (10, "session_ack", "u16"),
    (11, "owner", "u16"),
    (12, "settled_job", "u32"),
)
_UNPACK_LINK, _UNPACK_SERVICE = Unpacking(LINK_FIELDS), Unpacking(SERVICE_FIELDS)


def decode_link(registers: Sequence[int], word_order: WordOrder) -> LinkBlock:
    """The controller's block from its 16 registers."""
    return LinkBlock(**_unpacked(_UNPACK_LINK, registers, "link", word_order))


def encode_link(block: LinkBlock, word_order: WordOrder) -> tuple[int, ...]:
    """The 16 registers of the controller's block."""
    return tuple(pack(LINK_FIELDS, asdict(block), BLOCK_REGISTERS, word_order))


def decode_service(registers: Sequence[int], word_order: WordOrder) -> ServiceBlock:
    """The service's block from its 16 registers."""
    return ServiceBlock(**_unpacked(_UNPACK_SERVICE, registers, "service", word_order))


def encode_service(block: ServiceBlock, word_order: WordOrder) -> tuple[int, ...]:
    """The 16 registers of the service's block, the two reserved ones 0."""
    return tuple(pack(SERVICE_FIELDS, asdict(block), BLOCK_REGISTERS, word_order))


def _unpacked(unpacking: Unpacking, registers: Sequence[int], name: str, word_order: WordOrder) -> dict[str, int]:
    with suppress(struct.error):
        if len(registers) == BLOCK_REGISTERS:
            return unpacking(registers, word_order)
    raise MailboxError(f"the {name} block came as {list(registers)}, expected {BLOCK_REGISTERS} registers of 16 bits")
