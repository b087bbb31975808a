"""The trial of the shop floor runs as its command does, and judges by the truth alone."""

import cv2
import numpy as np
import pytest

from benchmarks.accuracy import shop_floor
from benchmarks.accuracy.shop_floor import Verdict, main, report, true_places
from contour.synthetic import Cover, Scene, camera_above, rectangle, render


def test_the_command_tells_every_picture_and_a_row_a_kind(capsys, monkeypatch, tmp_path):
    judged = {
        "undisturbed": Verdict(("undisturbed",), 7, (), 20.0, 0.0, 4.0, 0.6, 0.4, 0.99),
        "tape": Verdict(("tape",), 7, (), 20.0, 55.0, 30.0, 0.6, 0.5, 0.97),
    }
    monkeypatch.setattr(shop_floor, "judged", lambda kind, seed, **_: judged[kind])
    assert main(["--kinds", "undisturbed,tape", "--seeds", "1", "--list", "--save", str(tmp_path / "wrong")]) == 1
    out = capsys.readouterr().out
    assert "tape 7 WRONG - pitch 20.0 px off  1.50 cells" in out
    assert "| undisturbed | 1 | 1 | 0 | 0 | 0 | 0 | 1.50 |" in out
    assert "| tape | 1 | 0 | 0 | 1 | 0 | 0 | 1.20 |" in out
    assert main(["--kinds", "undisturbed", "--seeds", "1"]) == 0
    with pytest.raises(SystemExit):
        main(["--kinds", "tapes"])
    assert "unknown kinds tapes" in capsys.readouterr().err


def test_refusals_are_counted_by_code_and_two_kinds_apart_by_whether_the_edge_is_seen():
    refused = Verdict(("tape",), 1, (113, 117), 20.0, 40.0, 30.0, 0.5, 1.0, 0.2)
    seen = Verdict(("dust", "gamma"), 2, (), 20.0, 0.0, 2.0, 0.5, 1.0, 0.2)
    hidden = Verdict(("dust", "tape"), 3, (), 20.0, 60.0, 2.0, 0.5, 0.4, 0.99)
    text = report([refused, seen, hidden], range(1, 4))
    assert "| tape | 1 | 0 | 0 | 0 | 1 by 113 | 0 | – |" in text
    assert "| two at once, edge seen | 1 | 1 | 0 | 0 | 0 | 1 | 0.50 |" in text
    assert "| two at once, edge hidden | 1 | 1 | 1 | 0 | 0 | 0 | 1.25 |" in text


def test_an_undisturbed_block_is_right_and_what_a_tape_hides_is_told(tmp_path):
    right = shop_floor.judged("undisturbed", 7)
    assert (right.codes, right.wrong, right.hidden_px) == ((), False, 0.0)
    assert right.off_px is not None
    assert 0.0 < right.off_px < 0.5 * right.pitch_px
    assert shop_floor.judged("tape", 7, alone=True, save=tmp_path).hidden_px > 5.0


def test_a_block_on_wood_is_right_where_the_table_was_taught():
    taught = shop_floor.judged("wood", 968_007, alone=True, taught=True)
    assert taught.accepted
    assert not taught.wrong


def test_places_under_a_cover_are_not_visible_and_drawn_apart():
    camera = camera_above(200, 150, 1.0, plane_mm=0.0)
    tape = Cover(rectangle((100.0, 120.0), 30.0, 20.0), 0.9)
    rendered = render(Scene(rectangle((100.0, 75.0), 120.0, 90.0), camera, thickness_mm=0.0, things=(tape,)))
    places, clear = true_places(rendered)
    assert len(places) == pytest.approx(2 * (120 + 90), abs=3)
    assert 29 <= np.count_nonzero(~clear) <= 36
    drawn = shop_floor.overlay(rendered, None)
    assert (drawn == shop_floor.HIDDEN).all(axis=2).any()
    assert (drawn == shop_floor.TRUE).all(axis=2).any()
    assert cv2.cvtColor(drawn, cv2.COLOR_BGR2GRAY).shape == rendered.picture.shape
