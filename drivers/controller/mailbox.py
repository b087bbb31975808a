"""The contour mailbox, version 1: what stands in which register. Pure: registers in, dataclasses out, and back."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

WordOrder = Literal["big", "little"]


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
    test_value: int = 0x01020304
    session_ack: int = 0
    owner: int = 0
    settled_job: int = 0


@dataclass(frozen=True)
class Page:
    """One page as registers: header offsets 1…31 (31 registers, without the commit register), then the payload."""

    header: tuple[int, ...]
    payload: tuple[int, ...]
