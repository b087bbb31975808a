"""A master part's outline as JSON: the millimetres of `combtrace trace --json`, or its two keys alone."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from contour.geometry.rings import Contour, Ring, contour_defect, oriented_contour

LARGEST_FILE = 50_000_000


class MasterFileError(Exception):
    """A master outline cannot be used: the file, what was seen, what is expected."""


def read_master(path: Path) -> Contour:
    """The outline in millimetres of `{"exterior": [[x, y]…], "holes": [[[x, y]…]…]}`, or of that under "millimetres".

    Of several lines (JSON Lines) the first counts. Raises MasterFileError.
    """
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise MasterFileError(f"{path}: {path.stat().st_size} bytes, expected {LARGEST_FILE} at most")
        text = path.read_text(encoding="utf-8-sig").strip()
        data = _first(text)
    except OSError as error:
        raise MasterFileError(f"{path}: cannot be read: {error.strerror}. Name another file") from error
    except (UnicodeDecodeError, ValueError, RecursionError) as error:
        raise MasterFileError(f"{path}: is no JSON: {error}. Make it by `combtrace trace --json`") from error
    if isinstance(data, dict) and "millimetres" in data:
        data = data["millimetres"]
    if not isinstance(data, dict) or "exterior" not in data:
        raise MasterFileError(f"{path}: holds no outline in millimetres, expected the keys exterior and holes")
    try:
        contour = Contour(ring_of(data["exterior"]), tuple(ring_of(hole) for hole in data.get("holes") or ()))
    except (TypeError, ValueError) as error:
        raise MasterFileError(f"{path}: a ring is {error}, expected three or more points [x, y] in mm") from error
    defect = contour_defect(contour)
    if defect:
        raise MasterFileError(f"{path}: is no outline of a part: {defect}")
    return oriented_contour(contour, counter_clockwise=True)


def _first(text: str) -> Any:
    try:
        return json.loads(text)
    except ValueError:
        return json.loads(text.splitlines()[0] if text else "")


def ring_of(points: Any) -> Ring:
    """The ring of a JSON list of points [x, y]; raise TypeError or ValueError where it is none."""
    ring = np.array(points, dtype=np.float64)
    if ring.ndim != 2 or ring.shape[1] != 2 or len(ring) < 3 or not np.isfinite(ring).all():
        raise ValueError(f"of shape {ring.shape}" if np.isfinite(ring).all() else "not finite")
    return ring
