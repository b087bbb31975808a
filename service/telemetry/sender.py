"""Telemetry in a thread of its own: the daemon leaves a note and goes on; what a broker does or leaves is felt here.

One connection after another, each with its birth; what was not confirmed on the last goes first, as historical.
"""

from __future__ import annotations

import logging
import random
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from pathlib import Path

from service.config.plant import Telemetry
from service.records.job import Job
from service.state import State
from service.telemetry import cell_metrics
from service.telemetry.cell_metrics import TYPES, CellNow, Values, metrics_of
from service.telemetry.kept import Kept, load_kept, save_kept
from service.telemetry.payload import Metric
from service.telemetry.session import ANSWER_S, NotReached, Session, SessionLost, Waker
from service.telemetry.sources import DaemonSources
from service.telemetry.sparkplug import Node, rebirth_asked, state_said, state_topic
from service.telemetry.unsent import Changes, Jobs

log = logging.getLogger("combtrace.telemetry")

BEAT_S = 1.0  # a cell that says nothing for some of these is silent
FIRST_PAUSE_S, LONGEST_PAUSE_S = 0.5, 8.0  # before the next connection; drawn, for a plant's cells lose it together
STEADY_S = 10.0  # a connection that ends sooner is tried again with a longer pause each time
GAP_S = 0.1  # from a change to its telling: a job that begins or ends has the processor first
AT_ONCE = 50  # jobs or changes for which one answer is waited for
SAVE_S = 60.0
STOP_S = 1.0  # for what is left to tell, and again for taking leave
PATIENCE_S = 3.0  # for a thread that hangs in a name's lookup; it is left


@dataclass(frozen=True)
class Awaited:
    """An answer of the broker that confirms all that was sent before: changes and jobs up to their marks."""

    mid: int
    changes: int
    jobs: int
    since_s: float


class Sender:
    """Tells a broker what the daemon is and does, from `start` to `close`."""

    def __init__(
        self,
        settings: Telemetry,
        sources: DaemonSources,
        journal: Path,
        folder: Path,
        *,
        now: Callable[[], float] = time.time,
    ) -> None:
        """folder: for what is remembered over restarts."""
        self._settings, self._sources, self._folder, self._now = settings, sources, folder, now
        self._kept: Kept = load_kept(folder)
        last = sources.executor.last_settled
        newest = 0 if last is None else last.job_id
        confirmed = self._kept.confirmed
        self._jobs = Jobs(journal, settings.store, newest if confirmed is None else min(confirmed, newest))
        self._changes = Changes(settings.store)
        self._state: Values = {}
        self._cell = CellNow(sources, self._kept, settings.page_url)
        self._told: Values = {}
        self._node = Node(settings.group, settings.node, self._kept.births)
        self._host_online, self._host_said_ms = settings.primary_host is None, 0
        self._rebirth = False
        self._awaited: Awaited | None = None
        self._due_s = inf  # when what is new is to be told
        self._born_ms = 0
        self._saved_s = 0.0
        self._lost = ""
        self._waker = Waker()
        self._stop = self._waker.stopped
        self._thread = threading.Thread(target=self._run, name="telemetry", daemon=True)

    def start(self) -> None:
        """Begin; in the daemon's loop."""
        health = self._sources.health
        self._state = self._state_values(health.state, health.reason)
        health.listen(self._changed)
        self._sources.executor.on_settled.append(self._settled)
        self._thread.start()

    def close(self) -> None:
        """Tell the end, where there is somebody to tell, and end."""
        if not self._stop.is_set():
            self._waker.stop()
            if self._thread.ident is not None:
                self._thread.join(PATIENCE_S)
            self._waker.close()

    # --- in the daemon's loop, which nothing may hold up --------------------------------------------------------

    def _changed(self, state: State, reason: str | None) -> None:
        self._state = self._state_values(state, reason)
        self._changes.add(self._now_ms(), self._state)
        self._is_new()

    def _state_values(self, state: State, reason: str | None) -> Values:
        first = self._sources.health.first()
        return {
            cell_metrics.STATE: state.label,
            cell_metrics.STATE_CODE: int(state),
            cell_metrics.REASON: reason,
            cell_metrics.REASON_CODE: 0 if first is None else int(first.reason),
        }

    def _settled(self, job: Job) -> None:
        if job.outcome is not None:
            self._cell.outcomes[job.outcome] += 1
        self._jobs.due = True
        self._is_new()

    def _is_new(self) -> None:
        if self._due_s == inf:
            self._due_s = time.monotonic() + GAP_S
            self._waker.wake()

    # --- in the sender's thread ---------------------------------------------------------------------------------

    def _run(self) -> None:
        pause_s = FIRST_PAUSE_S
        while not self._stop.is_set():
            begun_s, born_ms = time.monotonic(), self._born_ms
            try:
                self._connection()
            except SessionLost as lost:
                self._tell_lost(str(lost) + self._hint(born_ms, begun_s))
            except Exception:  # whatever it is, it ends neither the daemon nor what it tells
                log.exception("telemetry: a defect. Report it with this log; it is tried again")
            pause_s = min(2 * pause_s, LONGEST_PAUSE_S) if time.monotonic() < begun_s + STEADY_S else FIRST_PAUSE_S
            self._stop.wait(pause_s * random.uniform(0.5, 1))
        self._save()

    def _hint(self, born_ms: int, begun_s: float) -> str:
        """What to look for where a connection ended soon after its birth: two of one name drive each other away."""
        if self._born_ms == born_ms or time.monotonic() >= begun_s + STEADY_S:
            return ""
        return f". If it goes on: is another cell named {self._settings.group}/{self._settings.node}, too?"

    def _tell_lost(self, why: str) -> None:
        """Once each: a broker that is away for a week is no news."""
        log.log(logging.DEBUG if why == self._lost else logging.WARNING, "telemetry: %s", why)
        self._lost = why

    def _connection(self) -> None:
        """One connection, from CONNECT to its end; raise SessionLost."""
        settings = self._settings
        self._node = Node(settings.group, settings.node, (self._kept.births + 1) % 256)
        self._awaited, self._rebirth, self._host_said_ms = None, False, 0
        self._host_online = settings.primary_host is None
        self._changes.again()
        self._jobs.again()
        will = self._node.death(self._now_ms())
        # A broker lets the last of one id in and the others go: no two cells may have one, as a-b, c and a, b-c would.
        client_id = f"combtrace-{len(settings.group)}-{settings.group}-{settings.node}"
        try:
            session = Session(settings, client_id, will, self._waker, self._heard)
        except NotReached:
            raise
        except SessionLost:
            self._kept.births = self._node.births
            raise
        with session:
            self._kept.births = self._node.births
            self._save()
            topics = [self._node.topic("NCMD")]
            topics += [] if settings.primary_host is None else [state_topic(settings.primary_host)]
            mid = session.subscribe(topics)
            session.turn_until(lambda: session.answered(mid), "SUBSCRIBE")
            while not self._host_online and not self._stop.is_set():
                session.turn(BEAT_S)
            if self._host_online:
                self._live(session)
            session.end(self._node.death(self._now_ms()), STOP_S)

    def _heard(self, topic: str, payload: bytes, retained: bool) -> None:
        """A host's state, or the wish for a birth: nothing else that a broker says is even looked at."""
        host = self._settings.primary_host
        if host is not None and topic == state_topic(host):
            said = state_said(payload)
            if said is not None and said[1] >= self._host_said_ms:
                self._host_online, self._host_said_ms = said
        elif topic == self._node.topic("NCMD") and not retained and rebirth_asked(payload):
            self._rebirth = True

    def _live(self, session: Session) -> None:
        """From the birth until the end is asked for, or the host that is waited for has gone."""
        self._birth(session)
        self._due_s = 0.0
        log.info("telemetry: %s:%d takes it", self._settings.host, self._settings.port)
        self._lost = ""
        beat_s = time.monotonic() + BEAT_S
        while self._host_online and not self._stop.is_set():
            busy = session.waiting or self._awaited is not None
            session.turn(max(0.0, (beat_s if busy else min(beat_s, self._due_s)) - time.monotonic()))
            self._look_for_answer(session)
            if session.waiting:  # a slow broker: what it has not taken yet is enough
                continue
            now_s = time.monotonic()
            if now_s >= beat_s:
                beat_s = now_s + BEAT_S
                self._beat(session)
                self._due_s = now_s if self._jobs.due else self._due_s
            if now_s >= self._due_s:
                self._send_unsent(session)
        if self._host_online:
            self._finish(session)

    def _finish(self, session: Session) -> None:
        """What is left to tell, until that is confirmed too, or it takes too long."""
        give_up_at = time.monotonic() + STOP_S
        while time.monotonic() < give_up_at:
            if not session.waiting:
                self._send_unsent(session)
            if self._awaited is None:
                break
            session.turn(0.1)
            self._look_for_answer(session)

    def _look_for_answer(self, session: Session) -> None:
        awaited = self._awaited
        if awaited is None:
            return
        if session.answered(awaited.mid):
            self._changes.confirm(awaited.changes)
            self._jobs.confirm(awaited.jobs)
            self._awaited = None
            if time.monotonic() > self._saved_s + SAVE_S:
                self._save()
        elif time.monotonic() > awaited.since_s + ANSWER_S:
            raise SessionLost(f"the broker has not answered for {ANSWER_S:g} s")

    def _send_unsent(self, session: Session) -> None:
        """The oldest that wait, and a question behind them: its answer says that the broker has taken them.

        Sparkplug has data sent with QoS 0, which nobody confirms; but a broker takes one packet after another.
        """
        if self._awaited is not None:
            return
        self._due_s = inf  # before it is looked for: what comes meanwhile is due anew
        changes, jobs = self._changes.unsent(AT_ONCE), self._jobs.unsent(AT_ONCE)
        if not changes and not jobs:
            return
        self._due_s = 0.0  # once it is answered there may be more
        now_ms = self._now_ms()
        if changes:
            metrics = [one for change in changes for one in metrics_of(change.values, change.at_ms, self._born_ms)]
            session.publish(self._node.data(metrics, now_ms))
        for job in jobs:
            session.publish(self._node.data(self._of_job(job), now_ms))
        mid = session.subscribe([self._node.topic("NCMD")])
        self._awaited = Awaited(mid, self._changes.mark(), self._jobs.mark(), time.monotonic())

    def _of_job(self, job: Job) -> list[Metric]:
        values = cell_metrics.job_values(job)
        at_ms = values["Job/Settled"]
        return metrics_of(values, at_ms if isinstance(at_ms, int) else self._now_ms(), self._born_ms)

    def _birth(self, session: Session) -> None:
        """All there is to tell, as it is now."""
        self._rebirth = False
        self._born_ms = self._now_ms()
        last = self._sources.executor.last_settled
        self._told = self._now_values()
        job = {} if last is None else cell_metrics.job_values(last)
        session.publish(self._node.birth(self._told | self._state | job, TYPES, self._born_ms))

    def _beat(self, session: Session) -> None:
        """All, where somebody has asked for it; else what has changed since the last: the time since the start has."""
        if self._rebirth:
            self._birth(session)
            return
        now = self._now_values()
        changed = {name: value for name, value in now.items() if value != self._told[name]}
        self._told = now
        now_ms = self._now_ms()
        session.publish(self._node.data(metrics_of(changed, now_ms, self._born_ms), now_ms))

    def _now_values(self) -> Values:
        return self._cell.values(self._changes.dropped + self._jobs.dropped, self._now_ms())

    def _save(self) -> None:
        self._kept.confirmed = self._jobs.confirmed
        self._saved_s = time.monotonic()
        save_kept(self._folder, self._kept)

    def _now_ms(self) -> int:
        return round(self._now() * 1000)
