"""One job's pages to the controller, by the protocol's "A transfer": it ends only where the controller has decided.

What is about to be sent, or taken back, is made durable first, so that a restart goes on where this left off; see
`TransferSteps`. A withdrawal that gets no decision goes on all the same. While another service writes to the
controller, nothing is sent, and what the controller's block says is all that can end the job.
"""

from __future__ import annotations

import asyncio
import logging
from contextlib import suppress
from typing import NoReturn

from drivers.controller import ControllerError, ControllerUnavailable
from drivers.controller.mailbox.blocks import Answer, LinkBlock
from drivers.controller.mailbox.pages import Page
from service.link.controller_clock import MODULUS
from service.link.link import Link
from service.link.ownership import ForeignOwner
from service.link.reading import LinkUnsteady, echo_fault
from service.link.transfer_terms import (
    Lifetime,
    Outgoing,
    Settlement,
    TransferCounter,
    TransferSettings,
    TransferSteps,
)
from service.reasons import Outcome, Reason

log = logging.getLogger("combtrace.transfer")

FIRST_LOOKS_S = 0.002  # between looks for an answer, growing to the poll period: most answers come within a scan
WITHDRAWAL_PAUSE_S = 0.5
WAIT_SLICE_S = 1.0
CAN_BE_REPEATED = (Answer.BAD_CRC, Answer.BAD_LAYOUT, Answer.OUTDATED)


class _Ended(Exception):
    """The controller's block settles the job: leaves the steps from wherever it was looked at."""

    def __init__(self, settlement: Settlement) -> None:
        super().__init__(settlement)
        self.settlement = settlement


class Transfer:
    """Brings one job to its end at the controller."""

    def __init__(
        self,
        link: Link,
        settings: TransferSettings,
        counter: TransferCounter,
        outgoing: Outgoing,
        lifetime: Lifetime,
        steps: TransferSteps,
    ) -> None:
        self._link = link
        self._settings = settings
        self._counter = counter
        self._job_id = outgoing.job_id
        self._session = outgoing.session
        self._pages = outgoing.pages
        self._withdrawal = outgoing.withdrawal
        self._validity = outgoing.validity
        self._sent = outgoing.sent
        self._lifetime = lifetime
        self._steps = steps
        self._now = lifetime.now
        self._withdrawn_for: tuple[Reason, str] | None = None
        self._committed: int | None = None  # the last value that this transfer wrote, or may have written
        self._overdue = False
        self._trouble = ""

    async def run(self) -> Settlement:
        """Send until the controller has decided; withdraw what it does not take."""
        try:
            if not self._settings.handshake:
                return await self._write_only()
            reason, detail = await self._deliver()
            if not self._sent and self._link.fault() is not None:
                return Settlement(Outcome.FAILED, reason, detail)  # it never left: there is nothing to take back
            return await self.withdraw(reason, detail)
        except _Ended as ended:
            return ended.settlement

    async def withdraw(self, reason: Reason, detail: str) -> Settlement:
        """Step 8: take the job back, again and again, until the controller has decided."""
        log.warning("job %d: withdrawing: %s (%s)", self._job_id, reason.label, detail)
        self._withdrawn_for = (reason, detail)
        await self._steps.before_withdrawal(reason)
        in_vain = 0
        try:
            while True:
                try:
                    await self._gate()
                    await self._attempt(self._withdrawal)
                except ForeignOwner as foreign:
                    await self._stand_by(foreign)
                    continue
                except ControllerUnavailable:
                    await self._connected()
                except ControllerError as error:
                    self._note(str(error))
                in_vain += 1
                if in_vain == self._settings.max_repeats:
                    self._steps.on_stuck(
                        f"job {self._job_id} cannot be taken back: {self._trouble or 'connection lost'}"
                    )
                await asyncio.sleep(WITHDRAWAL_PAUSE_S)
        except _Ended as ended:
            return ended.settlement

    # --- step 7's conditions, "whenever else it looks" ----------------------------------------------------------

    async def _look(self) -> LinkBlock:
        """The controller's block, empty where it says nothing; raise _Ended by it, ForeignOwner by another service."""
        view = await self._see()
        if self._link.ownership.conflict:
            self._link.ownership.check()
        return view

    async def _see(self) -> LinkBlock:
        """The controller's block, empty where it says nothing; raise _Ended where it ends the job."""
        self._steps.feed_watchdog()
        view = await self._link.look()
        if view.session == 0 or echo_fault(view) is not None:
            return LinkBlock()  # it is being filled, or misread: nothing is concluded from it
        holds = self._link.reading.holds
        if view.last_job == self._job_id and view.last_result != 0 and (holds or self._acknowledged(view)):
            self._end_by(view.last_result)
        if holds:
            self._end_without(view)
        return view

    def _acknowledged(self, view: LinkBlock) -> bool:
        """True where the controller's answer to our own commit says the same as `last_result`: it was written after."""
        if view.session != self._session or view.ack_transfer != self._committed:
            return False
        before = view.ack_result == Answer.ACCEPTED_BEFORE and view.last_result == Answer.ACCEPTED
        return before or view.ack_result == view.last_result

    def _end_without(self, view: LinkBlock) -> None:
        """Raise _Ended where a block that holds says that the controller will never accept this job."""
        foreign = self._link.ownership.fault() if self._link.ownership.conflict else None
        if view.session != self._session:
            text = f"session {view.session}, the job was for session {self._session}"
            reason = Reason.CONTROLLER_RESTARTED if foreign is None else Reason.OTHER_SERVICE
            raise _Ended(Settlement(Outcome.FAILED, reason, text))
        if view.last_job > self._job_id:
            text = f"the controller's last job is {view.last_job} already; it may have accepted this one before that"
            raise _Ended(Settlement(Outcome.FAILED, Reason.OTHER_SERVICE, text))
        if foreign is None:
            return
        if self._overdue:
            raise _Ended(Settlement(Outcome.FAILED, Reason.OTHER_SERVICE, f"{foreign}; {self._why_over()}"))
        self._overdue = self._is_over()  # `last_job` is read once more after that

    def _is_over(self) -> bool:
        """True where the controller will not accept what it holds of this job, by its clock; without one, by ours."""
        if not self._validity.valid_for:
            return self._lifetime.over
        stamp = self._link.stamp()
        if stamp is None or not stamp.clock_ms or stamp.session != self._session:
            return False
        passed_ms = (stamp.clock_ms - self._validity.captured_at) % MODULUS
        return passed_ms > self._validity.valid_for + self._settings.ack_timeout_s * 1000

    def _why_over(self) -> str:
        if self._validity.valid_for:
            return "the contour is too old to be accepted now"
        return "it was waited for until job_timeout; the controller may have accepted it"

    async def _stand_by(self, foreign: ForeignOwner) -> None:
        """Only read until this service may write again; raise _Ended where the job's end is known before that."""
        self._note(str(foreign))
        ownership = self._link.ownership
        while not ownership.ours:
            if ownership.conflict and not self._sent:
                raise _Ended(Settlement(Outcome.FAILED, Reason.OTHER_SERVICE, ownership.fault()))
            if not self._sent and self._lifetime.over:
                raise _Ended(
                    Settlement(Outcome.FAILED, Reason.CONTROLLER_LOST, f"not before the job expired: {foreign}")
                )
            try:
                await self._see()
            except ControllerUnavailable:
                await self._reconnected()
            except ControllerError as error:
                self._note(str(error))
            await asyncio.sleep(self._settings.poll_period_s)

    def _end_by(self, last_result: int) -> NoReturn:
        if last_result == Answer.ACCEPTED:
            raise _Ended(Settlement(Outcome.ACCEPTED))
        if self._withdrawn_for is not None:
            reason, detail = self._withdrawn_for
            raise _Ended(Settlement(Outcome.FAILED, reason, detail))
        raise _Ended(
            Settlement(Outcome.REFUSED, Reason.CONTROLLER_REFUSED, f"answer {last_result} {_answer_name(last_result)}")
        )

    # --- steps 1 to 7 -------------------------------------------------------------------------------------------

    async def _deliver(self) -> tuple[Reason, str]:
        """Send page after page; return why the job is to be withdrawn. A settled job leaves by _Ended."""
        page, furthest, in_vain = 0, 0, 0
        while in_vain < self._settings.max_repeats:
            try:
                give_up = await self._ready()
                if give_up is not None:
                    return give_up
                # No contour before the acknowledgement of its trigger has arrived.
                if await self._link.flush(self._settings.ack_timeout_s):
                    answer = await self._attempt(self._pages[page])
                else:
                    self._note("the controller does not confirm the service block")
                    answer = None
            except (ForeignOwner, ControllerUnavailable, LinkUnsteady) as error:  # it said nothing: no attempt in vain
                if not await self._can_go_on(error):
                    return Reason.CONTROLLER_LOST, f"not back before the job expired: {error}"
                continue
            except ControllerError as error:  # an exception response: a reply, so nothing was done
                self._note(str(error))
                answer = None
                await asyncio.sleep(self._settings.poll_period_s)
            if answer is Answer.ACCEPTED and page + 1 < len(self._pages):
                page += 1
                # Only a page that was not held before is progress: one that is missing again and again is not.
                furthest, in_vain = max(furthest, page), 0 if page > furthest else in_vain
            elif answer is Answer.NOT_READY:
                await asyncio.sleep(self._settings.poll_period_s)  # its state may say ready all the while
            else:
                if answer is Answer.ACCEPTED:
                    self._note(self._unconfirmed("answer 1 accepted"))
                page = 0 if answer is Answer.PAGE_MISSING else page
                in_vain += 1
        reason = Reason.EXPIRED if self._lifetime.over else Reason.CONTROLLER_TIMEOUT
        return reason, f"{in_vain} attempts in vain, last: {self._trouble}"

    async def _can_go_on(self, error: ControllerError) -> bool:
        """True once it can be tried again; False where the job expired before that."""
        if isinstance(error, ForeignOwner):
            await self._stand_by(error)
            return True
        self._note(str(error))
        return not isinstance(error, ControllerUnavailable) or await self._reconnected()

    async def _ready(self) -> tuple[Reason, str] | None:
        """Step 1: None when the controller is ready, else why the job is to be withdrawn."""
        give_up_at = self._now() + self._settings.ready_timeout_s
        while True:
            try:
                why_not = self._may_have_ended(await self._look()) or self._link.controller_not_ready()
            except LinkUnsteady as error:  # it said nothing: no attempt in vain
                why_not = str(error)
            if not self._link.ownership.begun:  # what is watched at the start says nothing of the controller
                give_up_at = self._now() + self._settings.ready_timeout_s
            if self._lifetime.over:
                return Reason.EXPIRED, why_not or "the contour became too old on its way"
            if why_not is None:
                return None
            if self._now() >= give_up_at:
                return Reason.CONTROLLER_TIMEOUT, f"{why_not} for {self._settings.ready_timeout_s:g} s"
            await asyncio.sleep(self._settings.poll_period_s)

    async def _gate(self) -> None:
        """Return when what is written will be read as it is meant; a controller that is not ready is no hindrance."""
        while True:
            fault = self._may_have_ended(await self._look()) or self._link.fault()
            if fault is None:
                return
            self._note(fault)
            await asyncio.sleep(self._settings.poll_period_s)

    def _may_have_ended(self, view: LinkBlock) -> str | None:
        """Why nothing may be sent before the block holds: it seems to say that the job has ended."""
        if view.session not in (0, self._session):
            return f"session {view.session} instead of {self._session}: whether that holds is being watched"
        if view.last_job > self._job_id or (view.last_job == self._job_id and view.last_result != 0):
            return f"last_job is {view.last_job}: whether that holds is being watched"
        return None

    async def _attempt(self, page: Page) -> Answer | None:
        """Steps 2 to 7 for one page: the controller's answer, None where there was none."""
        controller = self._link.controller
        clean = await self._clear()
        await self._about_to_send()
        self._check_may_go_on(clean)
        await controller.write_page(page)
        if self._settings.readback and not await self._reads_back(page):
            return None
        if self._too_old():  # making it durable, or the requests, took longer than it had
            return None
        view = self._link.view or await self._look()
        transfer = self._counter.next(view.ack_transfer)
        self._check_may_go_on(clean)
        self._committed = transfer
        try:
            await controller.write_transfer(transfer)
        except ControllerUnavailable as error:  # it may have been done: go on with step 7
            self._note(str(error))
            if not await self._reconnected():
                return None
        return await self._answer(transfer)

    async def _reads_back(self, page: Page) -> bool:
        """Step 4: whether the controller holds what was written."""
        if await self._link.controller.read_page(len(page.payload), len(page.part)) == page:
            return True
        self._note("read-back differs from what was written: check the blocks' addresses and capacities")
        return False

    async def _clear(self) -> tuple[int, int]:
        """Step 2: the connection on which `transfer` = 0 was confirmed, and since which start of ownership."""
        self._link.ownership.check()
        await self._link.controller.write_transfer(0)
        return self._link.connection.opened, self._link.ownership.epoch

    def _check_may_go_on(self, clean: tuple[int, int]) -> None:
        """Raise ControllerError where steps 3 to 5 must not follow the step 2 confirmed as `clean`."""
        self._link.ownership.check()
        if (self._link.connection.opened, self._link.ownership.epoch) != clean:
            raise ControllerUnavailable("the connection was opened anew: it begins again with transfer = 0")

    def _too_old(self) -> bool:
        """True where the contour must not be committed any more; a withdrawal never ages."""
        if self._withdrawn_for is not None or not self._lifetime.over:
            return False
        self._note("the contour became too old on its way")
        return True

    async def _about_to_send(self) -> None:
        """Make durable that the job may have been sent, before the first request of step 3."""
        if not self._sent:
            await self._steps.before_sending()
            self._sent = True

    async def _answer(self, transfer: int) -> Answer | None:
        """Step 7: the answer to `transfer`, None where none came within ack_timeout. Final ones leave by _Ended."""
        give_up_at = self._now() + self._settings.ack_timeout_s
        pause = FIRST_LOOKS_S
        while True:
            try:
                view = await self._look()
            except ControllerUnavailable as error:  # the commit was confirmed: its answer is still to be had
                self._note(str(error))
                if self._now() >= give_up_at or not await self._reconnected():
                    return None
                continue
            except LinkUnsteady as error:
                self._note(str(error))
                view = LinkBlock()  # it said nothing
            if view.session == self._session and view.ack_transfer == transfer:
                answer = _as_answer(view.ack_result)
                if answer in CAN_BE_REPEATED or answer in (Answer.PAGE_MISSING, Answer.NOT_READY):
                    self._note(f"answer {view.ack_result} {_answer_name(view.ack_result)}")
                    return answer
                if answer is Answer.ACCEPTED and self._withdrawn_for is None and view.last_job < self._job_id:
                    return answer  # of a page that is not the last one; the last one's is in last_job, looked at above
            if self._too_old():  # without a clock of the controller's, taking it back is all that keeps it from use
                return None
            if self._now() >= give_up_at:
                self._note(self._unanswered(view, transfer))
                return None
            await asyncio.sleep(pause)
            pause = min(2 * pause, self._settings.poll_period_s)

    def _unanswered(self, view: LinkBlock, transfer: int) -> str:
        """Why no answer within ack_timeout counts: there was none, or one that says nothing of this job."""
        if view.session != self._session or view.ack_transfer != transfer:
            return f"no answer within {self._settings.ack_timeout_s:g} s"
        answer = f"answer {view.ack_result} {_answer_name(view.ack_result)}"
        if _as_answer(view.ack_result) is None:
            return f"{answer}, which the protocol does not know"
        return self._unconfirmed(answer)

    def _unconfirmed(self, answer: str) -> str:
        return f"{answer}, but last_job is not {self._job_id}: it must be written before ack_transfer"

    async def _reconnected(self) -> bool:
        """Wait for a new connection, at most until the job expires; a withdrawal waits for ever."""
        if self._withdrawn_for is not None:
            await self._connected()
            return True
        try:
            async with asyncio.timeout(self._lifetime.left_s):
                await self._connected()
        except TimeoutError:
            return False
        return True

    async def _connected(self) -> None:
        """Wait for the link's connection, however long. To wait for the link, which shows its own life, is no hang."""
        while True:
            self._steps.feed_watchdog()
            with suppress(TimeoutError):
                async with asyncio.timeout(WAIT_SLICE_S):
                    await self._link.wait_connected()
                    return

    # --- handshake: none ----------------------------------------------------------------------------------------

    async def _write_only(self) -> Settlement:
        """Steps 2 to 5, for a controller that cannot answer; repeats carry the same transfer value."""
        controller, page = self._link.controller, self._pages[0]
        transfer = self._counter.next(0)
        in_vain = 0
        while in_vain < self._settings.max_repeats and not self._lifetime.over:
            try:
                clean = await self._clear()
                await self._about_to_send()
                self._check_may_go_on(clean)
                await controller.write_page(page)
                if not self._settings.readback or await self._reads_back(page):
                    if self._too_old():
                        return Settlement(Outcome.FAILED, Reason.EXPIRED, self._trouble)
                    self._check_may_go_on(clean)
                    await controller.write_transfer(transfer)
                    return Settlement(Outcome.WRITTEN)
                in_vain += 1
            except ForeignOwner as foreign:
                if self._link.ownership.conflict:
                    return Settlement(Outcome.FAILED, Reason.OTHER_SERVICE, str(foreign))
                await asyncio.sleep(self._settings.poll_period_s)
            except ControllerUnavailable as error:
                self._note(str(error))
                if not await self._reconnected():
                    break
            except ControllerError as error:
                self._note(str(error))
                in_vain += 1
                await asyncio.sleep(self._settings.poll_period_s)
        return Settlement(Outcome.FAILED, Reason.CONTROLLER_LOST, self._trouble or "not written before the job expired")

    def _note(self, trouble: str) -> None:
        """Keep the last trouble for the settlement's detail, and log it when it is a new one."""
        if trouble != self._trouble:
            log.warning("job %d: %s", self._job_id, trouble)
        self._trouble = trouble


def _as_answer(value: int) -> Answer | None:
    return Answer(value) if value in Answer.__members__.values() else None


def _answer_name(value: int) -> str:
    answer = _as_answer(value)
    if answer is Answer.EXPIRED:
        return "expired (too old, or the controller's last trigger is another)"
    return "unknown" if answer is None else answer.name.lower()
