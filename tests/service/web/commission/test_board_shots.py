"""Each picture of the board has its verdict, as `combtrace calibrate` would judge it, and all together their score."""

from __future__ import annotations

import os
from pathlib import Path

import cv2
import numpy as np
import pytest

from contour.synthetic.board_poses import board_poses
from drivers.camera import Frame
from service.web.commission.board_shots import BoardShots, board_of
from service.web.commission.models import BoardRequest
from service.web.commission.session import Session, StepRefused
from tests.support.pictures.board_scenes import CHARUCO, SMALL, picture

BOARD = BoardRequest(squares_x=11, squares_y=8, square_mm=30.0, marker_mm=21.0)


def go_on() -> None:
    """Somebody wants to know."""


@pytest.fixture(scope="module")
def views() -> list[np.ndarray]:
    """The board flat on the table, and held twice."""
    poses = board_poses(CHARUCO, SMALL, 3, np.random.default_rng(4))
    return [picture(CHARUCO, SMALL, pose, number) for number, pose in enumerate(poses)]


@pytest.fixture
def session(tmp_path: Path, views: list[np.ndarray]) -> Session:
    """With these pictures, the first one flat."""
    session = Session(tmp_path / "commission")
    session.notes.board = BOARD
    for number, view in enumerate(views):
        session.add(Frame(view, 0.0, True, "drawn", 1), flat=number == 0)
    return session


def test_pictures_that_serve_tell_their_corners_and_what_is_still_missing(session: Session) -> None:
    judged = BoardShots(session).judged(go_on)
    assert [shot.serves for shot in judged.shots] == [True] * 3
    assert min(shot.corners for shot in judged.shots) > 20
    assert judged.so_far is not None
    assert "3 can be used, 8 or more are needed" in str(judged.so_far.fault)
    assert not judged.sound
    assert sum(map(sum, judged.zones)) == sum(shot.corners for shot in judged.shots)
    assert 0 < judged.score < 80


def test_each_picture_that_does_not_serve_says_why(session: Session, views: list[np.ndarray]) -> None:
    spoilt = {
        4: (b"\x89PNG\r\n\x1a\n", "whole"),
        5: (
            cv2.imencode(".png", np.full(views[0].shape, 90, np.uint8))[1].tobytes(),
            "no marker of DICT_5X5_250 is seen",
        ),
        6: (cv2.imencode(".png", views[0][:-40])[1].tobytes(), "it is 960 x 680 px, the flat view 960 x 720"),
        7: (cv2.imencode(".png", views[1])[1].tobytes(), "a duplicate: it shows the board where view-002.png shows it"),
    }
    for number, (data, _) in spoilt.items():
        (session.folder / f"view-{number:03d}.png").write_bytes(data)
    told = {shot.number: shot for shot in BoardShots(session).judged(go_on).shots}
    for number, (_, why) in spoilt.items():
        assert why in str(told[number].why), told[number]
        assert not told[number].serves
    assert told[2].serves


def test_another_picture_by_the_same_name_is_looked_at_anew(session: Session, views: list[np.ndarray]) -> None:
    shots, path = BoardShots(session), session.shots[1].path
    cv2.imwrite(str(path), np.full(views[0].shape, 90, np.uint8))
    assert not shots.judged(go_on).shots[1].serves
    path.unlink()
    cv2.imwrite(str(path), views[1])
    os.utime(path, ns=(1, 1))  # a coarse clock gives both the same time
    assert shots.judged(go_on).shots[1].serves


def test_another_board_has_all_pictures_looked_at_anew(session: Session) -> None:
    shots = BoardShots(session)
    assert shots.judged(go_on).shots[0].serves
    session.notes.board = BoardRequest(squares_x=9, squares_y=6, square_mm=30.0, marker_mm=21.0)
    told = shots.judged(go_on).shots[0]
    assert "another board, or --squares is wrong" in str(told.why)
    assert told.corners == 0


def test_without_a_board_nothing_is_judged(session: Session) -> None:
    session.notes.board = None
    judged = BoardShots(session).judged(go_on)
    assert [(shot.serves, shot.why) for shot in judged.shots] == [(False, None)] * 3
    assert judged.score == 0


def test_a_board_that_cannot_be_is_refused_with_the_reason() -> None:
    with pytest.raises(StepRefused, match="both counts are even"):
        board_of(BoardRequest(kind="chessboard", squares_x=10, squares_y=8, square_mm=30.0))


def test_looking_ends_where_nobody_wants_to_know(session: Session) -> None:
    def stop() -> None:
        raise StepRefused("the service is being stopped")

    with pytest.raises(StepRefused):
        BoardShots(session).judged(stop)
