"""Calibration files: YAML to Calibration and back. A file that cannot be trusted in full is refused."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Any

import yaml
from pydantic import ValidationError

from contour.calibration.calibration import Calibration
from contour.calibration.fixed_marks import Sentinels
from contour.errors import CalibrationError
from service.atomic_file import write_whole
from service.config.config_file import ConfigError, line_of, read_yaml
from service.config.mistakes import describe
from service.measuring.calibration_models import MODELS, calibration_of, data_of, sentinels_of

FILE_MODE = 0o644  # the service has another user than who calibrates
HASH_PREFIX = "sha256:"


class CalibrationFileError(Exception):
    """A calibration file cannot be used: seen, expected, next step."""


class CalibrationChanged(CalibrationFileError):
    """A calibration file no longer is what was written: its hash does not match."""


@dataclass(frozen=True)
class CalibrationRecord:
    """A calibration with what its file says besides: of which camera, when, by what means, and the fixed marks.

    `created` None: the file does not say. `made` holds figures for people; nothing is decided by them. `digest` and
    `content`: hash and keys of the file it was read from, empty where it was not.
    """

    calibration: Calibration
    camera_name: str = ""
    created: datetime | None = None
    sentinels: Sentinels | None = None
    made: dict[str, str | float | None] = field(default_factory=dict)
    digest: str = field(default="", compare=False)
    content: dict[str, Any] = field(default_factory=dict, compare=False, repr=False)


def load_record(path: Path) -> CalibrationRecord:
    """All that a file says; raise CalibrationFileError."""
    return record_of(_read(path), str(path))


def record_of(data: dict[str, Any], path: str) -> CalibrationRecord:
    """The same of a file's content; `path` is for messages. Raise CalibrationFileError."""
    model = MODELS.get(str(data.get("kind")))
    if model is None:
        expected = ", ".join(repr(kind) for kind in MODELS)
        raise CalibrationFileError(
            f"{path}: kind is {data.get('kind')!r}, expected one of {expected}. Is it a calibration file? "
            "`combtrace calibrate` makes one"
        )
    try:
        file = model.model_validate(data)
    except ValidationError as error:
        told = describe(error, model, lambda where: line_of(Path(path), where))
        raise CalibrationFileError("; ".join(f"{path}: {line}" for line in told)) from error
    if file.hash is not None and file.hash != content_hash(data):
        raise CalibrationChanged(
            f"{path}: its hash is {file.hash}, its content gives {content_hash(data)}: it was changed after it was "
            "written. Restore it, calibrate again, or remove the line `hash` if the change was meant"
        )
    try:
        return CalibrationRecord(
            calibration_of(file),
            file.camera_name,
            file.created,
            sentinels_of(file),
            file.made,
            content_hash(data),
            data,
        )
    except CalibrationError as error:
        raise CalibrationFileError(f"{path}: {error}") from error


def save_record(path: Path, record: CalibrationRecord) -> None:
    """Write a calibration file with its hash. The old file is there until the new one is on the disk, whole."""
    data = data_of(
        record.calibration,
        camera_name=record.camera_name,
        created=record.created,
        sentinels=record.sentinels,
        made=record.made,
    )
    data["hash"] = content_hash(data)
    text = yaml.safe_dump(data, sort_keys=False, default_flow_style=None, width=100)
    try:
        write_whole(path, text.encode(), FILE_MODE)
    except OSError as error:
        raise CalibrationFileError(f"{path}: cannot be written: {error.strerror}. The old file is unchanged") from error


def content_hash(data: dict[str, Any]) -> str:
    """`sha256:` and the digest of all keys but `hash`, as JSON with sorted keys; layout does not count."""
    content = {key: value for key, value in data.items() if key != "hash"}
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), default=str)
    return HASH_PREFIX + hashlib.sha256(text.encode()).hexdigest()


def _read(path: Path) -> dict[str, Any]:
    try:
        data = read_yaml(path)
    except ConfigError as error:
        raise CalibrationFileError(str(error).replace(" with --config", "")) from error
    if not isinstance(data, dict):
        raise CalibrationFileError(f"{path}: holds no keys, expected version, kind, image_width, …")
    return data
