"""Calibration files: YAML to Calibration and back. A file that cannot be trusted in full is refused."""

from __future__ import annotations

import hashlib
import json
import os
import tempfile
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import yaml
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator

from contour.calibration import Alignment, Calibration, CameraCalibration, SimpleCalibration
from contour.errors import CalibrationError
from service.config import Number, no_truth_value
from service.config_file import ConfigError, describe, read_yaml

VERSION = 1
HASH_PREFIX = "sha256:"
Size = Annotated[int, BeforeValidator(no_truth_value), Field(ge=1, le=100_000)]


class CalibrationFileError(Exception):
    """A calibration file cannot be used: seen, expected, next step."""


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class _Matrix(_Model):
    """A matrix as ROS writes it: rows, cols, data in row order."""

    rows: int
    cols: int
    data: list[Number]

    @model_validator(mode="after")
    def _complete(self) -> _Matrix:
        if len(self.data) != self.rows * self.cols:
            raise ValueError(f"data has {len(self.data)} numbers, expected rows x cols = {self.rows * self.cols}")
        return self


class _Plane(_Model):
    """The work frame before the camera, OpenCV's convention."""

    rotation_vector: tuple[Number, Number, Number]
    translation_mm: tuple[Number, Number, Number]


class _Alignment(_Model):
    """The machine frame: R(rotation) · work + translation."""

    rotation_deg: Number = 0.0
    translation_mm: tuple[Number, Number] = (0.0, 0.0)


class _Uncertainty(_Model):
    """What the calibration states of itself, 95 %: plane_mm, of a position in the traced plane."""

    plane_mm: Annotated[Number, Field(ge=0)]


class _File(_Model):
    version: Literal[1]
    image_width: Size
    image_height: Size
    camera_name: str = ""
    alignment: _Alignment | None = None
    uncertainty: _Uncertainty | None = None
    hash: str | None = None


class _CameraFile(_File):
    kind: Literal["camera"]
    distortion_model: Literal["plumb_bob", "rational_polynomial"] = "plumb_bob"
    camera_matrix: _Matrix
    distortion_coefficients: _Matrix
    work_plane: _Plane


class _SimpleFile(_File):
    kind: Literal["simple"]
    mm_per_pixel: Annotated[Number, Field(gt=0)]
    plane_height_mm: Number = 0.0
    origin_px: tuple[Number, Number] = (0.0, 0.0)
    rotation_deg: Number = 0.0


def load_calibration(path: Path) -> Calibration:
    """The calibration of a file; raise CalibrationFileError."""
    data = _read(path)
    models: dict[str, type[_CameraFile] | type[_SimpleFile]] = {"camera": _CameraFile, "simple": _SimpleFile}
    model = models.get(str(data.get("kind")))
    if model is None:
        raise CalibrationFileError(f"{path}: kind is {data.get('kind')!r}, expected 'camera' or 'simple'")
    try:
        file = model.model_validate(data)
    except ValidationError as error:
        raise CalibrationFileError("; ".join(f"{path}: {line}" for line in describe(error, model))) from error
    if file.hash is not None and file.hash != content_hash(data):
        raise CalibrationFileError(
            f"{path}: its hash is {file.hash}, its content gives {content_hash(data)}: it was changed after it was "
            "written. Restore it, calibrate again, or remove the line `hash` if the change was meant"
        )
    try:
        return _calibration(file)
    except CalibrationError as error:
        raise CalibrationFileError(f"{path}: {error}") from error


def save_calibration(path: Path, calibration: Calibration) -> None:
    """Write a calibration with its hash. The old file is there until the new one is on the disk, whole."""
    data = _data(calibration)
    data["hash"] = content_hash(data)
    text = yaml.safe_dump(data, sort_keys=False, default_flow_style=None, width=100)
    try:
        _replace(path, text)
    except OSError as error:
        raise CalibrationFileError(f"{path}: cannot be written: {error.strerror}. The old file is unchanged") from error


def calibration_hash(path: Path) -> str:
    """The hash of a file's content, whether it states one or not; raise CalibrationFileError."""
    return content_hash(_read(path))


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


def _calibration(file: _CameraFile | _SimpleFile) -> Calibration:
    alignment = None if file.alignment is None else Alignment(**file.alignment.model_dump())
    stated_mm = None if file.uncertainty is None else file.uncertainty.plane_mm
    if isinstance(file, _SimpleFile):
        return SimpleCalibration(
            image_width=file.image_width,
            image_height=file.image_height,
            mm_per_pixel=file.mm_per_pixel,
            origin_px=file.origin_px,
            plane_height_mm=file.plane_height_mm,
            rotation_deg=file.rotation_deg,
            alignment=alignment,
            stated_uncertainty_mm=stated_mm,
        )
    return CameraCalibration(
        image_width=file.image_width,
        image_height=file.image_height,
        camera_matrix=_array(file.camera_matrix),
        distortion_coefficients=_array(file.distortion_coefficients),
        rotation_vector=np.array(file.work_plane.rotation_vector),
        translation_mm=np.array(file.work_plane.translation_mm),
        camera_name=file.camera_name,
        alignment=alignment,
        stated_uncertainty_mm=stated_mm,
    )


def _array(matrix: _Matrix) -> np.ndarray[Any, np.dtype[np.float64]]:
    return np.array(matrix.data, dtype=np.float64).reshape(matrix.rows, matrix.cols)


def _data(calibration: Calibration) -> dict[str, Any]:
    data: dict[str, Any] = {"version": VERSION}
    size = {"image_width": calibration.image_width, "image_height": calibration.image_height}
    if isinstance(calibration, CameraCalibration):
        coefficients = calibration.distortion_coefficients.ravel().tolist()
        data |= {
            "kind": "camera",
            **size,
            "camera_name": calibration.camera_name,
            "distortion_model": "plumb_bob" if len(coefficients) <= 5 else "rational_polynomial",
            "camera_matrix": {"rows": 3, "cols": 3, "data": calibration.camera_matrix.ravel().tolist()},
            "distortion_coefficients": {"rows": 1, "cols": len(coefficients), "data": coefficients},
            "work_plane": {
                "rotation_vector": calibration.rotation_vector.tolist(),
                "translation_mm": calibration.translation_mm.tolist(),
            },
        }
    elif isinstance(calibration, SimpleCalibration):
        data |= {
            "kind": "simple",
            **size,
            "mm_per_pixel": float(calibration.mm_per_pixel),
            "plane_height_mm": float(calibration.plane_height_mm),
            "origin_px": [float(value) for value in calibration.origin_px],
            "rotation_deg": float(calibration.rotation_deg),
        }
    else:
        raise TypeError(f"no file form for {type(calibration).__name__}")
    alignment = calibration.alignment
    if alignment is not None:
        data["alignment"] = {
            "rotation_deg": float(alignment.rotation_deg),
            "translation_mm": [float(value) for value in alignment.translation_mm],
        }
    if calibration.stated_uncertainty_mm is not None:
        data["uncertainty"] = {"plane_mm": float(calibration.stated_uncertainty_mm)}
    return data


def _replace(path: Path, text: str) -> None:
    """Put `text` into `path` in one step: whoever reads, and whatever fails, finds the old file or the new one."""
    path = path.resolve()  # a link stays a link
    handle, name = tempfile.mkstemp(prefix=f".{path.name}-", dir=path.parent)
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        Path(name).chmod(0o644)
        Path(name).replace(path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
    folder = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)
