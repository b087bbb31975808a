"""The host application at the broker: a thread that hears all cells, and says its STATE and who is to tell all.

What is known changes under one lock, which is held for as long as one message takes.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from datetime import datetime, timedelta
from datetime import time as time_of_day
from typing import Any

from service.fleet.cells import Cell, Cells, Name
from service.fleet.settings import Fleet
from service.fleet.store import DAY_MS, Figures, Store, StoreError
from service.telemetry.payload import DataType, Metric, Payload, Value, encoded
from service.telemetry.session import Message, Session, SessionLost, Waker
from service.telemetry.sparkplug import NAMESPACE, REBIRTH, state_message, state_topic

log = logging.getLogger("combtrace.fleet")

KEEP_S = 1.0  # from one writing of the store to the next
FIGURES_S = 5.0
PAUSE_S, LONGEST_PAUSE_S = 0.5, 8.0
STEADY_S = 10.0
STOP_S = 2.0
MOST_WAITING = 100_000  # jobs, for a disk that takes nothing now
KNOWN = ("NBIRTH", "NDATA", "NDEATH")


class Listener:
    """Cells as they are, from `start` to `close`."""

    def __init__(self, settings: Fleet, store: Store, *, now: Callable[[], float] = time.time) -> None:
        self._settings, self._store, self._now = settings, store, now
        self._cells = Cells()
        self._cells.by_name = {cell.name: cell for cell in store.cells()}
        self._figures: dict[Name, Figures] = {}
        self._lock = threading.Lock()
        self._new_jobs: list[tuple[Name, dict[str, Value | None]]] = []
        self._to_ask: list[Name] = []
        self._fresh: set[Name] = set()
        self._kept_s = self._added_s = 0.0
        self._begun_s = time.monotonic()
        self.connected = False
        self._waker = Waker()
        self._thread = threading.Thread(target=self._run, name="fleet")

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def close(self) -> None:
        """Say that nobody listens any more, and end."""
        self._waker.stop()
        self._thread.join()
        self._waker.close()
        self._store.close()

    def look(self, see: Callable[[Cell, Figures | None, float], Any]) -> list[Any]:
        """What `see` makes of each cell, its figures, and for how many seconds it has been silent."""
        now_s = time.monotonic()
        with self._lock:
            return [
                see(cell, self._figures.get(name), now_s - (self._begun_s if cell.heard_s is None else cell.heard_s))
                for name, cell in self._cells.by_name.items()
            ]

    # --- in its own thread --------------------------------------------------------------------------------------

    def _run(self) -> None:
        told, pause_s = "", PAUSE_S
        while not self._waker.stopped.is_set():
            begun_s = time.monotonic()
            try:
                self._connection()
            except SessionLost as lost:
                why, host = str(lost), self._settings.host_id
                if self.connected and time.monotonic() < begun_s + STEADY_S:
                    why += f". If it goes on: is there another page with host_id {host}?"
                    pause_s = min(2 * pause_s, LONGEST_PAUSE_S)  # two would drive each other away
                else:
                    pause_s = PAUSE_S
                log.log(logging.DEBUG if why == told else logging.WARNING, "fleet: %s", why)
                told = why
            except Exception:  # whatever it is, the page goes on, and it is tried again
                log.exception("fleet: a defect. Report it with this log")
            self.connected = False
            self._keep_up()
            self._waker.stopped.wait(pause_s)
        self._keep_up(at_once=True)

    def _connection(self) -> None:
        host, begun_ms = self._settings.host_id, self._now_ms()
        with self._lock:
            self._cells.forget_births()
        offline = state_message(host, False, begun_ms)
        client_id = f"combtrace-fleet-{host}"
        with Session(self._settings.broker, client_id, offline, self._waker, self._heard) as session:
            groups = self._settings.groups or ("+",)
            topics = [f"{NAMESPACE}/{group}/{kind}/+" for group in groups for kind in KNOWN]
            mid = session.subscribe([*topics, state_topic(host)])
            session.turn_until(lambda: session.answered(mid), "SUBSCRIBE")
            session.publish(state_message(host, True, begun_ms))
            self.connected = True
            log.info("fleet: listening at %s:%d", self._settings.broker.host, self._settings.broker.port)
            while not self._waker.stopped.is_set():
                session.turn(KEEP_S)
                for name in self._to_ask:
                    session.publish(self._ask(name))
                self._to_ask.clear()
                self._keep_up()
            session.end(offline, STOP_S)

    def _heard(self, topic: str, raw: bytes, _retained: bool) -> None:
        with self._lock:
            heard = self._cells.take(topic, raw, time.monotonic(), self._now_ms())
        if heard is None:
            return
        self._new_jobs += [(heard.name, job) for job in heard.jobs]
        self._to_ask += [heard.name] if heard.ask else []
        self._fresh |= {heard.name} if heard.fresh or heard.jobs else set()

    def _ask(self, name: Name) -> Message:
        """The one command that is ever given: tell all; it changes nothing."""
        wish = Metric(True, DataType.BOOLEAN, REBIRTH, timestamp_ms=self._now_ms())
        return Message(f"{NAMESPACE}/{name[0]}/NCMD/{name[1]}", encoded(Payload(self._now_ms(), (wish,)), types=True))

    def _keep_up(self, *, at_once: bool = False) -> None:
        """Note in the store what is new, and add up, both not too often."""
        now_s = time.monotonic()
        if at_once or now_s >= self._kept_s + KEEP_S:
            self._kept_s = now_s
            self._keep()
        if now_s >= self._added_s + FIGURES_S:
            self._added_s = now_s
            shift = shift_begin(self._settings.shifts, datetime.fromtimestamp(self._now()).astimezone())
            try:
                figures = self._store.figures(round(shift.timestamp() * 1000), self._now_ms())
            except StoreError as error:
                log.warning("fleet: %s", error)
                return
            with self._lock:
                self._figures = figures

    def _keep(self) -> None:
        if not self._new_jobs and not self._fresh:
            return
        fresh = [self._cells.by_name[name] for name in self._fresh]
        before_ms = self._now_ms() - round(self._settings.keep_days * DAY_MS)
        try:
            self._store.keep(fresh, self._new_jobs, before_ms)
        except StoreError as error:
            log.warning("fleet: %s", error)
            del self._new_jobs[:-MOST_WAITING]
            return
        self._new_jobs.clear()
        self._fresh.clear()

    def _now_ms(self) -> int:
        return round(self._now() * 1000)


def shift_begin(shifts: tuple[str, ...], now: datetime) -> datetime:
    """When the shift began in which `now` lies."""
    times = [time_of_day.fromisoformat(text) for text in shifts]
    begins = [
        datetime.combine((now - timedelta(days=days)).date(), one).astimezone() for days in (0, 1) for one in times
    ]
    return max(begin for begin in begins if begin <= now)
