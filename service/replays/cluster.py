"""A Dask cluster that does batches of jobs; the same function as processes of this machine, by name."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass
from queue import Empty, SimpleQueue
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

from service.replays import versions
from service.replays.errors import INSTALL, ReplayError
from service.replays.work import Done, JobName, Work
from service.replays.workers import AHEAD, Ended, Task

if TYPE_CHECKING:
    from distributed import Client, Future

CONNECT_S = 10.0
LOOKED_EVERY_S = 2.0  # workers come and go


@dataclass(frozen=True)
class _Flying:
    task: Task
    future: Future  # of one that nobody holds nothing comes
    workers: tuple[str, ...]


class Cluster:
    """Workers of a Dask scheduler. Each needs combtrace of the same version, and to reach the archives by their names.

    Tasks are for workers that have the same versions: one of others would end each at once, and so be handed all.
    """

    def __init__(self, work: Work, scheduler: str) -> None:
        """Raise ReplayError where Dask is missing, or nobody answers there."""
        try:
            from distributed import Client
            from distributed.comm.addressing import parse_address, parse_host_port
        except ImportError as error:
            raise ReplayError(f"--scheduler needs Dask, which is not here. {INSTALL}") from error
        self._work = work
        self._ended: SimpleQueue[str] = SimpleQueue()
        self._flying: dict[str, _Flying] = {}
        self._threads: dict[str, int] = {}  # of workers that may be used
        self._left_out: dict[str, str] = {}
        self._begun = 0
        self._looked_at: float | None = None
        try:
            parse_host_port(parse_address(scheduler)[1])  # the client waits 20 s with what it cannot parse
            self._client: Client = Client(scheduler, timeout=CONNECT_S, set_as_default=False)
        except (OSError, ValueError, RuntimeError) as error:
            raise ReplayError(
                f"--scheduler {scheduler}: no Dask scheduler answers there ({error}). Expected e.g. tcp://host:8786"
            ) from error

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._client.cancel([one.future for one in self._flying.values()])
        self._client.close()

    @property
    def room(self) -> int:
        self._look()
        return AHEAD * sum(self._threads.values())

    @property
    def left_out(self) -> dict[str, str]:
        return dict(self._left_out)

    def begin(self, task: Task) -> None:
        self._begun += 1
        workers = tuple(self._threads)
        future = self._client.submit(
            done_on_worker, self._work, task.names, key=f"combtrace-replay-{self._begun}", pure=False, workers=workers
        )
        self._flying[future.key] = _Flying(task, future, workers)
        future.add_done_callback(lambda ended: self._ended.put(ended.key))

    def ended(self, at_most_s: float) -> Ended | None:
        try:
            key = self._ended.get(timeout=at_most_s)
        except Empty:
            self._look()
            return None
        one = self._flying.pop(key)
        return Ended(one.task, self._done(one.future))

    def _done(self, future: Future) -> Done | None:
        from distributed import KilledWorker

        if future.status == "cancelled":
            return None  # its workers have gone
        error = future.exception()
        if error is None:
            done: Done = future.result()
            return done
        if isinstance(error, KilledWorker):
            return None
        raise ReplayError(f"a worker cannot do tasks: {type(error).__name__}: {error}. {INSTALL} on each") from error

    def _look(self) -> None:
        """See which workers are there, and take back what is for none of them; raise ReplayError."""
        now = time.monotonic()
        if self._looked_at is not None and now - self._looked_at < LOOKED_EVERY_S:
            return
        self._looked_at = now
        if self._client.status != "running":
            raise ReplayError("the Dask scheduler has gone. Rows are kept: the same command goes on")
        there: dict[str, Any] = self._client.scheduler_info(n_workers=-1)["workers"]
        self._judge(there.keys() - self._threads.keys() - self._left_out.keys())
        self._threads = {
            address: int(one["nthreads"]) for address, one in there.items() if address not in self._left_out
        }
        if there and not self._threads:
            told = "; ".join(f"{worker}: {why}" for worker, why in self._left_out.items())
            raise ReplayError(f"no worker has the versions of here: {told}. Install the same; rows are kept")
        for one in list(self._flying.values()):
            if one.future.status == "pending" and not there.keys() & set(one.workers):
                one.future.cancel()

    def _judge(self, workers: set[str]) -> None:
        """Leave those out that have other versions than here, or do not say which."""
        import cloudpickle

        if not workers:
            return
        cloudpickle.register_pickle_by_value(versions)  # a worker may have a version without that module
        try:
            found = self._client.run(versions.versions_here, workers=sorted(workers), on_error="return")
        finally:
            cloudpickle.unregister_pickle_by_value(versions)
        wanted = asdict(self._work.versions)
        for worker in workers:
            said = found.get(worker)
            if said != wanted:
                self._left_out[worker] = f"has {_named(said)}, expected {_named(wanted)}"


def done_on_worker(work: Work, names: tuple[JobName, ...]) -> Done:
    """What a worker of the cluster is asked to do."""
    from distributed import get_worker

    return work.done(names, get_worker().address)


def _named(said: object) -> str:
    return ", ".join(f"{name} {version}" for name, version in said.items()) if isinstance(said, dict) else str(said)
