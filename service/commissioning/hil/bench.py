"""A service's hands on a controller's mailbox, for tests: one step of the protocol a call, nothing of its own accord.

Calls block; heartbeat and connection live in a thread of their own, so a test may take its time.
"""

from __future__ import annotations

import asyncio
import secrets
import threading
import time
from collections.abc import Callable, Coroutine
from dataclasses import dataclass, replace
from pathlib import Path
from types import TracebackType
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from drivers.controller import Controller, ControllerError, LinkBlock, Page
from drivers.controller.errors import MailboxError
from drivers.controller.mailbox.blocks import encode_service
from drivers.controller.mailbox.layout import MailboxLayout
from drivers.controller.mailbox.pages import HEADER_OFFSETS, ContourMessage, encode_pages, with_registers, withdrawal
from drivers.controller.simulated.controller import SimulatedController
from service.commissioning.hil.presence import LOOK_S, HilError, Presence
from service.commissioning.hil.which_controller import config_of, loaded, over_tcp
from service.config.controllers import NoController
from service.jobs.executor import ROOM
from service.link.controller_clock import BEATS_TO_HOLD
from service.wiring.devices import mailbox_layout, make_controller

HOLDS_S = 3.0  # two changes of a heartbeat that changes once a second, and more
ANSWER_S = 5.0
BACK_S = 30.0
HALTED = 2
SQUARE_UM = ((0, 0), (100_000, 0), (100_000, 100_000), (0, 100_000))

T = TypeVar("T")


@dataclass(frozen=True)
class Answered:
    """What a controller answered to one page: `ack_result`, and the link block that said so."""

    result: int
    link: LinkBlock


class Bench:
    """The mailbox of one controller, from `with` to its end. Job ids begin 1,000 above all that is found there."""

    def __init__(self, controller: Controller, layout: MailboxLayout, simulated: SimulatedController | None) -> None:
        self.layout = layout
        self.simulated = simulated is not None
        self._presence = Presence(controller)
        self._server = simulated
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name="hil", daemon=True)
        self._transfer = secrets.randbelow(0xFFFF)
        self._highest_job = 0

    def __enter__(self) -> Bench:
        self._thread.start()
        try:
            self._do(self._start())
            self._highest_job = max(self._presence.highest_job, self._held().last_job) + ROOM
        except ControllerError as error:
            self._close()
            raise HilError(f"{error}") from error
        except BaseException:
            self._close()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        try:
            self.clear()
            self.publish(service_state=HALTED)
        except (HilError, ControllerError):
            if kind is None:
                raise
        finally:
            self._close()

    # --- what a test does -----------------------------------------------------------------------------------------

    def link(self) -> LinkBlock:
        """The controller's block, as two reads in a row showed it but for heartbeat and clock; raise HilError."""
        give_up_at = time.monotonic() + ANSWER_S
        before = self._read()
        while time.monotonic() < give_up_at:
            block = self._read()
            if replace(block, controller_heartbeat=0, clock=0) == replace(before, controller_heartbeat=0, clock=0):
                return block
            before = block
        raise HilError(f"the link block changed at each read for {ANSWER_S:g} s. Check link_address")

    def wait_for(self, condition: Callable[[LinkBlock], bool], what: str, timeout_s: float = ANSWER_S) -> LinkBlock:
        """The link block once `condition` holds of it; raise HilError that names `what` did not come."""
        give_up_at = time.monotonic() + timeout_s
        while not condition(block := self.link()):
            if time.monotonic() >= give_up_at:
                raise HilError(f"{what} did not come within {timeout_s:g} s; the link block is {block}")
            time.sleep(LOOK_S)
        return block

    def publish(self, **changes: int) -> None:
        """Change the service block, and write it at once; raise HilError where a value does not fit its register."""
        changed = replace(self._presence.block, **changes)
        try:
            encode_service(changed, self.layout.word_order)
        except MailboxError as error:
            raise HilError(str(error)) from error
        self._presence.block = changed
        self._do(self._presence.beat())

    def new_job(self) -> int:
        """A job_id above all that the controller knows, and that no call before gave."""
        self._highest_job = max(self._highest_job, self.link().last_job) + 1
        return self._highest_job

    def pages(
        self, job_id: int, rings_um: tuple[tuple[tuple[int, int], ...], ...] = (SQUARE_UM,), **changes: Any
    ) -> list[Page]:
        """The pages of a contour for this session: by default a square of 100 mm at the origin.

        changes: fields of ContourMessage (`captured_at`, `valid_for_ms`, `trigger`, `area_mm2`, …).
        """
        rings = tuple(np.array(ring, dtype=np.int64) for ring in rings_um)
        values: dict[str, Any] = {
            "job_id": job_id,
            "rings_um": rings,
            "area_mm2": round(sum(map(_area_mm2, rings))),
            "uncertainty_um": None,
            "captured_at": 0,
            "recipe": 1,
            "simulated": True,
            "aligned": False,
            "valid_for_ms": 0,
            "session": self.link().session,
            "trigger": 0,
            **changes,
        }
        return list(encode_pages(ContourMessage(**values), self.layout.payload_capacity, self.layout.word_order))

    def first_of_two(self, job_id: int, **changes: Any) -> Page:
        """Page 1 of 2 of a contour: however it is answered, no whole contour is there, so nothing can move."""
        (page,) = self.pages(job_id, **changes)
        table, pair = 2, 4
        length = table + 2 * pair
        changes = {"page_count": 2, "payload_length": length, "flags": 1}
        return self.sealed(
            Page(page.header, page.payload[:length]), {HEADER_OFFSETS[name]: value for name, value in changes.items()}
        )

    def sealed(self, page: Page, changes: dict[int, int]) -> Page:
        """The page with header registers changed, by offset, and its CRC made right."""
        return with_registers(page, changes, self.layout.word_order)

    def send(self, page: Page) -> Answered:
        """Steps 2, 3, 5 and 6 of a transfer: the answer to the page; raise HilError where none comes."""
        self.place(page)
        return self.commit()

    def place(self, page: Page) -> None:
        """Steps 2 and 3: clear `transfer`, write the page; nothing is committed."""
        self._do(self._presence.controller.write_transfer(0))
        self._do(self._presence.controller.write_page(page))

    def read_back(self, page: Page) -> Page:
        """The page as the controller holds it."""
        return self._do(self._presence.controller.read_page(len(page.payload)))

    def commit(self) -> Answered:
        """Steps 5 and 6: a new `transfer`, and the answer to it; raise HilError where none comes."""
        acknowledged = self.link().ack_transfer
        self._transfer = _next(self._transfer, acknowledged)
        self._do(self._presence.controller.write_transfer(self._transfer))
        transfer = self._transfer
        link = self.wait_for(lambda link: link.ack_transfer == transfer, f"the answer to transfer {transfer}")
        return Answered(link.ack_result, link)

    def clear(self) -> None:
        """Write `transfer` = 0."""
        self.write_transfer(0)

    def write_transfer(self, transfer: int) -> None:
        """Write the commit register, whatever the protocol says of the value; no answer is waited for."""
        self._do(self._presence.controller.write_transfer(transfer))

    def withdraw(self, job_id: int) -> Answered:
        """Take a job back; the answer."""
        return self.send(withdrawal(job_id, self.link().session, self.layout.word_order))

    def reconnect(self, timeout_s: float = BACK_S) -> LinkBlock:
        """The link block on a new connection, once the controller is back from a restart or a cut line; raise HilError.

        The service block is as it was published last; `transfer` is left as it stands there.
        """
        self._presence.trouble = None
        self._do(self._presence.again(timeout_s))
        return self.link()

    # --- inside -----------------------------------------------------------------------------------------------------

    async def _start(self) -> None:
        if self._server is not None:
            await self._server.start()
            self._presence = Presence(over_tcp(self._server.port, self.layout))
        await self._presence.begin()

    def _held(self) -> LinkBlock:
        """The link block as it stood over two changes of its heartbeat, so that none of it is half written.

        Where the heartbeat stands still, which a test is there to tell: as it stands after a while.
        """
        give_up_at = time.monotonic() + HOLDS_S
        before, changes = self.link(), 0
        while changes < BEATS_TO_HOLD and time.monotonic() < give_up_at:
            block = self.link()
            held = replace(block, controller_heartbeat=before.controller_heartbeat, clock=before.clock) == before
            changes = changes + (block.controller_heartbeat != before.controller_heartbeat) if held else 0
            before = block
        return before

    def _read(self) -> LinkBlock:
        return self._do(self._presence.controller.read_link())

    def _do(self, step: Coroutine[Any, Any, T]) -> T:
        trouble = self._presence.trouble
        if trouble is not None:
            step.close()
            if isinstance(trouble, HilError):
                raise trouble
            raise HilError(f"the controller was lost: {trouble}. `reconnect` where that was meant to be")
        try:
            return asyncio.run_coroutine_threadsafe(step, self._loop).result()
        except ControllerError as error:
            raise HilError(str(error)) from error

    def _close(self) -> None:
        asyncio.run_coroutine_threadsafe(self._end(), self._loop).result()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    async def _end(self) -> None:
        await self._presence.end()
        if self._server is not None:
            await self._server.stop()


def open_bench(url: str | None, config: Path | None) -> Bench:
    """A bench, not yet entered: on the URL's controller, else the configuration's, else a simulated one."""
    if url is not None and config is not None:
        raise HilError("two controllers are named, by URL and by a configuration file. Name one")
    if url is not None:
        found = config_of(url)
    elif config is not None:
        found = loaded(config)
    else:
        layout = MailboxLayout()
        server = SimulatedController(scan_s=0.005, layout=layout)
        return Bench(over_tcp(1, layout), layout, server)  # the port is known once it listens
    if not isinstance(found.controller, NoController) and found.controller.mode == "observe":
        raise HilError(
            f"{url or config}: controller.mode is observe: another process writes there, and the suite would too"
        )
    controller, layout_of = make_controller(found), mailbox_layout(found)
    if controller is None or layout_of is None:
        raise HilError(f"{config}: controller.kind is none. Name a configuration with a controller")
    return Bench(controller, layout_of, None)


def _next(transfer: int, acknowledged: int) -> int:
    value = transfer % 0xFFFF + 1
    return value if value != acknowledged else value % 0xFFFF + 1


def _area_mm2(ring: NDArray[np.int64]) -> float:
    x, y = ring[:, 0].astype(float), ring[:, 1].astype(float)
    return float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) / 2e6
