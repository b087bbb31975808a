"""A controller in memory that plays a script: which answer to which commit, which request or reply is lost.

It stands behind the driver's role, so that each rule of a transfer can be tried alone; the whole protocol over real
sockets is tried elsewhere.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import replace

from drivers.controller import ControllerRefused, ControllerUnavailable
from drivers.controller.mailbox.blocks import Answer, LinkBlock, ServiceBlock
from drivers.controller.mailbox.pages import Page

FINAL = {Answer.ACCEPTED, Answer.GEOMETRY_REFUSED, Answer.EXPIRED, Answer.OPERATOR_REFUSED, Answer.WITHDRAWN}


class ScriptedController:
    """answers: what is said to commit after commit; None = no answer; when it runs out, the last one again.

    faults: name of a request -> what happens to each of them in turn: "" = nothing, "request" = lost on the way,
    "reply" = done, but its reply is lost, "exception" = answered with a Modbus exception.
    """

    def __init__(self, answers: Iterable[int | None] = (Answer.ACCEPTED,), session: int = 9) -> None:
        self.link = LinkBlock(controller_state=1, session=session, test_echo=0x01020305)
        self.answers = list(answers)
        self.faults: dict[str, list[str]] = {}
        self.requests: list[tuple[str, object]] = []
        self.service = ServiceBlock()
        self.page: Page | None = None
        self.transfer = 0
        self.accepted: list[Page] = []
        self.connects = 0
        self.reachable = True
        self.beating = True
        self.clock_runs = True
        self.withdraws = False  # True: a withdrawal is answered whatever the script says
        self.started_at = time.monotonic()
        self.before_commit: Callable[[], None] = lambda: None
        self._connected = False

    # --- the role -----------------------------------------------------------------------------------------------

    @property
    def connected(self) -> bool:
        return self._connected

    async def connect(self) -> None:
        self.connects += 1
        self._connected = False
        if not self.reachable:
            raise ControllerUnavailable("nobody listens")
        self._connected = True

    async def close(self) -> None:
        self._connected = False

    async def read_link(self) -> LinkBlock:
        self._meet("read_link")
        return self.shown()

    def glance(self) -> LinkBlock | None:
        return None

    def shown(self) -> LinkBlock:
        """The block at this moment."""
        beat = int(time.monotonic() * 50) & 0xFFFF if self.beating else 0
        clock = int((time.monotonic() - self.started_at) * 1000) + 1000 if self.clock_runs else 0
        return replace(self.link, controller_heartbeat=beat, clock=clock)

    async def read_service(self) -> ServiceBlock:
        self._meet("read_service")
        return self.service

    async def write_service(self, block: ServiceBlock) -> None:
        with_reply = self._meet("write_service", block)
        self.service = block
        self._reply(with_reply)

    async def write_transfer(self, transfer: int) -> None:
        name = "commit" if transfer else "clear"
        with_reply = self._meet(name, transfer)
        self.transfer = transfer
        if transfer:
            self._decide()
        self._reply(with_reply)

    async def write_page(self, page: Page) -> None:
        assert self.transfer == 0, "payload written without a confirmed transfer = 0 before it"
        with_reply = self._meet("write_page", page)
        self.page = page
        self._reply(with_reply)

    async def read_page(self, payload_length: int, part_length: int = 0) -> Page:
        self._meet("read_page")
        assert self.page is not None
        assert payload_length == len(self.page.payload)
        if self.faults.get("readback_differs"):
            self.faults["readback_differs"].pop()
            return Page((*self.page.header[:-1], self.page.header[-1] ^ 1), self.page.payload)
        return self.page

    # --- the script ---------------------------------------------------------------------------------------------

    def restart(self, session: int, *, memory: bool) -> None:
        """Start the controller's program again, with or without its retained memory."""
        kept = (self.link.last_job, self.link.last_result) if memory else (0, 0)
        self.link = LinkBlock(
            controller_state=1, session=session, test_echo=0x01020305, last_job=kept[0], last_result=kept[1]
        )
        self.transfer, self.page = 0, None

    def count(self, name: str) -> int:
        return sum(request == name for request, _ in self.requests)

    def _decide(self) -> None:
        self.before_commit()
        assert self.page is not None
        layout, job_id = self.page.header[0], self.page.header[1] << 16 | self.page.header[2]
        if job_id == self.link.last_job:
            self._say(Answer.ACCEPTED_BEFORE if self.link.last_result == Answer.ACCEPTED else self.link.last_result)
            return
        answer = self.answers.pop(0) if len(self.answers) > 1 else self.answers[0]
        if layout == 0 and self.withdraws:
            answer = Answer.WITHDRAWN
        if answer is None:
            return
        if layout == 0:
            answer = Answer.WITHDRAWN
        header = self.page.header
        held = answer == Answer.ACCEPTED and header[3] < header[4]  # a page that is not the last one
        if answer in FINAL and not held:
            self.link = replace(self.link, last_result=int(answer), last_job=job_id)
            if answer == Answer.ACCEPTED:
                self.accepted.append(self.page)
        self._say(answer)

    def _say(self, answer: int) -> None:
        self.link = replace(self.link, ack_result=int(answer), ack_transfer=self.transfer)

    def _meet(self, name: str, value: object = None) -> bool:
        """Note the request and let its fault happen; True when its reply will be lost."""
        if not self._connected or not self.reachable:
            self._connected = False
            raise ControllerUnavailable("not connected")
        if name not in ("read_link", "read_service"):
            self.requests.append((name, value))
        faults = self.faults.get(name)
        fault = faults.pop(0) if faults else ""
        if fault == "request":
            self._connected = False
            raise ControllerUnavailable(f"{name}: connection reset")
        if fault == "exception":
            raise ControllerRefused(f"{name}: exception 4", 4)
        return fault == "reply"

    def _reply(self, lost: bool) -> None:
        if lost:
            self._connected = False
            raise ControllerUnavailable("no reply within 1 s")
