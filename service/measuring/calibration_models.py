"""What a calibration file may say, key by key, and the calibration it stands for. Unknown keys are refused."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AwareDatetime, BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from contour.calibration.calibration import Alignment, Calibration, CameraCalibration, SimpleCalibration
from contour.calibration.fixed_marks import Mark, Sentinels
from contour.calibration.plane_calibration import PlaneCalibration
from contour.calibration.position_uncertainty import PositionUncertainty
from service.config.values import Number, no_truth_value

VERSION = 1
Size = Annotated[int, BeforeValidator(no_truth_value), Field(ge=1, le=100_000)]
Count = Annotated[int, BeforeValidator(no_truth_value), Field(ge=0)]
Array = np.ndarray[Any, np.dtype[np.float64]]


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class MatrixEntry(_Model):
    """A matrix as ROS writes it: rows, cols, data in row order."""

    rows: int
    cols: int
    data: list[Number]

    @model_validator(mode="after")
    def _complete(self) -> MatrixEntry:
        if len(self.data) != self.rows * self.cols:
            raise ValueError(f"data has {len(self.data)} numbers, expected rows x cols = {self.rows * self.cols}")
        return self

    def array(self) -> Array:
        """The matrix, shape (rows, cols), float64."""
        return np.array(self.data, dtype=np.float64).reshape(self.rows, self.cols)


class PlaneEntry(_Model):
    """The work frame before the camera, OpenCV's convention."""

    rotation_vector: tuple[Number, Number, Number]
    translation_mm: tuple[Number, Number, Number]


class AlignmentEntry(_Model):
    """The machine frame: R(rotation) · work + translation."""

    rotation_deg: Number = 0.0
    translation_mm: tuple[Number, Number] = (0.0, 0.0)


class UncertaintyPlane(_Model):
    """95 % bounds on positions at one height: one for the covered part, and a map over the whole picture."""

    height_mm: Number
    figure_mm: Annotated[Number, Field(ge=0)]
    map: MatrixEntry


class UncertaintyEntry(_Model):
    """How sure positions are, 95 %: one figure for everywhere, or maps, plane by plane from the lowest.

    A contour that leaves the ring `covered_px` is refused; without it none is for that.
    """

    plane_mm: Annotated[Number, Field(ge=0)] | None = None
    planes: tuple[UncertaintyPlane, ...] = ()
    covered_px: Annotated[tuple[tuple[Number, Number], ...], Field(min_length=3)] | None = None

    @model_validator(mode="after")
    def _alike(self) -> UncertaintyEntry:
        if (self.plane_mm is None) == (not self.planes):
            raise ValueError("expected either plane_mm or planes")
        if len({(plane.map.rows, plane.map.cols) for plane in self.planes}) > 1:
            raise ValueError("the maps have different sizes, expected one size")
        return self


class MarkEntry(_Model):
    """One fixed mark, as the calibration saw it."""

    id: Count
    corners_px: tuple[tuple[Number, Number], tuple[Number, Number], tuple[Number, Number], tuple[Number, Number]]


class SentinelsEntry(_Model):
    """The fixed marks beside the table."""

    dictionary: str
    marks: Annotated[tuple[MarkEntry, ...], Field(min_length=1)]


class FileModel(_Model):
    """What all forms share."""

    version: Literal[1]
    image_width: Size
    image_height: Size
    camera_name: str = ""
    created: AwareDatetime | None = None
    alignment: AlignmentEntry | None = None
    uncertainty: UncertaintyEntry | None = None
    sentinels: SentinelsEntry | None = None
    made: dict[str, str | Number | None] = Field(default_factory=dict)
    hash: str | None = None


class CameraFile(FileModel):
    """A camera with its lens, and where the table lies before it."""

    kind: Literal["camera"]
    distortion_model: Literal["plumb_bob", "rational_polynomial"] = "plumb_bob"
    camera_matrix: MatrixEntry
    distortion_coefficients: MatrixEntry
    work_plane: PlaneEntry


class PlaneFile(FileModel):
    """A homography to one plane."""

    kind: Literal["plane"]
    homography: MatrixEntry
    plane_height_mm: Number = 0.0


class SimpleFile(FileModel):
    """One scale for the whole picture."""

    kind: Literal["simple"]
    mm_per_pixel: Annotated[Number, Field(gt=0)]
    plane_height_mm: Number = 0.0
    origin_px: tuple[Number, Number] = (0.0, 0.0)
    rotation_deg: Number = 0.0


AnyFile = CameraFile | PlaneFile | SimpleFile
MODELS: dict[str, type[CameraFile] | type[PlaneFile] | type[SimpleFile]] = {
    "camera": CameraFile,
    "simple": SimpleFile,
    "plane": PlaneFile,
}


def calibration_of(file: AnyFile) -> Calibration:
    """The calibration that a file stands for; raise CalibrationError."""
    alignment = None if file.alignment is None else Alignment(**file.alignment.model_dump())
    sure = _uncertainty(file)
    if isinstance(file, SimpleFile):
        return SimpleCalibration(
            image_width=file.image_width,
            image_height=file.image_height,
            mm_per_pixel=file.mm_per_pixel,
            origin_px=file.origin_px,
            plane_height_mm=file.plane_height_mm,
            rotation_deg=file.rotation_deg,
            alignment=alignment,
            uncertainty=sure,
        )
    if isinstance(file, PlaneFile):
        return PlaneCalibration(
            file.image_width, file.image_height, file.homography.array(), file.plane_height_mm, alignment, sure
        )
    return CameraCalibration(
        image_width=file.image_width,
        image_height=file.image_height,
        camera_matrix=file.camera_matrix.array(),
        distortion_coefficients=file.distortion_coefficients.array(),
        rotation_vector=np.array(file.work_plane.rotation_vector),
        translation_mm=np.array(file.work_plane.translation_mm),
        camera_name=file.camera_name,
        alignment=alignment,
        uncertainty=sure,
    )


def sentinels_of(file: AnyFile) -> Sentinels | None:
    """The fixed marks of a file; raise CalibrationError."""
    if file.sentinels is None:
        return None
    marks = tuple(Mark(mark.id, np.array(mark.corners_px)) for mark in file.sentinels.marks)
    return Sentinels(file.sentinels.dictionary, marks)


def _uncertainty(file: AnyFile) -> PositionUncertainty | None:
    if file.uncertainty is None:
        return None
    planes = file.uncertainty.planes
    covered = None if file.uncertainty.covered_px is None else np.array(file.uncertainty.covered_px)
    if file.uncertainty.plane_mm is not None:
        everywhere = PositionUncertainty.everywhere(file.image_width, file.image_height, file.uncertainty.plane_mm)
        return replace(everywhere, covered_px=covered)
    return PositionUncertainty(
        file.image_width,
        file.image_height,
        np.array([plane.height_mm for plane in planes]),
        np.array([plane.figure_mm for plane in planes]),
        np.stack([plane.map.array() for plane in planes]),
        covered,
    )


def data_of(
    calibration: Calibration,
    *,
    camera_name: str,
    created: datetime | None,
    sentinels: Sentinels | None,
    made: dict[str, str | float | None],
) -> dict[str, Any]:
    """The keys and values of a file, all but its hash."""
    data: dict[str, Any] = {"version": VERSION, "kind": _kind(calibration)}
    data |= {"image_width": calibration.image_width, "image_height": calibration.image_height}
    if camera_name or isinstance(calibration, CameraCalibration):
        data["camera_name"] = camera_name
    if created is not None:
        data["created"] = created.isoformat(timespec="seconds")
    data |= _geometry(calibration)
    if calibration.alignment is not None:
        alignment = calibration.alignment
        translation = [float(value) for value in alignment.translation_mm]
        data["alignment"] = {"rotation_deg": float(alignment.rotation_deg), "translation_mm": translation}
    if calibration.uncertainty is not None:
        data["uncertainty"] = _uncertainty_data(calibration.uncertainty)
    if sentinels is not None:
        marks = [{"id": int(mark.id), "corners_px": mark.corners_px.round(3).tolist()} for mark in sentinels.marks]
        data["sentinels"] = {"dictionary": sentinels.dictionary, "marks": marks}
    if made:
        data["made"] = dict(made)
    return data


def _kind(calibration: Calibration) -> str:
    kinds = {CameraCalibration: "camera", SimpleCalibration: "simple", PlaneCalibration: "plane"}
    kind = kinds.get(type(calibration))
    if kind is None:
        raise TypeError(f"no file form for {type(calibration).__name__}")
    return kind


def _geometry(calibration: Calibration) -> dict[str, Any]:
    if isinstance(calibration, CameraCalibration):
        coefficients = calibration.distortion_coefficients.ravel().tolist()
        return {
            "distortion_model": "plumb_bob" if len(coefficients) <= 5 else "rational_polynomial",
            "camera_matrix": _matrix_data(calibration.camera_matrix),
            "distortion_coefficients": {"rows": 1, "cols": len(coefficients), "data": coefficients},
            "work_plane": {
                "rotation_vector": calibration.rotation_vector.tolist(),
                "translation_mm": calibration.translation_mm.tolist(),
            },
        }
    if isinstance(calibration, PlaneCalibration):
        height_mm = float(calibration.plane_height_mm)
        return {"homography": _matrix_data(calibration.homography), "plane_height_mm": height_mm}
    assert isinstance(calibration, SimpleCalibration)
    return {
        "mm_per_pixel": float(calibration.mm_per_pixel),
        "plane_height_mm": float(calibration.plane_height_mm),
        "origin_px": [float(value) for value in calibration.origin_px],
        "rotation_deg": float(calibration.rotation_deg),
    }


def _matrix_data(matrix: Array) -> dict[str, Any]:
    rows, cols = matrix.shape
    return {"rows": rows, "cols": cols, "data": matrix.ravel().tolist()}


def _uncertainty_data(sure: PositionUncertainty) -> dict[str, Any]:
    covered = {} if sure.covered_px is None else {"covered_px": sure.covered_px.round(1).tolist()}
    if sure.map_mm.shape[0] == 1 and (sure.map_mm == sure.figures_mm[0]).all():
        return {"plane_mm": float(sure.figures_mm[0]), **covered}
    planes = zip(sure.heights_mm, sure.figures_mm, sure.map_mm, strict=True)
    return {
        "planes": [
            {"height_mm": float(height), "figure_mm": round(float(figure), 5), "map": _matrix_data(plane.round(5))}
            for height, figure, plane in planes
        ],
        **covered,
    }
