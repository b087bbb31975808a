"""Each reason that a picture is refused for, provoked through the whole daemon: in register, log and FAIL line."""

from __future__ import annotations

import select
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from pymodbus.client import ModbusTcpClient

from contour.calibration.fixed_marks import see_sentinels
from service.measuring.calibration_file import load_record, save_record
from service.reasons import Reason
from tests.support.processes.cell import SAMPLES, Cell
from tests.support.processes.processes import combtrace, until
from tests.support.processes.terminal import Terminal

SERVICE_BLOCK, SERVICE_STATE, REJECT_REASON, SETTLED_JOB = 16, 1, 5, 12
ERROR = 3
SAMPLE = cv2.imread(str(SAMPLES / "1-rectangle.jpg"), cv2.IMREAD_GRAYSCALE)


def shifted(x: float, y: float) -> np.ndarray:
    """The sample's picture with everything moved by so many pixels."""
    move = np.array([[1.0, 0.0, x], [0.0, 1.0, y]])
    return cv2.warpAffine(SAMPLE, move, (1600, 1200), borderMode=cv2.BORDER_REPLICATE)


def two_blocks() -> np.ndarray:
    """The sample's block twice, smaller, both within the work area."""
    small = cv2.resize(SAMPLE, (640, 480), interpolation=cv2.INTER_AREA)
    picture = np.full_like(SAMPLE, int(np.median(small[:, :20])))
    picture[360:840, 160:1440] = np.concatenate([small, small], axis=1)
    return picture


def empty_table() -> np.ndarray:
    rng = np.random.default_rng(3)
    return np.clip(rng.normal(35, 2, (1200, 1600)), 0, 255).astype(np.uint8)


@dataclass(frozen=True)
class Provoked:
    """A picture, the recipe it is measured by, and the reason that must come of it."""

    picture: np.ndarray
    recipe: str
    code: int
    name: str
    words: str


CASES = (
    Provoked(cv2.GaussianBlur(SAMPLE, (0, 0), 5.0), "", 102, "image_quality", "blurred by"),
    Provoked(np.zeros_like(SAMPLE), "", 102, "image_quality", "brightest parts reach"),
    Provoked(empty_table(), "", 110, "no_block_found", "no block found"),
    Provoked(shifted(-400, 0), "", 111, "touches_border", "left edge"),
    Provoked(SAMPLE, "roi_px: [500, 0, 1599, 1199]", 111, "touches_border", "region of interest"),
    Provoked(SAMPLE, "min_area_mm2: 90000", 112, "area_out_of_limits", "expects 90000 to"),
    Provoked(
        SAMPLE,
        "method: sliding-matrix, parameters: {core_px: 80, threshold: 30}",
        113,
        "methods_disagree",
        "cells, 2 are",
    ),
    Provoked(SAMPLE, "max_uncertainty_mm: 0.05", 114, "uncertainty_too_large", "mm only (picture 0."),
    Provoked(SAMPLE, "method: sliding-matrix, max_uncertainty_mm: 0.5", 114, "uncertainty_too_large", "0.5 mm"),
    Provoked(shifted(90, 0), "", 115, "outside_work_area", "leaves the work area"),
    Provoked(two_blocks(), "", 116, "several_blocks", "Beside the traced block"),
    Provoked(SAMPLE, "max_vertices: 3", 130, "too_many_points", "the recipe allows 3"),
    Provoked(
        SAMPLE,
        "method: find-contours, max_disagreement_pitches: 0, max_vertices: 100000",
        131,
        "self_intersecting",
        "meets itself",
    ),
    Provoked(SAMPLE[:, :1500], "", 141, "calibration_mismatch", "1500 x 1200 px"),
    # No reason of the picture's: nothing that a recipe asks for may end a job without one.
    Provoked(SAMPLE, "roi_px: [1590, 1190, 1599, 1199]", 190, "internal_error", "Correct the recipe"),
)
WORK_AREA = "work_area_mm: [[100, 60], [500, 60], [500, 390], [100, 390]]"


@pytest.fixture(scope="module")
def terminal() -> Iterator[Terminal]:
    opened = Terminal()
    yield opened
    opened.close()


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory, terminal: Terminal) -> Iterator[Cell]:
    folder = tmp_path_factory.mktemp("refusals")
    pictures = folder / "pictures"
    pictures.mkdir()
    for number, case in enumerate(CASES, 1):
        assert cv2.imwrite(str(pictures / f"{number:02d}.png"), case.picture)
    recipes = "".join(
        f"  - {{number: {number}, name: provokes {number}{', ' if case.recipe else ''}{case.recipe}}}\n"
        for number, case in enumerate(CASES, 1)
    )
    started = Cell(
        folder,
        triggers=f"[{{kind: serial, port: {terminal.name}}}]",
        trigger_every_s=None,
        camera=f"{{kind: files, path: {pictures}, loop: true}}",
        more=f"recipes:\n{recipes}{WORK_AREA}\n",
    )
    try:
        started.ready()
        yield started
    finally:
        started.stop()


def service_block(cell: Cell) -> list[int]:
    """The service block as the controller holds it."""
    with ModbusTcpClient("127.0.0.1", port=cell.port) as client:
        return client.read_holding_registers(SERVICE_BLOCK, count=16, device_id=1).registers


def registers(cell: Cell) -> tuple[int, int]:
    """reject_reason and settled_job as the controller holds them."""
    words = service_block(cell)
    return words[REJECT_REASON], words[SETTLED_JOB] << 16 | words[SETTLED_JOB + 1]


@pytest.mark.parametrize("number", range(1, len(CASES) + 1), ids=lambda number: f"{number}-{CASES[number - 1].name}")
def test_a_reason_is_seen_in_the_fail_line_the_register_and_the_log(
    cell: Cell, terminal: Terminal, number: int
) -> None:
    """The pictures come in the order of the cases: run together, not picked."""
    case = CASES[number - 1]
    terminal.type(f"TRIG recipe={number}\n".encode())
    job = terminal.acknowledged(30)
    assert job == cell.number(number), "the cases before this one must run too: each takes one picture"
    assert terminal.line() == f"FAIL {job} {case.code} {case.name}"
    until(lambda: registers(cell) == (case.code, job), what=f"reject_reason {case.code} of job {job}")
    outcome = Reason(case.code).outcome
    said = f"job {job} {outcome}: {case.code} {case.name}: "
    line = next(line for line in cell.service.text.splitlines() if said in line)
    assert case.words in line
    settled = cell.settled()[-1]
    assert (settled["job_id"], settled["outcome"], settled["reason"]) == (job, outcome, case.code)


def pinged(terminal: Terminal) -> bool:
    """Whether a PING is answered within a second."""
    terminal.type(b"PING\n")
    return bool(select.select([terminal.master], [], [], 1.0)[0])


def test_without_its_calibration_the_daemon_takes_no_job_and_says_why(tmp_path: Path) -> None:
    terminal = Terminal()  # a line of its own: the other daemon listens on the other one
    started = Cell(
        tmp_path,
        triggers=f"[{{kind: serial, port: {terminal.name}}}]",
        trigger_every_s=None,
        calibration=tmp_path / "nowhere.yaml",
    )
    try:
        until(lambda: started.controller.text, what="the controller")
        until(lambda: service_block(started)[SERVICE_STATE] == ERROR, what="service_state Error")
        assert "nowhere.yaml: cannot be read" in started.service.text
        until(lambda: pinged(terminal), what="an answer: what is typed before the line is opened is lost")
        terminal.type(b"TRIG\n")
        assert next(reply for reply in iter(terminal.line, "") if reply != "PONG") == "NAK 121 not_ready"
        assert started.settled() == []
    finally:
        started.stop()
        terminal.close()


def test_a_table_that_was_taught_tells_a_moved_camera_and_other_light(tmp_path: Path) -> None:
    y, x = np.mgrid[:1200, :1600]
    holes = np.hypot((x + 8) % 60 - 30, y % 60 - 30) < 9
    table = np.where(holes, 25, 70) + np.random.default_rng(8).normal(0, 1.5, holes.shape)
    table = np.clip(np.rint(table), 0, 255).astype(np.uint8)
    pictures = tmp_path / "pictures"
    pictures.mkdir()
    cv2.imwrite(str(tmp_path / "empty.png"), table)
    cv2.imwrite(str(pictures / "1.png"), np.roll(table, (7, 4), axis=(0, 1)))
    cv2.imwrite(str(pictures / "2.png"), (table * 0.5).astype(np.uint8))
    cv2.imwrite(str(pictures / "3.png"), table)
    taught = combtrace("teach-table", tmp_path / "empty.png", "--output", tmp_path / "table.npz")
    assert taught.returncode == 0, taught.stderr
    text = text_after(
        tmp_path,
        [(1, 103, "scene_moved"), (2, 102, "image_quality"), (3, 110, "no_block_found")],
        more="table: {file: table.npz}\n",
    )
    assert "pattern has moved by 8." in text


def test_fixed_marks_tell_a_moved_camera(tmp_path: Path) -> None:
    marks = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    picture = SAMPLE.copy()
    for number, (left, top) in enumerate(((20, 20), (1490, 1090))):
        picture[top : top + 90, left : left + 90] = 200
        picture[top + 15 : top + 75, left + 15 : left + 75] = cv2.aruco.generateImageMarker(marks, number, 60)
    sentinels = see_sentinels(picture, "DICT_4X4_50")
    assert sentinels is not None
    assert len(sentinels.marks) == 2
    calibration = load_record(SAMPLES / "calibration.yaml")
    save_record(tmp_path / "marked.yaml", replace(calibration, sentinels=sentinels))
    pictures = tmp_path / "pictures"
    pictures.mkdir()
    cv2.imwrite(str(pictures / "1.png"), picture)
    cv2.imwrite(str(pictures / "2.png"), np.roll(picture, 3, axis=1))
    cv2.imwrite(str(pictures / "3.png"), SAMPLE)
    text = text_after(
        tmp_path,
        [(1, 0, ""), (2, 142, "sentinel_moved"), (3, 142, "sentinel_moved")],
        calibration=tmp_path / "marked.yaml",
    )
    assert "The camera or a mark was moved: " in text
    assert "None of the fixed marks (0, 1) is seen." in text


def text_after(folder: Path, ends: list[tuple[int, int, str]], **options: Any) -> str:
    """The daemon's log after a job for each of the folder's pictures, whose end is told everywhere.

    ends: which job, from 1, code, name; code 0 is an accepted one.
    """
    terminal = Terminal()  # a line of its own: the other daemon listens on the other one
    started = Cell(
        folder,
        triggers=f"[{{kind: serial, port: {terminal.name}}}]",
        trigger_every_s=None,
        camera=f"{{kind: files, path: {folder / 'pictures'}, loop: true}}",
        **options,
    )
    try:
        started.ready()
        for nth, code, name in ends:
            terminal.type(b"TRIG\n")
            job = terminal.acknowledged(30)
            assert job == started.number(nth)
            assert terminal.line().startswith(f"FAIL {job} {code} {name}" if code else f"DONE {job} ")
            until(lambda code=code, job=job: registers(started) == (code, job), what=f"reject_reason {code}")
            said = f"job {job} refused: {code} {name}: "
            until(lambda code=code, said=said: code == 0 or said in started.service.text, what=said)
        return started.service.text
    finally:
        started.stop()
        terminal.close()
