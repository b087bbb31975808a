"""Service and controller in one process, every request at risk, both restarted at random, until enough jobs ended."""

from __future__ import annotations

import asyncio
import random
import time
from collections import Counter
from collections.abc import Awaitable, Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from drivers.camera import CameraUnavailable
from drivers.camera.simulated import SimulatedCamera
from drivers.controller.mailbox.layout import MailboxLayout
from drivers.controller.simulated.contour import AcceptedContour
from drivers.controller.simulated.controller import SimulatedController
from drivers.controller.simulated.faults import FaultPlan, LineFault
from drivers.controller.simulated.program import Pace, TriggerNotPossible
from drivers.controller.simulated.received import FramingName
from service.config.config import Config
from service.daemon.daemon import Daemon, Parts
from service.jobs.cycle_terms import Observation
from service.jobs.trigger_queue import TriggerRefused
from service.records.job import TriggerStamp
from service.state import State
from service.wiring.daemon import build
from tests.soak.cells.crossed_line import crossed_line
from tests.soak.promises import Evidence, Findings, Taken, judge, micrometres
from tests.soak.random_contours import RandomContours
from tests.support.processes.processes import jobs

Transport = Literal["tcp", "rtu-over-tcp", "rtu"]
Incident = Callable[[], Awaitable[None]]

VALID_FOR_S = 0.8
TIMEOUT_S = 0.08
RECOVERY_S = 30.0  # from a start to Ready, as long as nothing that lasts speaks against it
LINE_FAULTS = ("lost-request", "lost-reply", "garbled-request", "garbled-reply", "foreign-reply")
CONNECTION_FAULTS = ("reset-before", "reset-after", "half-open")
LATE = (0.02, 0.1, 0.3, 0.9)  # below and above the time-out, and past a reconnection
EXCEPTIONS = (2, 3, 4, 5, 6)
PART_ADDRESS = 3000
CALIBRATION = """version: 1
kind: simple
image_width: 8
image_height: 6
mm_per_pixel: 1
plane_height_mm: 0
origin_px: [0, 0]
rotation_deg: 0
"""


@dataclass(frozen=True)
class Terms:
    """One campaign: how many jobs, over what, and under which faults.

    risk: chance of a fault, of one write. incidents: how many at least. part_capacity: 0 = without a part block.
    """

    seed: int
    jobs: int
    transport: Transport = "tcp"
    risk: float = 0.06
    has_clock: bool = True
    forgetful: bool = False
    word_order: Literal["big", "little"] = "big"
    payload_capacity: int = 1984
    slow_program: bool = False
    incidents: int = 0
    part_capacity: int = 0

    def __str__(self) -> str:
        words = [f"seed {self.seed}", self.transport, f"risk {self.risk:g}", f"word order {self.word_order}"]
        words += [f"{self.payload_capacity} registers"]
        words += ["no clock"] * (not self.has_clock) + ["forgetful"] * self.forgetful + ["slow"] * self.slow_program
        words += ["parts"] * bool(self.part_capacity)
        return ", ".join(words)


@dataclass
class Outcome:
    """What a campaign came to."""

    findings: Findings
    outcomes: Counter[str]
    faults: Counter[str]
    restarts: Counter[str]
    accepted: int
    acknowledged: int
    pages: int
    seconds: float


def parts_as_rings(contour: AcceptedContour) -> list[Any]:
    """What came of the parts, in millimetres and degrees, as rings among the contour's: they are judged with them."""
    rings: list[Any] = []
    for part in contour.parts or ():
        rings += [[(part.number, part.x_mm), (part.y_mm, part.angle_deg)], *part.rings]
    return rings


def fault_rules(risk: float) -> list[LineFault]:
    """Every kind of fault; a read is struck a twentieth as often as a write, for most requests only look."""
    rules = [LineFault(kind, request="write", chance=risk / 12) for kind in LINE_FAULTS]  # type: ignore[arg-type]
    rules += [LineFault(kind, request="write", chance=risk / 12) for kind in CONNECTION_FAULTS]  # type: ignore[arg-type]
    rules += [LineFault("exception", request="write", chance=risk / 30, code=code, delay_s=0.1) for code in EXCEPTIONS]
    for delay_s in LATE:
        rules += [LineFault("late-write", request="write", chance=risk / 20, delay_s=delay_s)]
        rules += [LineFault("late-reply", request="write", chance=risk / 40, delay_s=delay_s)]
        rules += [LineFault("repeated-reply", request="any", chance=risk / 200, delay_s=delay_s)]
        rules += [LineFault("late-reply", request="read", chance=risk / 400, delay_s=delay_s)]
    rules += [LineFault("exception", request="read", chance=risk / 400, code=code) for code in EXCEPTIONS]
    rules += [LineFault(kind, request="read", chance=risk / 100) for kind in (*LINE_FAULTS, *CONNECTION_FAULTS)]  # type: ignore[arg-type]
    # The commit and what comes just before it: where a mistake would cost most.
    rules += [LineFault(kind, request="commit", chance=risk / 6) for kind in ("lost-reply", "reset-after")]  # type: ignore[arg-type]
    rules += [LineFault("late-write", request="clear", chance=risk / 12, delay_s=0.15)]
    return rules


class FaultedCell:
    """Both sides, what befalls them, and what the controller took. Other campaigns change what stands first here."""

    valid_for_s = VALID_FOR_S
    serial_share = 0.1  # of triggers that are not the controller's
    rude_share = 0.01  # of the controller's triggers that do not wait for the end of the one before
    other_service = False  # true where another one, or an older journal, is at the controller
    pause_s = (0.3, 3.0)  # between two incidents
    seconds_a_job = 3.0  # far more than one takes on a busy machine: what comes to this hangs
    controller_kind: type[SimulatedController] = SimulatedController
    clock_start_ms = 2**32 - 3000  # it wraps while the campaign runs, and so does the trigger counter
    host: Any = "127.0.0.1"
    port, near_port, far_port = 0, "", ""
    judges = True  # false where the controller's verdict would hear two clients as one

    def __init__(self, folder: Path, terms: Terms) -> None:
        self.chance = random.Random(terms.seed)
        self.folder = folder
        self.terms = terms
        part = (PART_ADDRESS, terms.part_capacity) if terms.part_capacity else (None, 0)
        self.layout = MailboxLayout(0, 16, 32, terms.payload_capacity, terms.word_order, *part)
        self.faults = FaultPlan(fault_rules(terms.risk), terms.seed)
        self.taken: list[Taken] = []
        self.events: list[dict[str, Any]] = []
        self.exposed: dict[int, float] = {}
        self.measured: dict[int, Any] = {}
        self.restarts: Counter[str] = Counter()
        self.findings_of_life = Findings()

    # --- the parts ----------------------------------------------------------------------------------------------

    def judge(self, _contour: AcceptedContour) -> int:
        return self.chance.choices((1, 4, 7), (8, 1, 1))[0]

    def note_accepted(self, contour: AcceptedContour) -> None:
        session, trigger = self.controller.registers(13, 1)[0], self.controller.registers(2, 1)[0]
        rings = [*contour.rings, *parts_as_rings(contour)]
        self.taken.append(Taken(contour.job_id, micrometres(rings), time.monotonic(), session, trigger))

    def note_event(self, event: dict[str, Any]) -> None:
        self.events.append({**event, "at_s": time.monotonic()})

    def note_seen(self, seen: Observation) -> None:
        assert seen.measurement.millimetres is not None
        self.exposed[seen.job.job_id] = seen.frame.exposed_at_s
        rings = [ring.tolist() for ring in seen.measurement.millimetres.rings]
        for fit in seen.measurement.laid if self.terms.part_capacity else ():
            pose = fit.placement.pose
            rings += [[(fit.number, pose.x), (pose.y, pose.angle_deg)], *(ring.tolist() for ring in fit.placed.rings)]
        self.measured[seen.job.job_id] = micrometres(rings)

    def picture(self, _number: int) -> np.ndarray:
        if self.faults.enabled and self.chance.random() < 0.01:
            raise CameraUnavailable("unplugged")
        return np.zeros((6, 8), np.uint8)

    def new_controller(self) -> SimulatedController:
        terms = self.terms
        options: dict[str, Any] = {
            "layout": self.layout,
            "scan_s": 0.002,
            "memory_path": self.folder / "memory.json",
            "has_clock": terms.has_clock,
            "clock_start_ms": self.clock_start_ms,
            "first_trigger": 65535 - 9,
            "judge": self.judge,
            "faults": self.faults,
            "on_accepted": self.note_accepted,
            **self.more_options(),
        }
        if terms.slow_program:
            options["pace"] = Pace(copy_scans=4, check_scans=3, stepwise=True)
        if terms.transport == "rtu":
            return self.controller_kind.on_serial(self.far_port, **options)
        framing: FramingName = "tcp" if terms.transport == "tcp" else "rtu"
        return self.controller_kind(self.host, self.port, framing=framing, **options)

    def more_options(self) -> dict[str, Any]:
        """What else the simulated controller is told."""
        return {}

    async def start_controller(self) -> None:
        before = getattr(self, "controller", None)
        self.controller = self.new_controller()
        if before is not None:  # one verdict, and one client to judge, over all starts
            self.controller.verdict = before.verdict
            self.controller._watch._verdict = before.verdict
        self.controller.verdict.on_event = self.note_event
        await self.controller.start()
        if self.terms.transport != "rtu":
            self.port = self.controller.port

    def config(self, folder: Path | None = None, **changed: Any) -> Config:
        """The service's configuration. folder: of its own files; changed: settings of the controller."""
        terms, folder = self.terms, folder or self.folder
        part = {"address": PART_ADDRESS, "capacity": terms.part_capacity} if terms.part_capacity else None
        wires: dict[str, Any] = {
            "tcp": {"kind": "modbus-tcp", "port": self.port},
            "rtu-over-tcp": {"kind": "modbus-rtu-over-tcp", "port": self.port},
            "rtu": {"kind": "modbus-rtu", "port": self.near_port, "baudrate": 115200},
        }[terms.transport]
        return Config.model_validate(
            {
                "camera": {"kind": "files", "path": str(self.folder)},
                "calibration": {"file": str(self.folder / "calibration.yaml")},
                "controller": {
                    **wires,
                    "timeout_s": TIMEOUT_S,
                    "poll_period_s": 0.005,
                    "heartbeat_timeout_s": 1.0,
                    "ready_timeout_s": 0.4,
                    "ack_timeout_s": 0.15,
                    "valid_for_s": self.valid_for_s,
                    "job_timeout_s": self.valid_for_s,
                    "word_order": terms.word_order,
                    "payload_capacity": terms.payload_capacity,
                    "part_block": part,
                    **changed,
                },
                "triggers": [{"kind": "controller"}],
                "service": {"state_dir": str(folder)},
                "journal": {"path": str(folder / "journal.sqlite")},
                "archive": {"path": str(folder / "archive")},
            }
        )

    def start_service(self) -> None:
        """Start what `wired` gives."""
        self.parts = self.wired(self.config(), self.note_seen)
        self.running = asyncio.ensure_future(Daemon(self.parts).run())

    def wired(self, config: Config, observe: Callable[[Observation], None]) -> Parts:
        """A daemon as wired for the shop floor, but for its camera and its measurer."""
        parts = build(config, observe=observe)
        cycle: Any = parts.executor._runner
        most = 12 if self.terms.payload_capacity < 64 else 40
        measurer = RandomContours(self.chance, most, parts=bool(self.terms.part_capacity))
        cycle._plan = replace(cycle._plan, measurer=measurer)
        cycle._camera = parts.camera = SimulatedCamera(self.picture)
        cycle._abort = lambda _job: None  # it is killed, not stopped: nobody tidies up
        return parts

    # --- what befalls them --------------------------------------------------------------------------------------

    async def ask(self) -> None:
        """The machine's person: triggers from the controller, and now and then one of another kind."""
        while True:
            await asyncio.sleep(self.chance.uniform(0, 0.02))
            if self.chance.random() < self.serial_share:
                with suppress(TriggerRefused):
                    await self.parts.executor.submit(TriggerStamp("serial"))
            elif self.serial_share < 1:
                with suppress(TriggerNotPossible):
                    self.request()

    def request(self) -> None:
        """The controller's own trigger."""
        self.controller.request_measurement(force=self.chance.random() < self.rude_share)

    async def machine(self) -> None:
        """The machine is busy at times, and its program slow."""
        while True:
            await asyncio.sleep(self.chance.uniform(0.3, 3.0))
            self.controller.set_state(self.chance.choice((0, 2, 3)))
            await asyncio.sleep(self.chance.uniform(0, 0.2))
            self.controller.set_state(1)
            if self.chance.random() < 0.3:
                self.controller.scan_s = 0.06
                await asyncio.sleep(self.chance.uniform(0, 1.2 if self.terms.slow_program else 0.4))
                self.controller.scan_s = 0.002

    async def in_the_midst_of_a_transfer(self) -> None:
        for _ in range(200):
            if self.parts.health.job is not None and self.chance.random() < 0.1:
                break
            await asyncio.sleep(0.001)
        await asyncio.sleep(self.chance.uniform(0, 0.015))

    async def commit(self, bound_s: float = 0.3) -> bool:
        """Wait for the next commit; False where none came."""
        seen = self.controller.registers(32, 1)
        give_up_at = time.monotonic() + bound_s
        while self.controller.registers(32, 1) in (seen, (0,)):
            if time.monotonic() > give_up_at:
                return False
            await asyncio.sleep(0.001)
        return True

    async def restart_service(self) -> None:
        await self.in_the_midst_of_a_transfer()
        self.restarts["service"] += 1
        await self.end_service()
        self.start_service()

    async def end_service(self) -> None:
        self.running.cancel()
        with suppress(asyncio.CancelledError):
            await self.running

    async def serves(self) -> None:
        """Wait until the service is ready, or at work; a finding where that takes long."""
        give_up_at = time.monotonic() + RECOVERY_S
        while self.parts.health.state not in (State.READY, State.SINGLE_EXECUTION):
            if time.monotonic() > give_up_at:
                fault = self.parts.health.first()
                self.findings_of_life.add("ended", f"not Ready {RECOVERY_S:g} s after its start: {fault}")
                return
            await asyncio.sleep(0.05)

    async def restart_program(self) -> None:
        await self.in_the_midst_of_a_transfer()
        keep = self.chance.random() < 0.5
        self.restarts["controller, registers kept" if keep else "controller, registers lost"] += 1
        self.controller.restart(keep_registers=keep)

    async def power_off(self) -> None:
        await self.in_the_midst_of_a_transfer()
        self.restarts["controller, switched off and on"] += 1
        await self.controller.stop()
        await asyncio.sleep(self.chance.uniform(0, 0.3))
        await self.start_controller()

    async def unplug(self) -> None:
        """The cable is pulled just after a commit, or at any time; the program goes on, and may accept meanwhile."""
        await self.commit()
        self.restarts["line cut and restored"] += 1
        await self.controller.unplug()
        await asyncio.sleep(self.chance.uniform(0.1, 1.5))
        await self.controller.plug_in()

    async def forget(self) -> None:
        await self.in_the_midst_of_a_transfer()
        self.restarts["controller, memory lost"] += 1
        self.controller.restart(forget=True, keep_registers=self.chance.random() < 0.3)

    # --- a campaign ---------------------------------------------------------------------------------------------

    async def run(self, bound_s: float) -> Outcome:
        """Jobs until there are enough, rest, judgement; what does not come in time is a finding."""
        started = time.monotonic()
        (self.folder / "calibration.yaml").write_text(CALIBRATION)
        async with crossed_line() as (self.near_port, self.far_port):
            await self.start_controller()
            self.start_service()
            people = [asyncio.ensure_future(self.ask()), asyncio.ensure_future(self.machine())]
            try:
                await self._until_enough(started + bound_s)
            finally:
                for person in people:
                    person.cancel()
                await asyncio.wait(people)
            await self._rest()
            await self.end_service()
            await self.controller.stop()
        return self.outcome(started)

    def outcome(self, started: float) -> Outcome:
        """What it came to, judged."""
        rows = self.rows()
        evidence = self.evidence(rows)
        findings = judge(evidence)
        for text in self.findings_of_life.texts:
            findings.add(*text.split(": ", 1))
        for kind, texts in self.controller.verdict.texts.items():
            told = kind != "heartbeat-stalled" and evidence.verdict_kinds[kind] > 0
            findings.texts += [f"  {kind}: {text}" for text in texts[:3] if told]
        return Outcome(
            findings,
            Counter(str(row["outcome"]) for row in rows),
            self.faults.struck,
            self.restarts,
            len(self.taken),
            sum(event["event"] == "acknowledged" for event in self.events),
            sum(event["event"] == "answer" and event["layout"] == 1 for event in self.events),
            time.monotonic() - started,
        )

    def rows(self) -> list[dict[str, Any]]:
        """What the journal says of all jobs."""
        return jobs(self.folder / "journal.sqlite")

    def evidence(self, rows: list[dict[str, Any]]) -> Evidence:
        """What is judged."""
        return Evidence(
            jobs=rows,
            taken=self.taken,
            events=self.events,
            measured=self.measured,
            exposed=self.exposed,
            valid_for_s=self.valid_for_s if self.terms.has_clock else None,
            verdict_kinds=self.controller.verdict.counts.copy() if self.judges else Counter(),
            memory_lost=self.terms.forgetful,
            other_service=self.other_service,
        )

    def incidents(self) -> list[Incident]:
        """What happens besides the line's faults: each in its turn, then one as likely as another."""
        found: list[Incident] = [self.restart_service, self.restart_program, self.power_off]
        return found + [self.unplug] * 2 + [self.forget] * self.terms.forgetful

    async def _until_enough(self, give_up_at: float) -> None:
        incidents = self.incidents()
        turns = iter(dict.fromkeys(incidents))
        done = 0
        while self._ended() < self.terms.jobs or done < self.terms.incidents:
            await asyncio.sleep(self.chance.uniform(*self.pause_s) + (0 if self.terms.has_clock else 1.2))
            await (next(turns, None) or self.chance.choice(incidents))()
            done += 1
            if self.running.done():
                self._end_of_service()
                return
            if time.monotonic() >= give_up_at:
                self.findings_of_life.add("ended", f"{self._ended()} of {self.terms.jobs} jobs in the time given")
                return

    def _ended(self) -> int:
        return sum(row["outcome"] is not None for row in self.rows())

    def _end_of_service(self) -> None:
        self.findings_of_life.add("ended", f"the service ended: {self.running!r}")

    async def _rest(self) -> None:
        """Without faults, until all is settled and the service is ready again."""
        self.faults.enabled = False
        self.controller.set_state(1)
        self.controller.scan_s = 0.002
        try:
            async with asyncio.timeout(30):
                while not self._at_rest():
                    if self.running.done():
                        self._end_of_service()
                        return
                    await asyncio.sleep(0.02)
        except TimeoutError:
            fault = self.parts.health.first()
            why = fault.text if fault else "a job or trigger stays open"
            self.findings_of_life.add("ended", f"no rest within 30 s: {self.parts.health.state.label}: {why}")

    def _at_rest(self) -> bool:
        return (
            self.parts.health.state is State.READY
            and not self.parts.journal.unsettled()
            and not self.controller.trigger_open
            and self.parts.executor.idle  # a job that is only being taken is in no journal yet
            and not self.parts.executor.waiting
            and self.parts.executor._pending() is None
        )
