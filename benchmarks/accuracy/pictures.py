"""Pictures for docs/reports/accuracy.md: sheets of all scenes with the traced contour, and corners seen from near."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from contour.geometry.rings import Contour
from contour.synthetic import Rendered
from tests.support.scenes.bench_scenes import BenchScene
from tests.support.scenes.trials import Trial

Picture = NDArray[np.uint8]

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "pictures"
THUMB = (400, 300)
COLUMNS, ROWS = 4, 4
CLOSE_UPS = (
    "rectangle-shop",
    "holes-shop",
    "crescent-shop",
    "missing-corner-cells",
    "edges-along-rows",
    "dark-on-bright-shop",
    "fine-8px",
    "broken-off",
)
FOUND, TRUE = (80, 220, 60), (60, 60, 240)


class Gallery:
    """Collects thumbnails of every scene, and close-ups of some, with one method's contour."""

    def __init__(self, method: str) -> None:
        self.method = method
        self._thumbs: list[Picture] = []
        self._close: list[Picture] = []

    def add(self, scene: BenchScene, rendered: Rendered, trials: Sequence[Trial]) -> None:
        """Take one scene in."""
        trial = next((trial for trial in trials if trial.method == self.method), None)
        found = trial.contour if trial is not None else None
        self._thumbs.append(_thumb(rendered, found, scene.name))
        if scene.name in CLOSE_UPS:
            self._close.append(_close_up(rendered, found, scene.name))

    def write(self) -> list[Path]:
        """Write the sheets; their paths."""
        FOLDER.mkdir(parents=True, exist_ok=True)
        size = COLUMNS * ROWS
        sheets = [
            (f"scenes-{number + 1}.jpg", _sheet(self._thumbs[first : first + size], COLUMNS))
            for number, first in enumerate(range(0, len(self._thumbs), size))
        ]
        if self._close:
            sheets.append(("scenes-close.png", _sheet(self._close, 4)))
        paths = []
        for name, sheet in sheets:
            path = FOLDER / name
            kind = [cv2.IMWRITE_JPEG_QUALITY, 74] if path.suffix == ".jpg" else [cv2.IMWRITE_PNG_COMPRESSION, 9]
            if not cv2.imwrite(str(path), sheet, kind):
                raise OSError(f"{path}: the picture could not be written; check the folder and the disk")
            paths.append(path)
        return paths


def _thumb(rendered: Rendered, found: Contour | None, name: str) -> Picture:
    small = np.asarray(cv2.resize(_bgr(rendered.picture), THUMB, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    factor = np.array(THUMB) / np.array(rendered.picture.shape[1::-1])
    if found is not None:
        for ring in found.rings:
            _line(small, (ring + 0.5) * factor - 0.5, FOUND)
    return _named(small, name if found is not None else f"{name}: no contour")


def _close_up(rendered: Rendered, found: Contour | None, name: str) -> Picture:
    """Six pitches around the exterior's topmost corner, enlarged; truth red, found green."""
    ring = rendered.truth_px.exterior
    corner = ring[int(np.argmin(ring.sum(axis=1)))]
    reach = max(24.0, 3.0 * rendered.pitch_px)
    size = int(THUMB[0])
    low = np.clip(corner - 0.7 * reach, 0, np.array(rendered.picture.shape[1::-1]) - 2 * reach)
    scale = size / (2 * reach)
    matrix = np.array([[scale, 0.0, -low[0] * scale], [0.0, scale, -low[1] * scale]])
    warped = cv2.warpAffine(_bgr(rendered.picture), matrix, (size, size), flags=cv2.INTER_NEAREST)
    big: Picture = np.asarray(warped, dtype=np.uint8)
    for contour, colour in ((rendered.truth_px, TRUE), (found, FOUND)):
        for one in contour.rings if contour is not None else ():
            _line(big, (one - low) * scale, colour)
    return _named(big, name)


def _line(picture: Picture, ring: NDArray[np.float64], colour: tuple[int, int, int]) -> None:
    cv2.polylines(picture, [np.rint(ring * 16).astype(np.int32)], True, colour, 1, cv2.LINE_AA, 4)


def _named(picture: Picture, name: str) -> Picture:
    picture[:26] //= 3
    cv2.putText(picture, name, (8, 18), cv2.FONT_HERSHEY_SIMPLEX, 0.45, (235, 235, 235), 1, cv2.LINE_AA)
    return picture


def _bgr(picture: Picture) -> Picture:
    return picture if picture.ndim == 3 else np.asarray(cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR), dtype=np.uint8)


def _sheet(pictures: list[Picture], columns: int) -> Picture:
    blank = np.zeros_like(pictures[0])
    filled = pictures + [blank] * (-len(pictures) % columns)
    rows = [np.hstack(filled[first : first + columns]) for first in range(0, len(filled), columns)]
    return np.asarray(np.vstack(rows), dtype=np.uint8)
