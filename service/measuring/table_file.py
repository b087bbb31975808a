"""The taught table as a file: an .npz archive of the picture, its noise, and of what camera it is."""

from __future__ import annotations

import io
import json
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from contour.errors import PictureError
from contour.image.picture_check import check_picture
from contour.image.taught_table import TaughtTable
from service.atomic_file import write_whole

VERSION = 1


class TableFileError(Exception):
    """A taught table cannot be read or written: the file, what was seen, what to do."""


@dataclass(frozen=True)
class TableRecord:
    """A taught table, the camera it was taught with ("" = not told), the pictures averaged, and when (ISO 8601)."""

    table: TaughtTable
    camera: str
    pictures: int
    taught_at: str


def table_bytes(record: TableRecord) -> bytes:
    """A taught table as it stands in its file."""
    about = {"version": VERSION, "camera": record.camera, "pictures": record.pictures, "taught_at": record.taught_at}
    data = io.BytesIO()
    np.savez_compressed(
        data, picture=record.table.picture, noise=np.float64(record.table.noise), about=np.array(json.dumps(about))
    )
    return data.getvalue()


def save_table(path: Path, record: TableRecord) -> None:
    """Write the file whole or not at all. Raises TableFileError."""
    try:
        write_whole(path, table_bytes(record))
    except OSError as error:
        raise TableFileError(f"{path}: cannot be written: {error.strerror}. Name another file") from error


def find_table(path: Path) -> TableRecord | None:
    """The taught table of a file; None where there is no file. Raises TableFileError where it cannot be used."""
    try:
        path.stat()
    except FileNotFoundError:
        return None
    except OSError as error:  # it may well be there, and what it would refuse must not pass
        raise TableFileError(f"{path}: cannot be looked at: {error.strerror}. Check its permissions") from error
    return load_table(path)


def load_table(path: Path) -> TableRecord:
    """The taught table of a file. Raises TableFileError."""
    try:
        # Opened here: numpy leaves a file open that proves to be no archive.
        with path.open("rb") as file:
            if not zipfile.is_zipfile(file):  # numpy would advise to load it unsafely
                raise ValueError("it is no archive of arrays")
            file.seek(0)
            with np.load(file, allow_pickle=False) as data:
                picture, noise, about = data["picture"], float(data["noise"]), json.loads(str(data["about"]))
        check_picture(picture)
        if about["version"] != VERSION or not 0 <= noise < 256:
            raise ValueError(f"version {about['version']}, noise {noise:g}")
        return TableRecord(
            TaughtTable(picture, noise), str(about["camera"]), int(about["pictures"]), str(about["taught_at"])
        )
    except OSError as error:
        raise TableFileError(f"{path}: cannot be read: {error.strerror or error}. Teach the table again") from error
    except (KeyError, TypeError, ValueError, EOFError, zipfile.BadZipFile, PictureError) as error:
        raise TableFileError(f"{path}: holds no taught table ({error}). Teach the table again") from error
