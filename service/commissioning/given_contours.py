"""Contours from a file or by name, in millimetres of the machine frame, and what sends them in the place of a camera.

Read are the project's own forms (`combtrace trace --json`, `--geojson`, the log of `simulate-controller`) and bare
rings; GeoJSON's numbers count as millimetres.
"""

from __future__ import annotations

import itertools
import json
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contour.acceptance.acceptance import judge_millimetres
from contour.acceptance.error_budget import ErrorBudget
from contour.geometry.rings import Contour, Ring, area, oriented_contour
from drivers.camera import Frame
from service.config.recipes import AnyRecipe
from service.measuring.measure import Measurer, rejections
from service.measuring.measurement import Measurement

LARGEST_FILE = 100_000_000
LARGEST_COORDINATE_MM = 2_147_483.647  # what an i32 of micrometres holds
BARE_KEYS = frozenset({"exterior", "holes"})


class GivenContoursError(Exception):
    """The file's content is no contours: where, what was seen, what is expected."""


@dataclass(frozen=True, eq=False)
class GivenContour:
    """One contour to send: exterior counter-clockwise, holes clockwise, mm. uncertainty_mm None = not known."""

    name: str
    contour: Contour
    uncertainty_mm: float | None = None


class GivenContours(Measurer):
    """Sends contours in turn where a measurer would trace: each job gets the next, after the last the first again.

    Held against the recipe's and the machine's limits as a traced one is. aligned: whether they count as tied to the
    machine's coordinates.
    """

    def __init__(self, contours: Sequence[GivenContour], *, aligned: bool, work_area_mm: Ring | None = None) -> None:
        super().__init__(None, work_area_mm=work_area_mm)
        self._turn = itertools.cycle(contours)
        self._aligned = aligned

    def measure(
        self, picture: NDArray[np.uint8], recipe: AnyRecipe, thickness_mm: float, camera: str = ""
    ) -> Measurement:
        """The next contour as if it had been measured; the picture is not looked at."""
        given = next(self._turn)
        sure = given.uncertainty_mm
        return Measurement(
            method=f"given: {given.name}",
            millimetres=given.contour,
            area_mm2=area(given.contour),
            uncertainty=None if sure is None else ErrorBudget(sure, 0.0, None),
            thickness_mm=thickness_mm,
            aligned=self._aligned,
            findings=rejections(judge_millimetres(given.contour, self._limits(recipe), sure)),
        )


class NoCamera:
    """Stands where a camera would: frames of nothing, which do not come from a live camera."""

    def open(self) -> None:
        """Nothing to open."""

    def grab(self, exposed_after_s: float, timeout_s: float) -> Frame:
        """A frame of one pixel."""
        del timeout_s
        at_s = max(time.monotonic(), exposed_after_s)
        return Frame(np.zeros((1, 1), np.uint8), at_s, simulated=True, source="given", sequence=1)

    def check(self) -> None:
        """Nothing can be wrong with it."""

    def close(self) -> None:
        """Nothing to close."""


def read_contours(path: Path) -> tuple[GivenContour, ...]:
    """The contours of a file, one or more, in its order; raise GivenContoursError."""
    try:
        size = path.stat().st_size
        if size > LARGEST_FILE:
            raise GivenContoursError(f"{path}: {size} bytes, expected {LARGEST_FILE} at most")
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise GivenContoursError(f"{path}: cannot be read: {error.strerror}. Name another file") from error
    except UnicodeDecodeError as error:
        raise GivenContoursError(f"{path}: is no UTF-8 text (byte {error.start}). Save it as UTF-8") from error
    contours = tuple(
        _contour(found, f"{path.name} {number}", f"{path}, contour {number}")
        for number, found in enumerate(itertools.chain(*map(_contours_in, _documents(text, path))), start=1)
    )
    if not contours:
        raise GivenContoursError(f"{path}: holds no contour, expected one or more")
    return contours


def _documents(text: str, path: Path) -> list[Any]:
    """One JSON document, or one a line."""
    try:
        return [json.loads(text)]
    except ValueError as error:
        if "\n" not in text.strip():
            raise GivenContoursError(f"{path}: is no JSON: {error}") from error
    documents = []
    for number, line in enumerate(text.splitlines(), start=1):
        if line.strip():
            try:
                documents.append(json.loads(line))
            except ValueError as error:
                raise GivenContoursError(
                    f"{path}: neither one JSON document nor one a line; line {number}: {error}"
                ) from error
    return documents


def _contours_in(document: Any) -> Iterator[Any]:
    """What in a document is a contour each: features of a collection, items of a list."""
    if isinstance(document, dict) and document.get("type") == "FeatureCollection":
        yield from document.get("features") or ()
    elif isinstance(document, list) and not _is_ring(document):
        yield from document
    else:
        yield document


def _is_ring(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and isinstance(value[0], list) and not _holds_lists(value[0])


def _holds_lists(value: list[Any]) -> bool:
    return any(isinstance(item, list) for item in value)


def _contour(found: Any, name: str, where: str) -> GivenContour:
    rings, sure = _rings(found, where)
    if not isinstance(rings, list) or not rings:
        raise GivenContoursError(f"{where}: has no rings, expected the exterior, then holes")
    exterior, *holes = [_ring(ring, where, number) for number, ring in enumerate(rings)]
    if sure is not None and (isinstance(sure, bool) or not isinstance(sure, int | float) or not 0 <= sure < 1e6):
        raise GivenContoursError(f"{where}: uncertainty_mm is {sure!r}, expected millimetres, or null for not known")
    return GivenContour(name, oriented_contour(Contour(exterior, tuple(holes)), counter_clockwise=True), sure)


def _rings(found: Any, where: str) -> tuple[Any, Any]:
    """All rings, exterior first, and the uncertainty in mm, as the document has them."""
    if isinstance(found, list):
        return [found], None
    if isinstance(found, dict):
        if "millimetres" in found:
            inner = found["millimetres"]
            if inner is None:
                raise GivenContoursError(f"{where}: has no millimetres. Trace it with a calibration")
            return _rings(inner, where)[0], found.get("uncertainty_mm")
        if found.get("type") == "Feature":
            properties = found.get("properties") or {}
            unit = properties.get("unit", "mm")
            if unit != "mm":
                raise GivenContoursError(f"{where}: its unit is {unit!r}, expected mm")
            return _rings(found.get("geometry"), where)[0], properties.get("uncertainty_mm")
        if found.get("type") == "Polygon":
            return found.get("coordinates"), None
        if "exterior" in found and found.keys() <= BARE_KEYS:
            return [found["exterior"], *(found.get("holes") or [])], None
        seen = f"an object with {', '.join(map(repr, list(found)[:5])) or 'nothing'}"
    else:
        seen = repr(found)[:40]
    raise GivenContoursError(
        f'{where}: is {seen}; expected {{"exterior": [[x, y], …], "holes": […]}} in mm, a line of '
        "`combtrace trace --json`, or a GeoJSON Polygon"
    )


def _ring(points: Any, where: str, number: int) -> Ring:
    """Vertices, the repeated first one let go; what is no simple ring is for the limits to refuse."""
    name = "the exterior" if number == 0 else f"hole {number}"
    expected = "expected three or more [x, y] in mm"
    try:
        ring = np.array(points, dtype=np.float64)
    except (TypeError, ValueError):
        raise GivenContoursError(f"{where}: {name} is no list of pairs of numbers, {expected}") from None
    if ring.ndim != 2 or ring.shape[1] != 2:
        raise GivenContoursError(f"{where}: {name} has shape {ring.shape}, {expected}")
    if len(ring) > 1 and np.array_equal(ring[0], ring[-1]):
        ring = ring[:-1]
    if len(ring) < 3:
        raise GivenContoursError(f"{where}: {name} has {len(ring)} vertices, {expected}")
    if not np.all(np.abs(ring) <= LARGEST_COORDINATE_MM):
        raise GivenContoursError(f"{where}: {name} has a vertex that is not finite or beyond ±2147483.647 mm")
    return ring
