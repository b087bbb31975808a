"""CSV files of points that a person measured: columns by name, every number checked, every mistake with its line."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from contour.geometry.arrays import Float64s

LARGEST_FILE = 1_000_000


class PointsFileError(Exception):
    """A file of points cannot be used: file, line, what was seen, what is expected."""


def read_points(path: Path, layouts: Sequence[tuple[str, ...]]) -> tuple[tuple[str, ...], Float64s]:
    """The layout whose column names the header has, and the numbers, shape (N, columns of it).

    A file without a header has the first layout's columns in its order. Separators are commas, semicolons (then a comma
    may be a decimal point) or tabs; a column `name` and lines that begin with # are left out. Raises PointsFileError.
    """
    lines = _lines(path)
    expected = " or ".join(",".join(layout) for layout in layouts)
    if not lines:
        raise PointsFileError(f"{path}: is empty, expected a line {expected} and one line for each point")
    separator = next((one for one in (";", "\t") if one in lines[0][1]), ",")
    rows = [(number, _cells(text, separator)) for number, text in lines]
    header = [cell.lower() for cell in rows[0][1]]
    if _number(rows[0][1][0], separator) is not None:
        layout, wanted = layouts[0], list(range(len(layouts[0])))
    else:
        found = next((one for one in layouts if set(one) <= set(header)), None)
        if found is None:
            raise PointsFileError(f"{path}: line {rows[0][0]}: columns are {', '.join(header)}; expected {expected}")
        layout, wanted = found, [header.index(name) for name in found]
        rows = rows[1:]
    if not rows:
        raise PointsFileError(f"{path}: has a header and no points, expected one line for each")
    return layout, np.array([_row(path, number, cells, wanted, layout, separator) for number, cells in rows])


def _lines(path: Path) -> list[tuple[int, str]]:
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise PointsFileError(f"{path}: {path.stat().st_size} bytes, expected {LARGEST_FILE} at most")
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise PointsFileError(f"{path}: cannot be read: {error.strerror}. Name another file") from error
    except UnicodeDecodeError as error:
        raise PointsFileError(f"{path}: is no UTF-8 text (byte {error.start}). Save it as UTF-8") from error
    numbered = [(number, line.strip()) for number, line in enumerate(text.splitlines(), 1)]
    return [(number, line) for number, line in numbered if line and not line.startswith("#")]


def _cells(text: str, separator: str) -> list[str]:
    return [cell.strip() for cell in next(csv.reader([text], delimiter=separator))]


def _row(
    path: Path, number: int, cells: list[str], wanted: list[int], layout: tuple[str, ...], separator: str
) -> list[float]:
    values = []
    for name, index in zip(layout, wanted, strict=True):
        if index >= len(cells):
            raise PointsFileError(f"{path}: line {number}: {len(cells)} columns, {name} is missing")
        value = _number(cells[index], separator)
        if value is None or not math.isfinite(value):
            raise PointsFileError(f"{path}: line {number}: {name} is {cells[index]!r}, expected a finite number")
        values.append(value)
    return values


def _number(text: str, separator: str) -> float | None:
    try:
        return float(text.replace(",", ".") if separator == ";" else text)
    except ValueError:
        return None
