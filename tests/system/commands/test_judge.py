"""`combtrace judge` as a user runs it: the contract's figures, the page, exit statuses, and every unusable input."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from contour.geometry.rings import Contour
from tests.support.pictures.combs import write_combs
from tests.support.pictures.small_scenes import block
from tests.support.processes.processes import called

KEYS = {"image", "status", "reasons", "iou", "mean_px", "p95_px", "hausdorff_px", "bound_px", "bound_held"}
Judged = tuple[dict[str, dict[str, Any]], dict[str, Any], str]


def write_truth(path: Path, outline: Contour, **more: Any) -> None:
    rings = [ring.tolist() for ring in outline.rings]
    path.write_text(json.dumps({"image": "elsewhere/other.png", "outer": rings[0], "holes": rings[1:], **more}))


def judged(*arguments: str | Path, status: int) -> Judged:
    """The objects by the pictures' names, the summary, and what was told to people."""
    done = called("judge", *arguments, "--json", "-")
    assert done.returncode == status, done.stderr
    *records, last = (json.loads(line) for line in done.stdout.splitlines())
    return {Path(record["image"]).name: record for record in records}, last["summary"], done.stderr


@pytest.fixture(scope="module")
def blocks(tmp_path_factory: pytest.TempPathFactory) -> Judged:
    """Rendered blocks, judged by their truth; of one the hole is left out, and one picture shows nothing."""
    folder = tmp_path_factory.mktemp("blocks")
    for name in ("rectangle", "holed"):
        rendered = block(name)
        cv2.imwrite(str(folder / f"{name}.png"), rendered.picture)
        write_truth(folder / f"{name}.json", rendered.truth_px, edge="cut")
    shutil.copy(folder / "holed.png", folder / "left-out.png")
    write_truth(folder / "left-out.json", Contour(block("holed").truth_px.exterior), edge="cells")
    cv2.imwrite(str(folder / "nothing.png"), np.full((200, 300), 90, np.uint8))
    write_truth(folder / "nothing.json", Contour(np.array([[9.0, 9.0], [9.0, 90.0], [90.0, 90.0]])))
    return judged(folder, status=3)


@pytest.fixture
def combs(tmp_path: Path) -> Path:
    """Small pictures; what is traced in the first lies beside it as the truth."""
    folder = write_combs(tmp_path / "combs")
    seen = json.loads(called("trace", folder / "0.png", "--json", "-").stdout)["pixels"]
    write_truth(folder / "0.json", Contour(np.array(seen["exterior"]), tuple(map(np.array, seen["holes"]))))
    for name in ("1.png", "2.png"):
        (folder / name).unlink()
    return folder


def test_each_picture_has_the_contracts_figures_and_a_refused_one_its_reason(blocks: Judged) -> None:
    records, summary, told = blocks
    assert list(records) == ["holed.png", "left-out.png", "nothing.png", "rectangle.png"]
    assert all(set(record) >= KEYS for record in records.values())
    for name in ("rectangle.png", "holed.png"):
        good = records[name]
        assert (good["status"], good["reasons"], good["bound_held"]) == ("ok", [], True)
        assert good["iou"] > 0.985
        assert good["mean_px"] < good["p95_px"] < good["hausdorff_px"]
        assert good["mean_px"] < 0.5 < good["bound_px"] * 3
    nothing = records["nothing.png"]
    assert (nothing["status"], nothing["reasons"], nothing["iou"]) == ("refused", ["no_block_found"], None)
    assert (nothing["bound_held"], nothing["hausdorff_px"]) == (None, None)
    assert (summary["pictures"], summary["accepted"], summary["refused"], summary["errors"]) == (4, 3, 1, 0)
    assert summary["iou_worst"] == records["left-out.png"]["iou"]
    assert re.search(r"^rectangle.png +accepted +0\.9\d\d .* yes$", told, re.MULTILINE)
    assert re.search(r"^nothing.png +refused +110 no_block_found$", told, re.MULTILINE)


def test_how_the_border_runs_is_compared_with_the_truth(blocks: Judged) -> None:
    records, summary, told = blocks
    assert [records[name]["edge_told"] for name in ("holed.png", "left-out.png", "nothing.png")] == [True, False, None]
    assert (records["left-out.png"]["edge"], records["left-out.png"]["true_edge"]) == ("cut", "cells")
    assert (summary["edges_told"], summary["edges_known"]) == (2, 3)
    assert re.search(r"^left-out.png .* cut, NOT cells ", told, re.MULTILINE)
    assert "edge told rightly in 2 of 3" in told


def test_holes_count(blocks: Judged) -> None:
    right, wrong = (blocks[0][name] for name in ("holed.png", "left-out.png"))
    assert wrong["iou"] < right["iou"] - 0.05
    assert wrong["hausdorff_px"] > 30


def test_the_outline_is_judged_as_trace_traces_it(combs: Path) -> None:
    traced = json.loads(called("trace", combs / "0.png", "--json", "-").stdout)
    records, summary, _ = judged(combs, status=0)
    assert records["0.png"]["bound_px"] == traced["uncertainty_px"]
    assert records["0.png"]["iou"] == pytest.approx(1.0)
    assert records["0.png"]["hausdorff_px"] == pytest.approx(0.0, abs=1e-9)
    assert (summary["bounds_stated"], summary["bounds_held"]) == (1, 1)
    unlike, _, _ = judged(combs, "--method", "sliding-matrix", status=0)
    assert (unlike["0.png"]["bound_px"], unlike["0.png"]["bound_held"]) == (None, None)
    assert unlike["0.png"]["iou"] < 0.99


def test_accepted_outside_its_bound_is_no_pass_and_a_refused_outline_is_compared_too(combs: Path) -> None:
    truth = json.loads((combs / "0.json").read_text())
    write_truth(combs / "0.json", Contour(np.add(truth["outer"], [12.0, 0.0])))
    outside, summary, told = judged(combs, status=3)
    assert (outside["0.png"]["status"], outside["0.png"]["bound_held"]) == ("ok", False)
    assert (summary["accepted"], summary["bounds_held"]) == (1, 0)
    assert "NO" in told
    config = combs.with_suffix(".config.yaml")
    config.write_text(
        f"camera: {{kind: files, path: .}}\ncontroller: {{kind: none}}\ncalibration: {{file: {combs.name}.yaml}}\n"
        "recipes: [{number: 1, name: large, thickness_mm: 20, min_area_mm2: 100000}]\n"
    )
    refused, _, _ = judged(combs, "--config", config, status=3)
    assert (refused["0.png"]["status"], refused["0.png"]["reasons"]) == ("refused", ["area_out_of_limits"])
    assert refused["0.png"]["iou"] == pytest.approx(outside["0.png"]["iou"], abs=0.01)


def test_what_cannot_be_judged_is_told_and_the_rest_is_judged(combs: Path) -> None:
    for name in ("broken", "crossing", "half", "alone", "list", "torn", "word"):
        shutil.copy(combs / "0.png", combs / f"{name}.png")
    (combs / "broken.json").write_text("{'outer'")
    write_truth(combs / "crossing.json", Contour(np.array([[0.0, 0.0], [90.0, 90.0], [90.0, 0.0], [0.0, 90.0]])))
    (combs / "half.json").write_text('{"outer": [[1, 2], [3, 4]]}')
    (combs / "list.json").write_text("[1, 2]")
    (combs / "torn.json").write_bytes((combs / "0.json").read_bytes())
    (combs / "torn.png").write_bytes((combs / "0.png").read_bytes()[:400])
    write_truth(combs / "word.json", Contour(np.array([[0.0, 0.0], [90.0, 90.0], [90.0, 0.0]])), edge="wavy")
    write_truth(combs / "lone.json", Contour(np.array([[0.0, 0.0], [90.0, 90.0], [90.0, 0.0]])))
    (combs / "notes.json").write_text('{"mood": "good"}')
    records, summary, told = judged(combs, status=2)
    expected = {
        "alone.png": "alone.json: is not there, expected the picture's true outline. Draw it: combtrace judge",
        "broken.png": "broken.json: is no JSON",
        "crossing.png": "crossing.json: is no outline of a block: the exterior meets itself: edges 0 and 2",
        "half.png": "half.json: a ring is of shape (2, 2), expected three or more points",
        "list.png": "list.json: holds no object",
        "lone.json": "lone.json: no picture of that name lies beside it",
        "torn.png": "torn.png: truncated PNG",
        "word.png": "word.json: edge is 'wavy', expected cut, cells, mixed",
    }
    assert {name for name, record in records.items() if record["status"] == "error"} == set(expected)
    for name, text in expected.items():
        assert text in records[name]["details"][0]
        assert text in told
        assert records[name]["iou"] is None
    assert (records["0.png"]["status"], summary["errors"], summary["pictures"]) == ("ok", 8, 9)


def test_a_folder_without_pictures_or_truth_is_told(tmp_path: Path, combs: Path) -> None:
    (tmp_path / "empty").mkdir()
    (combs / "0.json").unlink()
    for folder, told in (
        (tmp_path / "empty", "holds no picture, but nothing"),
        (tmp_path / "none", "cannot be looked into: No such file"),
        (
            combs,
            "holds 1 pictures and beside none a NAME.json with its true outline. Draw them",
        ),
    ):
        done = called("judge", folder)
        assert (done.returncode, told in done.stderr) == (2, True), done.stderr


def test_the_page_holds_table_and_pictures_and_loads_nothing(combs: Path, tmp_path: Path) -> None:
    odd = combs / "<b>&.png"
    (combs / "0.png").rename(odd)
    (combs / "0.json").rename(combs / "<b>&.json")
    done = called("judge", combs, "--page", tmp_path / "judged.html")
    assert done.returncode == 0, done.stderr
    page = (tmp_path / "judged.html").read_text(encoding="utf-8")
    assert '<td><a href="#&lt;b&gt;&amp;.png">&lt;b&gt;&amp;.png</a></td>' in page
    assert '<image href="data:image/jpeg;base64,' in page
    assert [page.count(f'<path class="{kind}" d="M') for kind in ("ours", "truth")] == [2, 2]  # one is the key's
    assert re.findall(r"<script|https?:|\bon\w+=|url\(|<b>", page) == []


def test_no_output_takes_the_place_of_a_picture_or_a_truth(combs: Path) -> None:
    before = (combs / "0.json").read_bytes()
    for option, name in (("--json", "0.json"), ("--page", "0.json"), ("--page", "0.png")):
        done = called("judge", combs, option, combs / name)
        assert (done.returncode, "that is read" in done.stderr) == (2, True), done.stderr
    assert (combs / "0.json").read_bytes() == before
    assert "Name a file" in called("judge", combs, "--page", "-").stderr
