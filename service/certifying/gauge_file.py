"""A gauge's file: what it is, and its calibrated lengths. A file that cannot be trusted is refused."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from math import hypot
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError, model_validator

from contour.camera_calibration.board import DEFAULT_DICTIONARY, Board, Kind, described_board
from contour.errors import ParameterError
from contour.length_test.plate import FEWEST_IN_LINE, CornerPair
from contour.length_test.verdict import KnownLength
from service.config.config_file import ConfigError, line_of, read_yaml, seen_instead_of_keys
from service.config.mistakes import describe
from service.config.values import MistakeAt, Model, Number

UNITS = {10.0: "centimetres", 25.4: "inches", 1000.0: "metres", 0.001: "micrometres"}

_UNIT_SHARE = 0.05
_SQUARE_SHARE = 0.02
"""A board's squares are printed or engraved to better than this; farther off, the corners or the number are wrong."""

_TOLD_APART = 0.05
"""A block's two lengths are told from each other by the longer one: nearer they might be taken for each other."""

Millimetres = Annotated[Number, Field(gt=0, le=10_000)]
Uncertain = Annotated[Number, Field(ge=0, le=10)]
Name = Annotated[str, Field(min_length=1, max_length=40)]
Corner = tuple[Annotated[int, Field(ge=1)], Annotated[int, Field(ge=1)]]


class GaugeFileError(Exception):
    """A gauge file cannot be used: the file, what was seen, what is expected."""


class LengthEntry(Model):
    """A calibrated length, its expanded uncertainty with k = 2."""

    name: Name
    length_mm: Millimetres
    uncertainty_mm: Uncertain


class CornersEntry(LengthEntry):
    """A length between two inner corners: column and row from the lower left, the first is 1."""

    between: tuple[Corner, Corner]


class BoardEntry(Model):
    """The board on the plate. `square_mm` is its nominal size: lengths are those that were calibrated."""

    kind: Kind = "charuco"
    squares: tuple[Annotated[int, Field(ge=3, le=100)], Annotated[int, Field(ge=3, le=100)]]
    square_mm: Millimetres
    marker_mm: Millimetres | None = None
    dictionary: str = DEFAULT_DICTIONARY

    def board(self) -> Board:
        """The board as it is searched for; raise ParameterError."""
        dictionary = self.dictionary if self.kind == "charuco" else None
        return described_board(self.kind, self.squares, self.square_mm, self.marker_mm, dictionary)


class GaugeFile(Model):
    """What all gauges have. Uncertainties are expanded, k = 2.

    `height_mm` is of its measured plane above the table; `form_mm` bounds how far its own lines are from straight.
    """

    version: Literal[1]
    id: Name
    calibrated_by: Annotated[str, Field(min_length=1, max_length=200)]
    calibrated_on: date
    height_mm: Annotated[Number, Field(ge=0, le=1000)]
    height_uncertainty_mm: Uncertain
    form_mm: Uncertain
    expansion_um_per_m_k: Annotated[Number, Field(ge=0, le=200)]
    reference_temperature_c: Annotated[Number, Field(ge=0, le=50)] = 20.0


class PlateFile(GaugeFile):
    """A plate or bar with a board on it."""

    kind: Literal["plate"]
    board: BoardEntry
    lengths: Annotated[tuple[CornersEntry, ...], Field(min_length=2, max_length=40)]

    @model_validator(mode="after")
    def _like_its_board(self) -> PlateFile:
        try:
            board = self.board.board()
        except ParameterError as error:
            raise MistakeAt(("board",), str(error)) from error
        if max(board.columns, board.rows) < FEWEST_IN_LINE:
            raise MistakeAt(
                ("board", "squares"),
                f"are {board.name_of_size}: expected {FEWEST_IN_LINE + 1} or more one way, to show a line's form",
            )
        _check_names(self.lengths)
        for number, entry in enumerate(self.lengths):
            _check_corners(board, number, entry)
        return self

    def nominal_mm(self) -> tuple[float, ...]:
        """What its lengths would be by the nominal size of the squares."""
        square = self.board.square_mm
        return tuple(square * hypot(a - c, b - d) for (a, b), (c, d) in (entry.between for entry in self.lengths))

    def pairs(self) -> tuple[CornerPair, ...]:
        """Its lengths' ends."""
        return tuple(CornerPair(entry.name, *entry.between) for entry in self.lengths)


class BlockFile(GaugeFile):
    """A rectangular block of two lengths, between its opposite sides."""

    kind: Literal["block"]
    lengths: Annotated[tuple[LengthEntry, LengthEntry], Field()]

    @model_validator(mode="after")
    def _told_apart(self) -> BlockFile:
        _check_names(self.lengths)
        longer, shorter = self.lengths
        if longer.length_mm < shorter.length_mm * (1 + _TOLD_APART):
            raise MistakeAt(
                ("lengths",),
                f"are {longer.length_mm:g} and {shorter.length_mm:g} mm, expected the longer one first and "
                f"{100 * _TOLD_APART:g} % or more between them, so that a picture tells them apart",
            )
        return self


AnyGauge = PlateFile | BlockFile
KINDS: dict[str, type[PlateFile] | type[BlockFile]] = {"plate": PlateFile, "block": BlockFile}


@dataclass(frozen=True)
class Gauge:
    """A gauge with the hash of its file."""

    file: AnyGauge
    digest: str

    @property
    def known(self) -> tuple[KnownLength, ...]:
        """Its calibrated lengths."""
        return tuple(KnownLength(one.name, one.length_mm, one.uncertainty_mm) for one in self.file.lengths)


def read_gauge(path: Path) -> Gauge:
    """The gauge of a YAML or JSON file; raise GaugeFileError."""
    try:
        data = read_yaml(path, "--gauge")
    except ConfigError as error:
        raise GaugeFileError(str(error)) from error
    if not isinstance(data, dict):
        raise GaugeFileError(f"{path}: {seen_instead_of_keys(data)}, expected kind: plate or block, id, lengths, …")
    model = KINDS.get(str(data.get("kind")))
    if model is None:
        raise GaugeFileError(f"{path}: kind is {data.get('kind')!r}, expected {' or '.join(KINDS)}")
    try:
        file = model.model_validate(data)
    except ValidationError as error:
        told = describe(error, model, lambda where: line_of(path, where))
        raise GaugeFileError("\n".join(f"{path}: {line}" for line in told)) from error
    return Gauge(file, f"sha256:{hashlib.sha256(path.read_bytes()).hexdigest()}")


def _check_names(lengths: Sequence[LengthEntry]) -> None:
    names = [entry.name for entry in lengths]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise MistakeAt(("lengths",), f"two are named {twice!r}, expected a name for each")


def _check_corners(board: Board, number: int, entry: CornersEntry) -> None:
    """Raise MistakeAt where a corner is not on the board, or the length not what its squares make."""
    for corner in entry.between:
        if corner[0] > board.columns or corner[1] > board.rows:
            raise MistakeAt(
                ("lengths", number, "between"),
                f"corner {list(corner)} is not on a board of {board.name_of_size} squares, expected columns 1 to "
                f"{board.columns} and rows 1 to {board.rows} of inner corners",
            )
    (a, b), (c, d) = entry.between
    nominal = board.square_mm * hypot(c - a, d - b)
    if not nominal:
        raise MistakeAt(("lengths", number, "between"), "both ends are one corner, expected two")
    if abs(entry.length_mm / nominal - 1) > _SQUARE_SHARE:
        raise MistakeAt(
            ("lengths", number, "length_mm"),
            f"is {entry.length_mm:g}, expected about {nominal:g} mm between those corners by squares of "
            f"{board.square_mm:g} mm{_unit_doubt(nominal / entry.length_mm)}",
        )


def _unit_doubt(ratio: float) -> str:
    unit = next((name for factor, name in UNITS.items() if abs(ratio / factor - 1) < _UNIT_SHARE), None)
    return "" if unit is None else f". It looks like {unit}: give millimetres"


def fields(gauge: Gauge) -> dict[str, Any]:
    """What a certificate says of it."""
    return {**gauge.file.model_dump(mode="json"), "file_hash": gauge.digest}
