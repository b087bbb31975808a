"""A run's files: what is to be done, and a part for each batch that is; whole, they become one table.

A part is written under another name and renamed, and is named by its batch. So whatever is killed, a batch is there
whole or not at all, and the next run of the same command does the others.
"""

from __future__ import annotations

import fcntl
import json
import os
import shutil
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Final, Self

from service.replays.errors import INSTALL, ReplayError
from service.replays.rows import COLUMNS, Row
from service.replays.work import JobName

if TYPE_CHECKING:
    import pyarrow as pa

MOST_A_BATCH: Final = 64
BATCHES: Final = 100  # at least, where there are so many jobs: the last ones are to keep all workers busy
ROWS_A_GROUP: Final = 20_000
TERMS: Final = b"combtrace.replay"
LEFT_OUT: Final = b"combtrace.workers_left_out"
PLAN: Final = "plan.parquet"

Terms = dict[str, Any]
"""What a run is carried out with, JSON's types only: a run goes on only where it is the same."""


class RunFiles:
    """The files of the run whose table is `output`. One process at a time writes them."""

    def __init__(self, output: Path, terms: Terms) -> None:
        """Raise ReplayError where pyarrow is missing, another run writes, or what is there has other terms."""
        try:
            import pyarrow  # noqa: F401
        except ImportError as error:
            raise ReplayError(f"--output needs pyarrow, which is not here. {INSTALL}") from error
        self.output = output
        self.parts = output.with_name(f"{output.name}.parts")
        self._terms = json.loads(json.dumps(terms))
        self._lock: IO[bytes] | None = None
        self._plan: pa.Table | None = None  # of a million jobs 25 MB; as objects it would be a hundred and more
        for path in (output, self.parts / PLAN):
            if path.exists():
                self._check_terms(path)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._lock is not None:
            self._lock.close()
            self._lock = None

    @property
    def complete(self) -> bool:
        """True where the table is there."""
        return self.output.exists()

    @property
    def begun(self) -> bool:
        """True where there is a plan to go on with."""
        return (self.parts / PLAN).exists()

    def open(self, names: Sequence[JobName]) -> None:
        """Begin with these jobs, by place and number, or go on with those of before; raise ReplayError."""
        import pyarrow as pa

        try:
            self.parts.mkdir(parents=True, exist_ok=True)
            self._lock = (self.parts / "lock").open("wb")
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if self.complete:
                raise ReplayError(f"{self.output}: another run has ended meanwhile. The same command tells of it")
            if not self.begun:
                for part in self.parts.glob("batch-*.parquet"):  # of a run whose plan somebody took away
                    part.unlink()
                columns = {key: [getattr(name, key) for name in names] for key in ("place", "job_id", "ended")}
                self._write(PLAN, pa.table(columns).replace_schema_metadata(self._metadata()))
            self._plan = _read(self.parts / PLAN)
        except BlockingIOError as error:
            raise ReplayError(f"{self.output}: another run writes it. Wait for it, or name another file") from error
        except OSError as error:
            raise ReplayError(f"{self.parts}: cannot be written: {error.strerror}. Name another --output") from error

    @property
    def jobs(self) -> int:
        """How many there are to do, done or not."""
        return 0 if self._plan is None else len(self._plan)

    @property
    def batch_size(self) -> int:
        """Jobs of a batch: the same each time, for the plan is."""
        return max(1, min(MOST_A_BATCH, self.jobs // BATCHES))

    def size(self, number: int) -> int:
        """How many jobs a batch has."""
        return min(self.batch_size, self.jobs - number * self.batch_size)

    def batch(self, number: int) -> list[JobName]:
        """The jobs of a batch."""
        assert self._plan is not None
        return [JobName(**name) for name in self._plan.slice(number * self.batch_size, self.batch_size).to_pylist()]

    @property
    def batches(self) -> range:
        """Numbers of all batches."""
        return range(-(-self.jobs // self.batch_size))

    def missing(self) -> list[int]:
        """Batches that are still to be done."""
        there = {path.name for path in self.parts.iterdir()}
        return [number for number in self.batches if _part(number) not in there]

    def put(self, number: int, rows: Sequence[Row]) -> None:
        """Keep a batch's rows; raise ReplayError."""
        import pyarrow as pa

        try:
            self._write(_part(number), pa.Table.from_pylist(list(rows), schema()))
        except OSError as error:
            raise ReplayError(f"{self.parts}: cannot be written: {error.strerror}. The same command goes on") from error

    def workers_left_out(self) -> dict[str, str]:
        """Workers of the whole table's run that had other versions, and which."""
        import pyarrow.parquet as pq

        return dict(json.loads((pq.read_schema(self.output).metadata or {}).get(LEFT_OUT, b"{}")))

    def join(self, workers_left_out: dict[str, str]) -> None:
        """Make one table of all parts, by cell and number, and take the parts away; raise ReplayError."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        beside = self.output.with_name(f".{self.output.name}.new")
        try:
            metadata = {**self._metadata(), LEFT_OUT: json.dumps(workers_left_out).encode()}
            with pq.ParquetWriter(beside, schema().with_metadata(metadata)) as writer:
                waiting: list[pa.Table] = []
                for number in self.batches:
                    waiting.append(_read(self.parts / _part(number)))
                    if sum(map(len, waiting)) >= ROWS_A_GROUP or number == self.batches[-1]:
                        writer.write_table(pa.concat_tables(waiting))
                        waiting = []
            _settle(beside, self.output)
        except OSError as error:
            raise ReplayError(
                f"{self.output}: cannot be written: {error.strerror}. All rows lie in {self.parts}: the same command "
                "goes on"
            ) from error
        with suppress(OSError):  # what cannot be deleted does no harm
            shutil.rmtree(self.parts)

    def _write(self, name: str, table: pa.Table) -> None:
        import pyarrow.parquet as pq

        beside = self.parts / f".{name}.new"
        pq.write_table(table, beside)
        _settle(beside, self.parts / name)

    def _metadata(self) -> dict[bytes, bytes]:
        return {TERMS: json.dumps(self._terms).encode()}

    def _check_terms(self, path: Path) -> None:
        found = terms_of(path)
        if found == self._terms:
            return
        others = sorted(key for key in {*found, *self._terms} if found.get(key) != self._terms.get(key))
        told = ", ".join(f"{key} was {found.get(key)}, is {self._terms.get(key)}" for key in others)
        there = path if path == self.output else self.parts
        raise ReplayError(f"{there}: is of another run: {told}. Name another --output, or delete it")


def schema() -> pa.Schema:
    """Columns and types of the table."""
    import pyarrow as pa

    types = {
        "string": pa.string(),
        "int64": pa.int64(),
        "double": pa.float64(),
        "bool": pa.bool_(),
        "timestamp": pa.timestamp("ms", "UTC"),
    }
    return pa.schema([(name, types[kind]) for name, (kind, _) in COLUMNS.items()])


def terms_of(path: Path) -> Terms:
    """What the run was carried out with that wrote the file; raise ReplayError."""
    import pyarrow.parquet as pq
    from pyarrow.lib import ArrowException

    try:
        return dict(json.loads((pq.read_schema(path).metadata or {})[TERMS]))
    except (OSError, ArrowException, KeyError, ValueError) as error:
        raise ReplayError(f"{path}: is no table of `combtrace replay`. Name another --output, or delete it") from error


def _read(part: Path) -> pa.Table:
    """What a part holds; raise ReplayError where a disk has damaged it."""
    import pyarrow.parquet as pq
    from pyarrow.lib import ArrowException

    try:
        return pq.read_table(part)
    except (OSError, ArrowException) as error:
        raise ReplayError(f"{part}: cannot be read: {error}. Delete it: the same command does it again") from error


def _part(number: int) -> str:
    return f"batch-{number:07d}.parquet"


def _settle(beside: Path, path: Path) -> None:
    """Put the written file in its place, durable."""
    with beside.open("rb") as file:
        os.fsync(file.fileno())
    os.replace(beside, path)
