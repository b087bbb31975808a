"""Archives where they lie: in a folder, or behind an address that fsspec knows, such as s3://bucket/cell-7."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

from service.records.archive import DOCUMENT, FOLDER, TABLES, folder_of
from service.records.evidence import FRAME, EvidenceError, Flaw
from service.replays.errors import INSTALL, ReplayError

# s3fs tries five times, and below it botocore would try each five times: a minute for what a bucket does not answer.
_OPTIONS: Final[dict[str, dict[str, Any]]] = {"s3": {"config_kwargs": {"retries": {"total_max_attempts": 1}}}}
UNKNOWN: Final = ""  # the end of a job of which nothing was found


@dataclass(frozen=True)
class Place:
    """One cell's archive. address: a folder's path, or with :// one for fsspec; it never holds a password."""

    cell: str
    address: str

    @property
    def remote(self) -> bool:
        """True where its files are fetched one by one."""
        return "://" in self.address

    def jobs(self) -> Iterator[tuple[int, str]]:
        """The number of each job, and the end in its document's name, in no order; raise ReplayError."""
        for name in _names(self.address):
            if FOLDER.fullmatch(name):
                for file in _names(f"{self.address}/{name}"):
                    found = DOCUMENT.fullmatch(file)
                    if found:
                        yield int(found[1]), found[2]

    @contextmanager
    def at_hand(self, job_id: int, ended: str) -> Iterator[Path]:
        """An archive on disk that holds the job, for as long as the block lasts; raise EvidenceError."""
        if not self.remote:
            yield Path(self.address)
            return
        with TemporaryDirectory(prefix="combtrace-replay-") as folder:
            here = Path(folder)
            try:
                self._fetch(here, job_id, ended)
                yield here
            except EvidenceError as error:  # told by where it lies: the copy has gone when that is read
                raise EvidenceError(str(error).replace(folder, self.address), error.flaw) from error

    def _fetch(self, here: Path, job_id: int, ended: str) -> None:
        """Copy the job's document and frame, and the tables that the document may name; raise EvidenceError.

        What is not there any more is not copied: whoever reads it says what that means.
        """
        if ended == UNKNOWN:
            raise EvidenceError(f"{self.address}: holds nothing of job {job_id}", Flaw.MISSING)
        there = folder_of(here, job_id)
        there.mkdir()
        document = there / f"{job_id}-{ended}.json"
        _copy(f"{self.address}/{there.name}/{document.name}", document)
        _copy(f"{self.address}/{there.name}/{job_id}-{FRAME}", there / f"{job_id}-{FRAME}")
        for table in _tables_named(document):
            (here / TABLES).mkdir(exist_ok=True)
            _copy(f"{self.address}/{TABLES}/{table}", here / TABLES / table)


def _tables_named(document: Path) -> list[str]:
    """The taught table's file; nothing where the document cannot be read, which is told by who reads it."""
    import json

    try:
        table = json.loads(document.read_bytes())["table"]
    except (OSError, ValueError, KeyError, TypeError):
        return []
    return [Path(table).name] if isinstance(table, str) else []


def _names(address: str) -> Iterable[str]:
    """What lies there, one floor deep; raise ReplayError."""
    if "://" not in address:
        try:
            return [entry.name for entry in Path(address).iterdir()]
        except OSError as error:
            raise ReplayError(f"{address}: cannot be listed: {error.strerror}. Name an archive's folder") from error
    files, path = _opened(address)
    try:
        return [str(name).rstrip("/").rpartition("/")[2] for name in files.ls(path, detail=False)]
    except Exception as error:  # of whichever library answers for this kind of address
        raise ReplayError(f"{address}: cannot be listed: {_told(error)}. Check address and credentials") from error


def _copy(address: str, file: Path) -> None:
    """Fetch one file, if it is there; raise EvidenceError where the storage does not answer."""
    try:
        files, path = _opened(address)
        with suppress(FileNotFoundError):
            file.write_bytes(files.cat_file(path))
    except ReplayError as error:
        raise EvidenceError(str(error), Flaw.STORAGE) from error
    except Exception as error:  # of whichever library answers for this kind of address
        raise EvidenceError(f"{address}: cannot be read: {_told(error)}", Flaw.STORAGE) from error


def _opened(address: str) -> tuple[Any, str]:
    """The file system behind an address, the same for all of its kind, and the path in it; raise ReplayError."""
    try:
        from fsspec.core import url_to_fs

        # Listings are read once: kept, those of a million jobs would fill the memory.
        files, path = url_to_fs(address, use_listings_cache=False, **_OPTIONS.get(address.partition(":")[0], {}))
    except ImportError as error:
        raise ReplayError(f"{address}: needs {error.name or 'fsspec'}, which is not here. {INSTALL}") from error
    except ValueError as error:
        raise ReplayError(f"{address}: {error}. Expected a folder, or an address such as s3://bucket/cell-7") from error
    return files, str(path)


def _told(error: Exception) -> str:
    return str(error).strip().partition("\n")[0] or type(error).__name__
