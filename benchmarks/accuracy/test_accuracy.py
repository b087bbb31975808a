"""The bench runs as its command does, and its parts tell what happened."""

import dataclasses
import json

import cv2
import numpy as np
import pytest

from benchmarks.accuracy import page as accuracy_page
from benchmarks.accuracy import pictures, report
from benchmarks.accuracy.__main__ import main
from benchmarks.accuracy.goals import goals
from contour.synthetic import camera_above, rectangle, render
from tests.support.scenes.bench_scenes import BenchScene, easy
from tests.support.scenes.metrics import Agreement
from tests.support.scenes.photographs import photographs, run_photograph
from tests.support.scenes.rivals import RIVALS, Hints, RivalFailed
from tests.support.scenes.trials import Trial, available_methods, run_trial

CAMERA = camera_above(480, 360, 0.5, target_mm=(120.0, 90.0))


@pytest.fixture(scope="module")
def small():
    scene = dataclasses.replace(easy("small", rectangle((120.0, 90.0), 150.0, 110.0, 9.0)), camera=CAMERA)
    return BenchScene(scene), render(scene)


def test_the_command_prints_a_row_for_every_method_and_says_what_is_missing(capsys, monkeypatch, tmp_path):
    monkeypatch.setenv("COMBTRACE_PHOTOS", str(tmp_path / "none"))
    assert main(["--scenes", "tuned-blob-easy"]) == 0
    out, err = capsys.readouterr()
    for name in available_methods()[0]:
        assert f"| {name} |" in out
    assert "no photographs in" in err
    for name in available_methods()[1]:
        assert f"skipped: {name}" in err


def test_a_pattern_without_scenes_is_told_and_ends_with_2(capsys):
    assert main(["--scenes", "no such scene", "--no-photographs"]) == 2
    assert "no such scene" in capsys.readouterr().err


@pytest.mark.parametrize("method", [*RIVALS, "sliding-matrix"])
def test_every_method_finds_the_rough_outline_of_an_easy_block(small, method):
    trial = run_trial(*small, method)
    assert trial.failure == ""
    assert trial.agreement.iou > 0.6
    assert trial.milliseconds["trace"] > 0.0


def test_closing_is_within_a_third_of_a_pitch(small):
    trial = run_trial(*small, "closing + findContours")
    assert trial.agreement.mean_px < trial.pitch_px / 3.0


@pytest.mark.parametrize("method", RIVALS)
def test_an_empty_picture_is_a_rivals_failure_not_a_crash(method):
    with pytest.raises(RivalFailed):
        RIVALS[method](np.zeros((120, 160), dtype=np.uint8), Hints(20.0, False))


def test_a_photograph_is_read_with_its_rings_and_measured(small, tmp_path, monkeypatch):
    _, rendered = small
    cv2.imwrite(str(tmp_path / "block.png"), rendered.picture)
    outer = rendered.truth_px.exterior.tolist()
    (tmp_path / "block.json").write_text(
        json.dumps({"image": "block.png", "outer": outer, "holes": [], "polarity": "bright-on-dark", "note": ""})
    )
    monkeypatch.setenv("COMBTRACE_PHOTOS", str(tmp_path))
    found, folder = photographs()
    assert folder == tmp_path
    assert [one.name for one in found] == ["block"]
    assert run_photograph(found[0], "closing + findContours", rendered.pitch_px).agreement.iou > 0.9


def test_a_trial_without_a_contour_is_counted_and_named(small):
    scene, rendered = small
    good = run_trial(scene, rendered, "sliding-matrix")
    lost = Trial(scene.name, "sliding-matrix", rendered.pitch_px, failure="No block found: nothing. Check.")
    assert report.summary([good, lost], [scene]).splitlines()[-1].endswith("| 1 |")
    assert "No block found: nothing" in report.details([lost], "sliding-matrix")
    assert "1 without a contour" in report.random_summary([good, lost], set())


def test_a_hausdorff_distance_above_one_pitch_is_counted():
    far = Trial("random-1", "wall-tips", 20.0, Agreement(1.0, 2.0, 25.0, 0.0, 0.9, 4))
    near = Trial("random-2", "wall-tips", 20.0, Agreement(0.2, 0.4, 5.0, 0.0, 0.9, 4))
    text = report.random_summary([far, near], {"random-1"})
    assert "2 scenes: 0 without a contour, 1 with a Hausdorff distance above one pitch." in text
    assert "random-1 (dim)" in text


def test_the_accuracy_page_is_written_with_its_pictures_by_one_command(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(pictures, "FOLDER", tmp_path / "pictures")
    written = tmp_path / "reports" / "accuracy.md"
    written.parent.mkdir()
    monkeypatch.setattr(accuracy_page, "PAGE", written)
    method = "closing + findContours"
    options = ["--method", method, "--detail", method, "--scenes", "fine-8px", "--write", "--no-photographs"]
    assert main([*options, "--random", "1"]) == 0
    page = written.read_text(encoding="utf-8")
    named = [line.split("(")[1].rstrip(")") for line in page.splitlines() if line.startswith("![")]
    assert named == ["../pictures/scenes-1.jpg", "../pictures/scenes-close.png"]
    assert all((written.parent / name).stat().st_size > 1000 for name in named)
    assert "| fine-8px |" in page
    assert "1 scenes: 0 without a contour" in page
    assert capsys.readouterr().out.count("| fine-8px |") == 1


def trial_of(scene, mean, hausdorff=1.0, sent=4, bias=0.0):
    found = Agreement(mean, 2 * mean, hausdorff, bias, 0.99, 4)
    return Trial(scene, "wall-tips", 20.0, found, sent)


def test_goals_are_met_or_not_by_the_measured_scenes_only():
    scenes = [
        BenchScene(dataclasses.replace(easy("x", rectangle((120.0, 90.0), 150.0, 110.0)), name=name), tuned, dim)
        for name, tuned, dim in (("tilted", False, False), ("dim", False, True), ("tuned-a", True, False))
    ]
    good = goals(
        "wall-tips", scenes, [trial_of("tilted", 0.2), trial_of("dim", 1.2), trial_of("tuned-a", 9.0, 90.0)], [], [], []
    )
    assert not [goal.what for goal in good if not goal.met and "median" not in goal.what]
    bad = goals("wall-tips", scenes, [trial_of("tilted", 0.9, 11.0, 7, 0.3), trial_of("dim", 1.7)], [], [], [])
    missed = [goal.what for goal in bad if not goal.met]
    assert [name for name in missed if "worst" in name] == [
        "mean error, worst scene",
        "mean error, worst dim scene",
        "Hausdorff, worst scene",
        "vertices of a rectangular block at 0.1 mm through a lens, worst",
    ]
    lost = Trial("tilted", "wall-tips", 20.0, failure="No block found.")
    assert any("refused" in goal.what and not goal.met for goal in goals("wall-tips", scenes, [lost], [], [], [lost]))
