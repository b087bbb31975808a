"""`combtrace live`: a line a look, the newest overlay, and an end by Ctrl-C."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys

import cv2
import pytest

from service.cli.main import main
from service.jobs.rehearsal import drawn_comb


@pytest.fixture
def block(tmp_path):
    file = tmp_path / "block.png"
    cv2.imwrite(str(file), drawn_comb())
    return file


def test_each_look_is_a_line_with_the_outline_and_the_picture_s_figures(block, capsys):
    assert main(["live", "--pictures", str(block), "--frames", "3"]) == 0
    *looks, end = capsys.readouterr().out.splitlines()
    assert len(looks) == 3
    assert all(line.startswith("wall-tips, ") and "sharpness" in line and "% white" in line for line in looks)
    assert end.startswith("3 outlines in 3 frames")


def test_objects_tell_what_trace_tells_and_the_end_stays_apart(block, tmp_path, capsys):
    (tmp_path / "config.yaml").write_text(
        "camera: {kind: files, path: block.png}\ncontroller: {kind: none}\n"
        "recipes: [{number: 1, name: default, thickness_mm: 20, min_area_mm2: 0}]\n"
    )
    assert main(["live", "--config", str(tmp_path / "config.yaml"), "--frames", "2", "--json"]) == 0
    said = capsys.readouterr()
    first, second = map(json.loads, said.out.splitlines())
    assert (first["sequence"], second["sequence"]) == (1, 2)
    assert first["source"] == str(block)
    assert first["status"] == "ok"
    assert first["pixels"]["exterior"] == second["pixels"]["exterior"]
    assert first["sharpness"] > 0
    assert said.err.startswith("2 outlines in 2 frames")


@pytest.mark.parametrize("folder", [True, False])
def test_the_newest_overlay_lies_in_the_file_or_in_the_folder(block, tmp_path, folder):
    overlay = tmp_path / "seen" / "live.jpg"
    overlay.parent.mkdir()
    given = overlay.parent if folder else overlay
    assert main(["live", "--pictures", str(block), "--frames", "1", "--overlay", str(given)]) == 0
    assert [file.name for file in overlay.parent.iterdir()] == ["live.jpg"]
    assert cv2.imread(str(overlay)).shape[:2] >= drawn_comb().shape


def test_a_refusal_is_told_in_russian_too(tmp_path, capsys):
    file = tmp_path / "empty.png"
    cv2.imwrite(str(file), drawn_comb()[:, :30])
    assert main(["live", "--pictures", str(file), "--frames", "1", "--language", "ru"]) == 0
    refused, end = capsys.readouterr().out.splitlines()
    assert refused.startswith("отказ: 110 no_block_found")
    assert end.startswith("0 outlines in 1 frames")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--pictures", "nowhere.png"], "nowhere.png"),
        (["--pictures", "x.png", "--simulated"], "not allowed with"),
        (["--simulated", "--rate", "0"], "0.01 to 1000"),
        (["--config", "nowhere.yaml"], "nowhere.yaml"),
    ],
)
def test_what_cannot_be_shown_is_told(words, said, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    try:
        status = main(["live", "--frames", "1", *words])
    except SystemExit as end:
        status = end.code
    assert status in (1, 2)
    assert said in capsys.readouterr().err


def test_ctrl_c_ends_it_and_tells_how_many_there_were():
    command = [sys.executable, "-m", "service.cli.main", "live", "--simulated"]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True, start_new_session=True) as live:
        first = live.stdout.readline()
        os.killpg(live.pid, signal.SIGINT)  # as a terminal does: to all of its processes
        rest, errors = live.communicate()
    assert "wall-tips, 4 vertices" in first
    assert rest.splitlines()[-1].split(" in ")[1].rstrip().split()[1].startswith("frames")
    assert (live.returncode, errors) == (0, "")
