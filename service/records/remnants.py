"""The list of remnants (SQLite): what is left of blocks that were cut, each with a number, outline and picture."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from contour.geometry.rings import Contour, area
from service.measuring.measurement import Measurement
from service.parts.remnant import Worth, remnants_of
from service.parts.sure_block import SureBlock

_TABLE = """
CREATE TABLE IF NOT EXISTS remnants (
    number INTEGER PRIMARY KEY AUTOINCREMENT,
    source TEXT NOT NULL,
    piece INTEGER NOT NULL,
    made_at TEXT NOT NULL,
    thickness_mm REAL NOT NULL,
    bound_mm REAL NOT NULL,
    area_mm2 REAL NOT NULL,
    rings TEXT NOT NULL,
    picture BLOB,
    used_at TEXT,
    UNIQUE (source, piece)
) STRICT;
"""
_COLUMNS = "number, source, made_at, thickness_mm, bound_mm, area_mm2, rings, used_at"


class RemnantsError(Exception):
    """The list cannot be read or written: seen, expected, next step."""


@dataclass(frozen=True)
class Remnant:
    """One piece. source: the job or picture that its block was seen in. contour: mm, in the frame that it was cut in.

    bound_mm: 95 % bound on where its edge lies. used_at: when it was taken; None = it is there.
    """

    number: int
    source: str
    made_at: str
    thickness_mm: float
    bound_mm: float
    contour: Contour
    used_at: str | None

    @property
    def area_mm2(self) -> float:
        return area(self.contour)


class Remnants:
    """The file; a connection a call, so that daemon and commands use it side by side. Raises RemnantsError."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def keep(self, source: str, measurement: Measurement, worth: Worth, picture: bytes | None) -> list[int]:
        """The numbers of what is left of a block with its parts cut out; none where no part lies in it.

        Of one source all is kept once: the same numbers are given again, whatever became of the pieces.
        """
        block, bound_mm = measurement.millimetres, measurement.uncertainty_mm
        if block is None or bound_mm is None or not measurement.laid:
            return []
        known = SureBlock.of(block, bound_mm, measurement.evidence or ())
        pieces = () if known is None else remnants_of(known.sure, [fit.placed for fit in measurement.laid], worth)
        made_at = datetime.now(UTC).isoformat(timespec="seconds")
        with self._opened() as db:
            for piece, contour in enumerate(pieces):
                rings = json.dumps([np.round(ring, 4).tolist() for ring in contour.rings])
                row = (source, piece, made_at, measurement.thickness_mm or 0.0, bound_mm, area(contour), rings, picture)
                db.execute(
                    "INSERT OR IGNORE INTO remnants (source, piece, made_at, thickness_mm, bound_mm, area_mm2, rings, "
                    "picture) VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
                    row,
                )
            found = db.execute("SELECT number FROM remnants WHERE source = ? ORDER BY piece", (source,)).fetchall()
        return [number for (number,) in found]

    def all(self, *, used: bool = False) -> list[Remnant]:
        """Those that are there, and with `used` also those that were taken, by number."""
        with self._opened() as db:
            where = "" if used else "WHERE used_at IS NULL"
            rows = db.execute(f"SELECT {_COLUMNS} FROM remnants {where} ORDER BY number").fetchall()
        return [_remnant(row) for row in rows]

    def take(self, number: int) -> None:
        """Note that the piece was taken."""
        with self._opened() as db:
            now = datetime.now(UTC).isoformat(timespec="seconds")
            done = db.execute("UPDATE remnants SET used_at = ? WHERE number = ? AND used_at IS NULL", (now, number))
            if not done.rowcount:
                raise RemnantsError(f"there is no remnant {number}, or it was taken before. See combtrace remnants")

    def picture(self, number: int) -> bytes:
        """The picture, as JPEG, in which its block was seen."""
        with self._opened() as db:
            row = db.execute("SELECT picture FROM remnants WHERE number = ?", (number,)).fetchone()
        if row is None or row[0] is None:
            raise RemnantsError(f"there is no picture of a remnant {number}. See combtrace remnants")
        return bytes(row[0])

    @contextmanager
    def _opened(self) -> Iterator[sqlite3.Connection]:
        """A connection with the table in it; what was done is durable once it is closed."""
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            db = sqlite3.connect(self.path, timeout=5.0)
            try:
                db.execute("PRAGMA synchronous = FULL")
                db.execute(_TABLE)
                with db:
                    yield db
            finally:
                db.close()
        except (sqlite3.Error, OSError) as error:
            raise RemnantsError(f"{self.path}: cannot be used as list of remnants ({error}). Name another") from error


def _remnant(row: Sequence[object]) -> Remnant:
    number, source, made_at, thickness_mm, bound_mm, _, rings, used_at = row
    try:
        exterior, *holes = (np.array(ring, dtype=np.float64) for ring in json.loads(str(rings)))
    except ValueError as error:
        raise RemnantsError(f"remnant {number} is damaged ({error}). Take it out of the list") from error
    return Remnant(
        int(str(number)),
        str(source),
        str(made_at),
        float(str(thickness_mm)),
        float(str(bound_mm)),
        Contour(exterior, tuple(holes)),
        None if used_at is None else str(used_at),
    )
