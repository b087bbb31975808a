"""Service and controller as processes of their own, one of them killed (`kill -9`) again and again and started anew.

The service dies at chosen steps of the protocol (the controller that it talks to pulls the trigger) or at random times;
the controller dies at random times. Line faults go on all the while.
"""

from __future__ import annotations

import asyncio
import json
import random
import time
from collections import Counter
from collections.abc import Callable
from contextlib import AsyncExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from drivers.controller.mailbox.layout import MailboxLayout
from drivers.controller.simulated.contour import AcceptedContour
from drivers.controller.simulated.controller import SimulatedController
from drivers.controller.simulated.faults import FaultPlan, LineFault, targets_of
from drivers.controller.simulated.program import TriggerNotPossible
from drivers.controller.simulated.received import ReceivedRequest
from tests.soak.cells.crossed_line import crossed_line
from tests.soak.cells.faulted_cell import Transport
from tests.soak.promises import Evidence, Findings, Rings, Taken, acks, judge, logged_contours, micrometres
from tests.support.pictures.combs import write_combs
from tests.support.processes.processes import Process, combtrace, free_port, jobs, lines

STEPS = ("service", "owner", "clear", "page", "readback", "commit", "link")
MOMENTS = ("before", "after", "replied")
WAIT_S = 60.0
KNOWN: set[Rings] = set()
PATIENT_S = 300.0  # of what is waited out on a machine that has other work


@dataclass(frozen=True)
class Killing:
    """One campaign: which side is killed how often. risk: chance of a line fault, of one request."""

    seed: int
    kills: int
    victim: Literal["service", "controller"]
    risk: float = 0.01
    word_order: Literal["big", "little"] = "big"
    payload_capacity: int = 1984
    forgetful: bool = False
    transport: Transport = "tcp"

    def __str__(self) -> str:
        words = [f"seed {self.seed}", f"{self.kills} kills of the {self.victim}", f"risk {self.risk:g}"]
        words += [self.transport, f"word order {self.word_order}", f"{self.payload_capacity} registers"]
        return ", ".join(words + ["forgetful"] * self.forgetful)


@dataclass
class Toll:
    """What a campaign came to. kills: by the instant."""

    findings: Findings
    kills: Counter[str]
    outcomes: Counter[str]
    faults: Counter[str]
    accepted: int
    acknowledged: int
    seconds: float


class Sniper(SimulatedController):
    """A controller that, once armed, kills its client at one step of the protocol."""

    armed: tuple[str, str, int] | None = None
    on_kill: Callable[[], None]

    def strike(self, request: ReceivedRequest) -> LineFault | None:
        if self.armed is None:
            return super().strike(request)
        step, moment, count = self.armed
        if step not in targets_of(request.pdu, self._layout):
            return super().strike(request)
        if count > 1:
            self.armed = (step, moment, count - 1)
            return super().strike(request)
        self.armed = None
        if moment == "before":
            self.on_kill()
            return LineFault("lost-request")
        if moment == "after":
            asyncio.get_running_loop().call_soon(self.on_kill)
            return LineFault("lost-reply")
        asyncio.get_running_loop().call_soon(self.on_kill)  # the reply is in the client's socket by then
        return None


class KilledCell:
    """A folder with all that both sides leave behind."""

    valid_for_s = 30.0
    triggers = "[{kind: controller}]"
    storage = "journal: {path: journal.sqlite}\n"
    state: str | Path = "state"

    def __init__(self, folder: Path, killing: Killing) -> None:
        self.folder = folder
        self.killing = killing
        self.chance = random.Random(killing.seed)
        self.journal = folder / "journal.sqlite"
        self.life = Findings()
        self.kills: Counter[str] = Counter()
        self.taken: list[Taken] = []
        self.events: list[dict[str, Any]] = []
        self.said: list[str] = []  # on a serial line
        self.combs = write_combs(folder / "combs")

    def write_config(self, port: int | str) -> None:
        killing = self.killing
        (self.folder / "config.yaml").write_text(
            "camera: {kind: files, path: combs, loop: true}\n"
            "calibration: {file: combs.yaml}\n"
            f"controller: {{kind: modbus-{killing.transport}, port: {port}, timeout_s: 0.3,"
            f" poll_period_s: 0.01, ack_timeout_s: 1, word_order: {killing.word_order},"
            f" payload_capacity: {killing.payload_capacity}, valid_for_s: {self.valid_for_s}}}\n"
            f"triggers: {self.triggers}\n"
            "recipes: [{number: 1, name: comb, method: direct-scan, tolerance_mm: 0.5}]\n"
            f"service: {{state_dir: {self.state}}}\n{self.storage}"
        )

    def known(self) -> frozenset[Rings]:
        """The contours that the pictures give, which are the same for all cells."""
        if not KNOWN:
            KNOWN.update(self._traced())
        return frozenset(KNOWN)

    def _traced(self) -> frozenset[Rings]:
        pictures = sorted(self.combs.iterdir())
        table = self.folder / "known.json"
        done = combtrace(
            "trace", *pictures, "--config", self.folder / "config.yaml", "--json", table, bound_s=PATIENT_S
        )
        assert done.returncode == 0, done.stderr
        found = [contour["millimetres"] for contour in lines(table)]
        return frozenset(micrometres([contour["exterior"], *contour["holes"]]) for contour in found)

    def start_service(self) -> Process:
        return Process(self.folder / "service.log", "run", "--config", self.folder / "config.yaml")

    # --- what befalls the victim --------------------------------------------------------------------------------

    def strike_down(self, process: Process) -> None:
        """kill -9."""
        process.kill()

    async def bring_back(self, process: Process, forgets: bool = False) -> Process:
        """Start it anew. forgets: without its memory."""
        if process is self.service:
            return self.start_service()
        if forgets:
            (self.folder / "memory.json").unlink(missing_ok=True)
        await asyncio.sleep(self.chance.choice((0.0, 0.0, self.chance.uniform(0, 1.0))))
        return self._start_controller()

    # --- the service is killed ----------------------------------------------------------------------------------

    async def kill_service(self) -> Toll:
        """The service's process killed at steps of the protocol and at random times."""
        started = time.monotonic()
        killing = self.killing
        plan = FaultPlan(
            [
                LineFault("lost-reply", chance=killing.risk),
                LineFault("late-write", request="write", chance=killing.risk, delay_s=0.5),
                LineFault(
                    "late-write", request="write", chance=killing.risk, delay_s=1.5
                ),  # lands in the next service's time
                LineFault("exception", request="write", chance=killing.risk, code=6),
            ],
            killing.seed,
        )
        layout = MailboxLayout(payload_capacity=killing.payload_capacity, word_order=killing.word_order)
        options: dict[str, Any] = {"scan_s": 0.003, "layout": layout, "faults": plan, "on_accepted": self._note}
        async with AsyncExitStack() as opened:
            near, far = await opened.enter_async_context(crossed_line())
            if killing.transport == "rtu":
                controller = Sniper.on_serial(far, **options)
            else:
                controller = Sniper(framing="tcp" if killing.transport == "tcp" else "rtu", **options)
            assert isinstance(controller, Sniper)
            await opened.enter_async_context(controller)
            self.controller = controller
            controller.verdict.on_event = self.events.append
            self.write_config(near if killing.transport == "rtu" else controller.port)
            self.service = self.start_service()
            asking = asyncio.ensure_future(self._ask())
            try:
                for _ in range(killing.kills):
                    await self._kill_once(controller)
                    self.service = await self.bring_back(self.service)
                    if self.life.counts:
                        break
                await self._served(controller, len(self.taken) + 2)
            finally:
                asking.cancel()
                await asyncio.wait([asking])
                plan.enabled = False
                await self._rest(lambda: not controller.trigger_open and self.all_told())
                await asyncio.to_thread(self._stop, self.service)
        verdict = controller.verdict
        return self._toll(started, verdict.counts, plan.struck)

    def _note(self, contour: AcceptedContour) -> None:
        session, trigger = self.controller.registers(13, 1)[0], self.controller.registers(2, 1)[0]
        self.taken.append(Taken(contour.job_id, micrometres(contour.rings), None, session, trigger))

    def all_told(self) -> bool:
        """True where nobody waits for a word of the service."""
        return True

    async def _ask(self) -> None:
        while True:
            await asyncio.sleep(self.chance.uniform(0, 0.02))
            if self.controller.can_request:
                try:
                    self.controller.request_measurement()
                except TriggerNotPossible:
                    continue

    async def _kill_once(self, controller: Sniper) -> None:
        if self.chance.random() < 0.2:
            await asyncio.sleep(self.chance.uniform(0, 1.5))
            self.strike_down(self.service)
            self.kills["at a random time"] += 1
            return
        await self._served(controller, len(self.taken) + self.chance.randint(0, 2))
        gone = asyncio.Event()

        def kill() -> None:
            self.strike_down(self.service)
            gone.set()

        controller.on_kill = kill
        step, moment = self.chance.choice(STEPS), self.chance.choice(MOMENTS)
        controller.armed = (step, moment, self.chance.randint(1, 3))
        try:
            async with asyncio.timeout(WAIT_S):
                await gone.wait()
        except TimeoutError:
            self.life.add("ended", f"the service did not come to {step} within {WAIT_S:g} s; state Ready was expected")
            self.strike_down(self.service)
        self.kills[f"{moment} {step}"] += 1

    async def _served(self, controller: Sniper, accepted: int) -> None:
        try:
            async with asyncio.timeout(WAIT_S):
                while len(self.taken) < accepted or not controller.can_request:
                    if not self.service.running:
                        self.life.add("ended", "the service ended by itself: see service.log")
                        return
                    await asyncio.sleep(0.005)
        except TimeoutError:
            self.life.add("ended", f"no job was accepted within {WAIT_S:g} s of the service's start")

    # --- the controller is killed -------------------------------------------------------------------------------

    async def kill_controller(self) -> Toll:
        """The controller's process killed at random times; the service goes on."""
        started = time.monotonic()
        self.port = free_port()
        self.write_config(self.port)
        self.service = self.start_service()
        self.controller_process = self._start_controller()
        self.kinds: Counter[str] = Counter()
        try:
            for _ in range(self.killing.kills):
                self._goes_on(1)
                await self._near_a_job()
                self.strike_down(self.controller_process)
                forgets = self.killing.forgetful and self.chance.random() < 0.3
                self.kills["memory lost" if forgets else "memory kept"] += 1
                self.controller_process = await self.bring_back(self.controller_process, forgets)
                if self.life.counts:
                    break
            self._goes_on(2)
            await self._rest(lambda: True)
        finally:
            self._stop(self.service)
            self._stop(self.controller_process)
        log = (self.folder / "accepted.jsonl").read_text().splitlines(keepends=True)
        self.taken = logged_contours(log)
        self.events = lines(self.folder / "events.jsonl")
        kinds = Counter(event["kind"] for event in self.events if event["event"] == "violation")
        faults = Counter(event["kind"] for event in self.events if event["event"] == "fault")
        return self._toll(started, kinds, faults)

    def _start_controller(self) -> Process:
        return Process(
            self.folder / "controller.log",
            *("simulate-controller", "--tcp", f"127.0.0.1:{self.port}", "--scan-ms", "3", "--trigger-every", "0.02"),
            *("--log", self.folder / "accepted.jsonl", "--events", self.folder / "events.jsonl"),
            *("--memory", self.folder / "memory.json", "--word-order", self.killing.word_order),
            *("--layout", f"0,16,32,{self.killing.payload_capacity}"),
        )

    def _goes_on(self, count: int) -> None:
        before = len(lines(self.folder / "accepted.jsonl"))
        give_up_at = time.monotonic() + WAIT_S
        while len(lines(self.folder / "accepted.jsonl")) < before + count:
            if time.monotonic() > give_up_at or not self.service.running:
                self.life.add("ended", f"no job was accepted within {WAIT_S:g} s of the controller's start")
                return
            time.sleep(0.01)

    async def _near_a_job(self) -> None:
        """A random time, two times of three close to the moment at which a page is on its way."""
        if self.chance.random() < 2 / 3:
            give_up_at = time.monotonic() + 1.0
            while time.monotonic() < give_up_at:
                if any(row["outcome"] is None and row["pages"] for row in jobs(self.journal)[-1:]):
                    break
                await asyncio.sleep(0.001)
            await asyncio.sleep(self.chance.uniform(0, 0.02))
        else:
            await asyncio.sleep(self.chance.uniform(0, 0.4))

    # --- the end ------------------------------------------------------------------------------------------------

    async def _rest(self, more: Callable[[], bool]) -> None:
        """Wait until every job has ended; jobs go on coming where the controller asks for them all the time."""
        give_up_at = time.monotonic() + WAIT_S
        while time.monotonic() < give_up_at:
            open_jobs = [row for row in jobs(self.journal) if row["outcome"] is None]
            if self.killing.victim == "controller":
                if len(open_jobs) <= 1:
                    return
            elif not open_jobs and more():
                return
            await asyncio.sleep(0.02)
        self.life.add("ended", f"jobs without an end {WAIT_S:g} s after the last kill")

    def _stop(self, process: Process) -> None:
        if process.running:
            status = process.stop(PATIENT_S)
            if status != 0:
                self.life.add("ended", f"{process.log.name}: exit status {status} on SIGTERM")

    def _toll(self, started: float, kinds: Counter[str], faults: Counter[str]) -> Toll:
        rows = jobs(self.journal)
        evidence = Evidence(
            jobs=rows,
            taken=self.taken,
            events=self.events,
            known=self.known(),
            verdict_kinds=kinds,
            memory_lost=self.killing.forgetful,
            said=self.said,
        )
        findings = judge(evidence)
        for text in self.life.texts:
            findings.add(*text.split(": ", 1))
        told = [event for event in self.events if event["event"] == "violation"]
        kept = [event for event in told if event["kind"] != "heartbeat-stalled"]
        findings.texts += [json.dumps(event) for event in kept[:10]]
        return Toll(
            findings,
            self.kills,
            Counter(str(row["outcome"]) for row in rows),
            faults,
            len(self.taken),
            sum(event["event"] == "acknowledged" for event in self.events) + len(acks(self.said)),
            time.monotonic() - started,
        )
