"""True outlines beside pictures: NAME.json holds `outer`, `holes` and `edge` of the picture NAME."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from contour.geometry.rings import Contour, contour_defect
from drivers.camera.files.folder import shown
from service.atomic_file import write_whole
from service.measuring.master_file import ring_of

LARGEST_FILE = 10_000_000
SUFFIX = ".json"
DECIMALS = 2  # of a pixel, in what is saved: nobody draws finer
EDGES = ("cut", "cells", "mixed")
DRAW = "Draw it: combtrace judge --annotate FOLDER"


class TruthFileError(Exception):
    """A true outline cannot be used: the file, what was seen, what is expected, what to do."""


@dataclass(frozen=True)
class Truth:
    """The true outline in pixels, and how its border runs: cut through cells, closed cells, or both; None: not told."""

    outline: Contour
    edge: str | None = None


def truth_path(image: Path) -> Path:
    """Where the picture's true outline lies."""
    return image.with_suffix(SUFFIX)


def read_truth(path: Path) -> Truth:
    """The truth in a file, its rings fit to be compared; raise TruthFileError."""
    truth = parsed_truth(read_object(path), path)
    defect = contour_defect(truth.outline)
    if defect:
        raise TruthFileError(f"{path}: is no outline of a block: {defect}. {DRAW}")
    return truth


def save_truth(image: Path, truth: Truth) -> None:
    """Put the truth beside its picture in one step, and keep what else stands there; raise TruthFileError."""
    path = truth_path(image)
    outer, *holes = (ring.round(DECIMALS) for ring in truth.outline.rings)
    defect = contour_defect(Contour(outer, tuple(holes)))
    if defect:
        raise TruthFileError(f"not saved: {defect}. Move the vertices there")
    data = read_object(path) if path.exists() else {"image": shown(image.name)}
    data |= {"outer": outer.tolist(), "holes": [hole.tolist() for hole in holes], "edge": truth.edge}
    try:
        write_whole(path, (json.dumps(data, ensure_ascii=False) + "\n").encode())
    except OSError as error:
        raise TruthFileError(f"{path}: cannot be written: {error.strerror}. Check the folder's permissions") from error


def parsed_truth(data: dict[str, Any], path: Path) -> Truth:
    """The truth in a file's object, whatever way its rings run; other keys do not count. Raise TruthFileError."""
    if "outer" not in data:
        raise TruthFileError(f"{path}: has no key outer, expected a ring of [x, y] in pixels. {DRAW}")
    try:
        outline = Contour(ring_of(data["outer"]), tuple(ring_of(hole) for hole in data.get("holes") or ()))
    except (TypeError, ValueError) as error:
        raise TruthFileError(f"{path}: a ring is {error}, expected three or more points [x, y]. {DRAW}") from error
    edge = data.get("edge")
    if edge is not None and edge not in EDGES:
        raise TruthFileError(f"{path}: edge is {edge!r}, expected {', '.join(EDGES)}. Correct it")
    return Truth(outline, edge)


def read_object(path: Path) -> dict[str, Any]:
    """The JSON object in a file; raise TruthFileError."""
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise TruthFileError(f"{path}: {path.stat().st_size} bytes, expected {LARGEST_FILE} at most. {DRAW}")
        data = json.loads(path.read_text(encoding="utf-8-sig"))
    except FileNotFoundError as error:
        raise TruthFileError(f"{path}: is not there, expected the picture's true outline. {DRAW}") from error
    except OSError as error:
        raise TruthFileError(f"{path}: cannot be read: {error.strerror}. Check its permissions") from error
    except (UnicodeDecodeError, ValueError, RecursionError) as error:
        raise TruthFileError(f"{path}: is no JSON: {error}. Move it away, and draw it anew") from error
    if not isinstance(data, dict):
        raise TruthFileError(f"{path}: holds no object, expected the keys outer, holes and edge. {DRAW}")
    return data
