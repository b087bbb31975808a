"""A controller whose every write, and every change of what it says, is told: for those who write its program."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from dataclasses import fields

from drivers.controller import Controller
from drivers.controller.mailbox.blocks import Answer, ControllerState, LinkBlock, ServiceBlock
from drivers.controller.mailbox.layout import MailboxLayout
from drivers.controller.mailbox.pages import UNKNOWN_UNCERTAINTY, Page, decode_header
from service.logs import event
from service.reasons import Reason
from service.state import State

log = logging.getLogger("combtrace.wire")

IN_EVERY_ROUND = frozenset({"controller_heartbeat", "service_heartbeat", "clock"})
SAID_TOGETHER = {"ack_transfer": "ack_result", "last_job": "last_result", "settled_job": "reject_reason"}
WORDS_A_LINE = 16
ENUMS = {
    "controller_state": ControllerState,
    "ack_result": Answer,
    "last_result": Answer,
    "service_state": State,
    "reject_reason": Reason,
}


class LoggedController:
    """The same controller; what goes to it and what changes in its block is logged. registers: pages word by word."""

    def __init__(self, controller: Controller, layout: MailboxLayout, *, registers: bool = False) -> None:
        self._controller = controller
        self._layout = layout
        self._registers = registers
        self._read = LinkBlock()
        self._written: ServiceBlock | None = None

    @property
    def connected(self) -> bool:
        """As the controller's."""
        return self._controller.connected

    async def connect(self) -> None:
        """As the controller's."""
        await self._controller.connect()
        _log("connected")

    async def close(self) -> None:
        """As the controller's."""
        await self._controller.close()

    async def read_link(self) -> LinkBlock:
        """As the controller's."""
        return self._seen(await self._controller.read_link())

    def glance(self) -> LinkBlock | None:
        """As the controller's."""
        block = self._controller.glance()
        return None if block is None else self._seen(block)

    async def read_service(self) -> ServiceBlock:
        """As the controller's."""
        return await self._controller.read_service()

    async def write_service(self, block: ServiceBlock) -> None:
        """As the controller's."""
        await self._controller.write_service(block)
        before, self._written = self._written or ServiceBlock(service_state=0), block
        changed = list(_changes(before, block))
        if changed:
            _log(f"wrote  {', '.join(changed)}")

    async def write_transfer(self, transfer: int) -> None:
        """As the controller's."""
        await self._controller.write_transfer(transfer)
        _log(f"wrote  transfer {transfer}" + (" (the commit)" if transfer else " (nothing valid from here on)"))

    async def write_page(self, page: Page) -> None:
        """As the controller's."""
        await self._controller.write_page(page)
        _log(f"wrote  {self._page_text(page)}")
        if self._registers:
            self._dump(page)

    async def read_page(self, payload_length: int, part_length: int = 0) -> Page:
        """As the controller's."""
        page = await self._controller.read_page(payload_length, part_length)
        _log(f"read   the page back, {len(page.header) + payload_length + part_length} registers")
        return page

    def _seen(self, block: LinkBlock) -> LinkBlock:
        before, self._read = self._read, block
        changed = list(_changes(before, block))
        if changed:
            _log(f"read   {', '.join(changed)}")
        return block

    def _page_text(self, page: Page) -> str:
        head = decode_header(page, self._layout.word_order)
        if head["layout"] == 0:
            return f"the withdrawal of job {head['job_id']}, crc32 {head['crc32']:08X}"
        sure = "not known" if head["uncertainty"] == UNKNOWN_UNCERTAINTY else f"{head['uncertainty']} µm"
        parts = f", and a part block of {len(page.part)} registers with {page.part[1]} part(s)" if page.part else ""
        return (
            f"page {head['page']} of {head['page_count']} of job {head['job_id']}: {head['ring_count']} rings, "
            f"{head['point_count']} vertices, payload {head['payload_length']} registers, crc32 {head['crc32']:08X}, "
            f"flags {head['flags']:04b}, uncertainty {sure}, captured_at {head['captured_at']}, valid_for "
            f"{head['valid_for']}, session {head['session']}, trigger {head['trigger']}{parts}"
        )

    def _dump(self, page: Page) -> None:
        blocks = (
            (self._layout.part_address or 0, page.part),
            (self._layout.contour_address + 1, page.header + page.payload),
        )
        for first, words in blocks:
            for start in range(0, len(words), WORDS_A_LINE):
                line = " ".join(f"{word:04X}" for word in words[start : start + WORDS_A_LINE])
                _log(f"       {first + start:5d}: {line}")


def _changes(before: LinkBlock | ServiceBlock, after: LinkBlock | ServiceBlock) -> Iterator[str]:
    """What differs, by the registers' names, with the meaning of codes."""
    changed = {field.name for field in fields(after) if getattr(after, field.name) != getattr(before, field.name)}
    for name, partner in SAID_TOGETHER.items():
        if name in changed and hasattr(after, partner):
            changed.add(partner)
    for field in fields(after):
        if field.name in changed - IN_EVERY_ROUND:
            value = getattr(after, field.name)
            yield f"{field.name} {value}{_meaning(field.name, value)}"


def _meaning(name: str, value: int) -> str:
    known = ENUMS.get(name)
    if known is None or value not in set(known):
        return ""
    return f" ({known(value).name.lower()})"


def _log(text: str) -> None:
    log.info(text, extra=event("wire"))  # an event: never held back, however often it comes
