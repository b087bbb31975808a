"""What commissioning has come to outlives whoever works at it, and stays within bounds."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from drivers.camera import Frame
from service.calibrating.alignment import WORK_POINTS
from service.measuring.points_file import read_points
from service.web.commission import session as sessions
from service.web.commission.models import BoardRequest
from service.web.commission.session import MOST_POINTS, MOST_SHOTS, Session, StepRefused


def frame(level: int = 9, *, deep: bool = False) -> Frame:
    pixels = np.full((6, 8), level, np.uint8)
    return Frame(pixels, 0.0, True, "drawn", 1, camera="cam7", deep=pixels.astype(np.uint16) * 256 if deep else None)


@pytest.fixture
def session(tmp_path: Path) -> Session:
    return Session(tmp_path / "commission")


def test_notes_and_pictures_are_there_for_the_next_one(session: Session) -> None:
    session.notes.board = BoardRequest(squares_x=11, squares_y=8, square_mm=24.93)
    session.add(frame(), flat=True)
    session.add(frame(), flat=False)
    again = Session(session.folder)
    assert again.notes == session.notes
    assert again.notes.camera == "cam7"
    assert [(shot.number, shot.flat) for shot in again.shots] == [(1, True), (2, False)]


def test_a_flat_picture_takes_the_place_of_the_one_before(session: Session) -> None:
    for flat in (True, False, True):
        session.add(frame(), flat=flat)
    assert [(shot.number, shot.flat) for shot in session.shots] == [(2, False), (3, True)]
    assert session.flat is not None
    assert session.flat.number == 3


def test_a_picture_is_stored_with_all_that_the_camera_gave(session: Session) -> None:
    from drivers.camera.files.decode import read_samples

    session.add(frame(deep=True), flat=False)
    assert read_samples(session.shots[0].path).dtype == np.uint16


def test_notes_that_cannot_be_read_take_no_picture_with_them(session: Session) -> None:
    session.add(frame(), flat=False)
    (session.folder / "session.json").write_text('{"board": 7')
    again = Session(session.folder)
    assert again.notes.board is None
    assert [shot.number for shot in again.shots] == [1]
    again.add(frame(), flat=False)
    assert [shot.number for shot in again.shots] == [1, 2]


def test_pictures_are_bounded_in_number_and_in_bytes(session: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    for _ in range(MOST_SHOTS):
        session.add(frame(), flat=False)
    with pytest.raises(StepRefused, match=f"{MOST_SHOTS} pictures are kept"):
        session.add(frame(), flat=False)
    session.remove(3)
    monkeypatch.setattr(sessions, "MOST_BYTES", 100)
    with pytest.raises(StepRefused, match="more are not kept"):
        session.add(frame(), flat=False)
    assert len(session.shots) == MOST_SHOTS - 1


@pytest.mark.parametrize(
    "name", ["view-1.png", "flat-1234567.png", "other-001.png", "view-001.jpg", "view-001.png.tmp"]
)
def test_other_files_are_no_pictures_of_the_board(session: Session, name: str) -> None:
    session.folder.mkdir()
    (session.folder / name).write_bytes(b"")
    assert session.shots == []


def test_a_number_never_comes_again(session: Session) -> None:
    for _ in range(2):
        session.add(frame(), flat=False)
    session.remove(2)
    session.add(frame(), flat=False)
    assert [shot.number for shot in Session(session.folder).shots] == [1, 3]


def test_a_picture_that_is_not_there_cannot_be_removed(session: Session) -> None:
    with pytest.raises(StepRefused, match="there is no picture 7"):
        session.remove(7)


def test_points_are_the_file_that_the_command_reads(session: Session) -> None:
    points = [[24.93, 24.93, 1012.4, -33.18], [249.3, 24.93, 1236.55, -29.61]]
    session.keep_points(points)
    layout, table = read_points(session.points_file, [WORK_POINTS])
    assert layout == WORK_POINTS
    assert table.tolist() == points == Session(session.folder).points
    session.keep_points([])
    assert session.points == []
    with pytest.raises(StepRefused, match=f"{MOST_POINTS} points are kept"):
        session.keep_points([[0.0] * 4] * (MOST_POINTS + 1))


def test_points_that_somebody_spoilt_are_told_and_stay(session: Session) -> None:
    session.folder.mkdir()
    session.points_file.write_text("x_mm,y_mm,machine_x_mm,machine_y_mm\n1,2,three,4\n")
    with pytest.raises(StepRefused, match="line 2: machine_x_mm is 'three'"):
        _ = session.points
    assert session.points_file.exists()


def test_a_disk_that_refuses_is_told(tmp_path: Path) -> None:
    (tmp_path / "commission").write_text("a file in the folder's place")
    session = Session(tmp_path / "commission")
    for attempt in (session.save, lambda: session.add(frame(), flat=False), lambda: session.keep_points([[0.0] * 4])):
        with pytest.raises(StepRefused, match="cannot be"):
            attempt()
