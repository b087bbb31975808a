"""The simulated controller's program on bare registers, and pages to put there."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from drivers.controller.mailbox.layout import MailboxLayout
from drivers.controller.mailbox.pages import ContourMessage, Page, crc32_of, encode_pages
from drivers.controller.simulated.contour import AcceptedContour
from drivers.controller.simulated.memory import RetainedMemory
from drivers.controller.simulated.program import ControllerProgram, ProgramStart, judge_by_geometry
from drivers.controller.simulated.verdict import Verdict
from drivers.controller.simulated.watch import ClientWatch
from tests.support.controller.protocol_decoder import Layout, Link, Service, encode_service

EXTERIOR = np.array([[0, 0], [100_000, 0], [100_000, 50_000], [0, 50_000]])
HOLE = np.array([[10_000, 10_000], [10_000, 20_000], [20_000, 20_000]])
SESSION = 9


@dataclass
class Bench:
    """A program on bare registers, with a client's hands."""

    layout: MailboxLayout = field(default_factory=MailboxLayout)
    memory: RetainedMemory = field(default_factory=RetainedMemory)
    verdict: Verdict = field(default_factory=Verdict)
    has_clock: bool = True
    clock_start_ms: int = 0
    started: bool = True
    session: int = SESSION

    def __post_init__(self) -> None:
        self.registers = [0] * 65536
        self.watch = ClientWatch(self.layout, self.verdict)
        self.now_ms = 0
        self.transfer = 0
        self.taken: list[AcceptedContour] = []
        self.verdicts = judge_by_geometry
        self.restart(self.session)
        if self.started:
            self.scan(3)

    def restart(self, session: int) -> None:
        start = ProgramStart(lambda: session, self.judge, self.has_clock, self.clock_start_ms)
        self.program = ControllerProgram(self.registers, self.layout, self.memory, self.watch, start)
        self.now_ms = 0

    def judge(self, contour: AcceptedContour) -> int:
        return self.verdicts(contour)

    def scan(self, times: int = 1, elapsed_ms: int = 10) -> Link:
        for _ in range(times):
            self.now_ms += elapsed_ms
            contour = self.program.scan(self.now_ms)
            if contour is not None:
                self.taken.append(contour)
        return self.link

    @property
    def link(self) -> Link:
        return Layout(word_order=self.layout.word_order).link(self.registers)

    def write_service(self, **values: int) -> None:
        block = replace(Service(protocol_version=1, service_state=5, test_value=0x01020304), **values)
        self.registers[16:32] = encode_service(block, self.layout.word_order)

    def send(self, page: Page, transfer: int | None = None) -> Link:
        """Place the page and commit it; the link block after the scan that saw it."""
        self.transfer = transfer if transfer is not None else self.transfer % 0xFFFF + 1
        self.registers[33 : 64 + len(page.payload)] = [*page.header, *page.payload]
        self.registers[32] = self.transfer
        return self.scan()


def pages(capacity: int = 1984, word_order: str = "big", **changes: object) -> tuple[Page, ...]:
    message = ContourMessage(1, (EXTERIOR, HOLE), 4950, None, 0, 2, True, True, 0, SESSION)
    return encode_pages(replace(message, **changes), capacity, word_order)


def sealed(page: Page, **registers: int) -> Page:
    """The page with header registers set (by `at<offset>`) and its CRC made right again."""
    header = list(page.header)
    for name, value in registers.items():
        header[int(name[2:]) - 1] = value
    crc = crc32_of(header, page.payload)
    header[7:9] = crc >> 16, crc & 0xFFFF
    return Page(tuple(header), page.payload)
