"""An earlier certificate beside this one: which lengths moved by more than both tests are uncertain."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot
from pathlib import Path
from statistics import fmean

from pydantic import BaseModel, ConfigDict, ValidationError

from service.certifying.certificate import PROCEDURE, Certificate

LARGEST_FILE = 50_000_000


class EarlierError(Exception):
    """An earlier certificate cannot be compared with: the file, what was seen, what is expected."""


class _Read(BaseModel):
    """What is read has numbers alone: with one that is none nothing could be compared."""

    model_config = ConfigDict(frozen=True, allow_inf_nan=False)


class _Length(_Read):
    name: str
    true_mm: float
    error_mm: float
    uncertainty_mm: float


class _Gauge(_Read):
    id: str


class Earlier(_Read):
    """What is compared of a certificate's JSON."""

    number: str
    procedure: str
    made: str
    passes: bool
    limit_mm: float
    largest_error_mm: float
    form_error_mm: float
    uncertainty_mm: float
    calibration_hash: str
    version: str
    operator: str
    gauge: _Gauge
    lengths: tuple[_Length, ...]


@dataclass(frozen=True)
class Change:
    """One of the gauge's lengths then and now: mean errors, and whether they differ by more than both tests explain."""

    name: str
    then_mm: float
    now_mm: float
    uncertainty_mm: float

    @property
    def moved(self) -> bool:
        """True where the difference is beyond both tests' uncertainty."""
        return abs(self.now_mm - self.then_mm) > self.uncertainty_mm


@dataclass(frozen=True)
class Comparison:
    """The earlier certificate, and each length that both measured."""

    earlier: Earlier
    changes: tuple[Change, ...]


def read_earlier(path: Path) -> Earlier:
    """The certificate of a JSON file; raise EarlierError."""
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise EarlierError(f"{path}: {path.stat().st_size} bytes, expected {LARGEST_FILE} at most")
        earlier = Earlier.model_validate_json(path.read_bytes())
    except OSError as error:
        raise EarlierError(f"{path}: cannot be read: {error.strerror}. Name another file") from error
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"]) or "the file"
        raise EarlierError(
            f"{path}: is no certificate: {where}: {first['msg']}. Name what `combtrace accept --json` wrote"
        ) from error
    if earlier.procedure != PROCEDURE:
        raise EarlierError(f"{path}: was tested by {earlier.procedure}, this is {PROCEDURE}: they cannot be compared")
    return earlier


def compared(now: Certificate, earlier: Earlier) -> Comparison:
    """Lengths of the same name, if the gauge is the same one; none where it is another."""
    changes = []
    for known in now.gauge.known if now.gauge.file.id == earlier.gauge.id else ():
        then = [one for one in earlier.lengths if one.name == known.name]
        here = [one for one in now.lengths if one.seen.name == known.name]
        if then and here:
            unsure = hypot(_mean([one.uncertainty_mm for one in then]), _mean([e.budget.expanded_mm for e in here]))
            changes.append(
                Change(known.name, _mean([one.error_mm for one in then]), _mean([e.error_mm for e in here]), unsure)
            )
    return Comparison(earlier, tuple(changes))


def fields(comparison: Comparison) -> dict[str, object]:
    """What the JSON says of it."""
    return {
        "number": comparison.earlier.number,
        "same_gauge": bool(comparison.changes),
        "lengths": [
            {"name": one.name, "then_mm": round(one.then_mm, 4), "now_mm": round(one.now_mm, 4), "moved": one.moved}
            for one in comparison.changes
        ],
    }


def as_text(now: Certificate, comparison: Comparison | None) -> str:
    """The certificate's JSON, one object, with the comparison in it."""
    against = None if comparison is None else fields(comparison)
    return json.dumps({**now.fields(), "against": against}, ensure_ascii=False, indent=1) + "\n"


def _mean(values: Sequence[float]) -> float:
    return fmean(values)
