"""What commissioning by the page has come to, in a folder of the daemon's state: a page that is closed, or a daemon
that is started again, goes on where it was. `combtrace calibrate` takes that folder's pictures, too.
"""

from __future__ import annotations

import logging
import re
from dataclasses import dataclass
from pathlib import Path

from pydantic import BaseModel, ConfigDict, ValidationError

from drivers.camera import Frame
from service.atomic_file import write_whole
from service.calibrating.alignment import WORK_POINTS
from service.measuring.points_file import PointsFileError, read_points
from service.records.pictures import PictureFileError, write_picture
from service.web.commission.models import BoardRequest, CalibrateRequest

log = logging.getLogger("combtrace.page")

MOST_SHOTS = 40
MOST_BYTES = 1_000_000_000
MOST_POINTS = 100
NOTES = "session.json"
SHOT = re.compile(r"(flat|view)-(\d{3,6})\.png")


class StepRefused(Exception):
    """A step comes to nothing: seen, expected, next step."""


class _Kept(BaseModel):
    model_config = ConfigDict(extra="forbid")


class KeptLook(_Kept):
    """The last picture that was only looked at. best: the sharpest of all; format: as the driver opened it."""

    width: int
    height: int
    colour: bool
    format: str
    sharpness: float
    best: float
    white_share: float
    black_share: float


class KeptCalibration(_Kept):
    """What was calibrated last. options: what the command would take it by, where it is not good."""

    good: bool
    sentence: str
    figure_mm: float
    accept_mm: float
    views: int
    options: str
    adopted: bool = False


class KeptLine(_Kept):
    """One thing that was probed."""

    part: str
    well: bool
    text: str


class Notes(_Kept):
    """All of it but the pictures."""

    board: BoardRequest | None = None
    camera: str = ""
    newest: int = 0
    look: KeptLook | None = None
    setup: CalibrateRequest = CalibrateRequest()
    calibration: KeptCalibration | None = None
    thickness_mm: float | None = None
    alignment: list[str] = []
    probe: list[KeptLine] = []
    changes: dict[str, str | int | float] = {}
    faults: dict[str, str] = {}


@dataclass(frozen=True)
class Shot:
    """A picture of the board. flat: it lies on the table there."""

    path: Path
    number: int
    flat: bool


class Session:
    """Notes and pictures on disk. All methods raise StepRefused where the disk refuses."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.notes = self._read()

    @property
    def candidate(self) -> Path:
        """The calibration that is not adopted yet."""
        return self.folder / "calibration.yaml"

    @property
    def report(self) -> Path:
        """Its report."""
        return self.folder / "calibration.html"

    @property
    def shots(self) -> list[Shot]:
        """All pictures by their numbers; the folder alone says which there are."""
        found = ((path, SHOT.fullmatch(path.name)) for path in self.folder.glob("*.png"))
        return sorted((Shot(path, int(name[2]), name[1] == "flat") for path, name in found if name), key=_number)

    @property
    def flat(self) -> Shot | None:
        """The newest picture in which the board lies on the table."""
        return next((shot for shot in reversed(self.shots) if shot.flat), None)

    def save(self) -> None:
        """Keep the notes, whole."""
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            write_whole(self.folder / NOTES, self.notes.model_dump_json(indent=1).encode())
        except OSError as error:
            raise StepRefused(f"{self.folder}: cannot be written: {error.strerror}. Free its disk") from error

    def add(self, frame: Frame, *, flat: bool) -> None:
        """Keep a picture, as `combtrace grab` stores it; a flat one takes the place of the one before."""
        shots, before = self.shots, self.flat if flat else None
        if len(shots) >= MOST_SHOTS:
            raise StepRefused(f"{MOST_SHOTS} pictures are kept, more are not. Remove some")
        kept_bytes = sum(shot.path.stat().st_size for shot in shots)
        if kept_bytes + frame.samples.nbytes > MOST_BYTES:
            raise StepRefused(f"the pictures take {kept_bytes / 1e6:.0f} MB, more are not kept. Remove some")
        number = max([self.notes.newest, *(shot.number for shot in shots)]) + 1
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            write_picture(self.folder / f"{'flat' if flat else 'view'}-{number:03d}.png", frame.samples)
        except (OSError, PictureFileError) as error:
            raise StepRefused(f"the picture cannot be kept: {error}") from error
        self.notes.camera, self.notes.newest = frame.camera, number
        if before is not None:
            before.path.unlink(missing_ok=True)
        self.save()

    def remove(self, number: int) -> None:
        """Let go of a picture."""
        shot = next((shot for shot in self.shots if shot.number == number), None)
        if shot is None:
            raise StepRefused(f"there is no picture {number}")
        shot.path.unlink(missing_ok=True)

    @property
    def points_file(self) -> Path:
        """Points that were jogged to, as `combtrace align` reads them."""
        return self.folder / "points.csv"

    @property
    def points(self) -> list[list[float]]:
        """All of them; raise StepRefused."""
        if not self.points_file.is_file():
            return []
        try:
            return [list(map(float, row)) for row in read_points(self.points_file, [WORK_POINTS])[1]]
        except PointsFileError as error:
            raise StepRefused(str(error)) from error

    def keep_points(self, points: list[list[float]]) -> None:
        """Keep these; raise StepRefused."""
        if len(points) > MOST_POINTS:
            raise StepRefused(f"{MOST_POINTS} points are kept, more are not. Remove some")
        rows = [",".join(f"{value:.10g}" for value in point) for point in points]
        try:
            if not points:
                self.points_file.unlink(missing_ok=True)
                return
            self.folder.mkdir(parents=True, exist_ok=True)
            write_whole(self.points_file, "\n".join([",".join(WORK_POINTS), *rows, ""]).encode())
        except OSError as error:
            raise StepRefused(f"{self.points_file}: cannot be written: {error.strerror}") from error

    def _read(self) -> Notes:
        path = self.folder / NOTES
        try:
            return Notes.model_validate_json(path.read_bytes())
        except FileNotFoundError:
            return Notes()
        except (OSError, ValidationError) as error:
            log.warning("page: %s cannot be read, so its notes are lost; the pictures are there: %s", path, error)
            return Notes()


def _number(shot: Shot) -> int:
    return shot.number
