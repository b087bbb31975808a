"""Recipes of a running daemon: chosen by the controller's register, and read again by SIGHUP between two jobs."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from tests.support.processes.cell import SAMPLES, Cell
from tests.support.processes.processes import Process, called, jobs, lines, until

PICTURE = SAMPLES / "1-rectangle.jpg"
PLAIN = "{number: 1, name: plain, thickness_mm: 20}"


class Bench:
    """A daemon without controller whose pictures the test hands over one by one."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.pictures = folder / "pictures"
        self.pictures.mkdir()
        self.write(f"recipes: [{PLAIN}]")
        self.service = Process(folder / "service.log", "run", "--config", folder / "config.yaml")
        self._handed = 0

    def write(self, more: str, period_s: float = 0.1) -> None:
        (self.folder / "config.yaml").write_text(
            "camera: {kind: files, path: pictures, loop: false, watch: true, timeout_s: 60}\n"
            f"calibration: {{file: {SAMPLES / 'calibration.yaml'}}}\n"
            f"controller: {{kind: none}}\ntriggers: [{{kind: interval, period_s: {period_s}}}]\n"
            f"service: {{state_dir: state}}\njournal: {{path: journal.sqlite}}\narchive: {{max_bytes: 0}}\n{more}\n"
        )

    def reload(self, expected: str) -> None:
        self.service.reload()
        until(lambda: expected in self.service.text, what=expected)

    def hand_over(self) -> dict[str, object]:
        """The job, settled, of one more picture."""
        self._handed += 1
        number = self._handed
        until(lambda: f"SingleExecution job={number}\n" in self.service.text, what=f"job {number}")
        shutil.copy(PICTURE, self.pictures / f"{number}.tmp")
        (self.pictures / f"{number}.tmp").rename(self.pictures / f"{number}.jpg")
        until(lambda: jobs(self.folder / "journal.sqlite")[number - 1]["outcome"], what=f"the end of job {number}")
        return jobs(self.folder / "journal.sqlite")[number - 1]


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    built = Bench(tmp_path)
    try:
        yield built
    finally:
        built.service.kill()


def test_a_running_job_keeps_its_recipe_and_the_next_has_the_new_one_or_the_old_where_the_new_is_bad(
    bench: Bench,
) -> None:
    until(lambda: "SingleExecution job=1\n" in bench.service.text, what="job 1")
    bench.write("recipes: [{number: 1, name: large, thickness_mm: 20, min_area_mm2: 3.0e+6}]")
    bench.reload("configuration reloaded, from the job after 1 on: recipes (1)")
    assert bench.hand_over()["outcome"] == "written", "it began with the old recipe"
    assert bench.hand_over()["reason"] == 112, "it began with the new one"

    # Two good changes and bad ones, more than the log's bound on lines alike: none of them.
    colours = "".join(f"colour{number}: red\n" for number in range(8))
    bench.write(f"recipes: [{PLAIN}, {{number: 2, name: two, tolerance_mm: -1}}]\n{colours}")
    bench.reload("the configuration of before stays in force")
    text = bench.service.text
    assert "recipes[1].tolerance_mm" in text
    assert all(f"colour{number}: unknown key" in text for number in range(8))
    status = called("status", "--config", bench.folder / "config.yaml")
    assert "warning   configuration: not reloaded: " in status.stdout, "though the file is bad"
    assert "(and 8 more)" in status.stdout
    assert bench.hand_over()["reason"] == 112

    bench.write(f"recipes: [{PLAIN}]", period_s=0.2)
    bench.reload("triggers changed, which needs a restart")
    assert bench.hand_over()["reason"] == 112

    bench.write(f"recipes: [{PLAIN}]\nwork_area_mm: []")
    (bench.folder / "config.yaml").write_text(
        (bench.folder / "config.yaml").read_text().replace("calibration.yaml}", "gone.yaml}")
    )
    bench.reload("gone.yaml")
    assert bench.hand_over()["reason"] == 112

    bench.write(f"recipes: [{PLAIN}]")
    until(lambda: "SingleExecution job=6\n" in bench.service.text, what="job 6")
    bench.reload("from the job after 6 on: recipes (1)")
    assert bench.hand_over()["reason"] == 112, "it was waiting for its picture"
    assert bench.hand_over()["outcome"] == "written"
    assert "warning" not in called("status", "--config", bench.folder / "config.yaml").stdout
    assert "Traceback" not in bench.service.text


def test_the_controllers_register_chooses_the_recipe_and_one_that_is_gone_is_refused(tmp_path: Path) -> None:
    two = "{number: 2, name: inner, thickness_mm: 20, margin_mm: 10, start: upper-right}"
    cell = Cell(tmp_path, recipe=2, more=f"recipes: [{PLAIN}, {two}]\n")
    try:
        cell.goes_on(1)
        sent = lines(cell.accepted)[0]
        assert sent["recipe"] == 2
        ring = np.array(sent["millimetres"]["exterior"])
        towards = ring @ [1, 1]
        assert towards[0] > towards.max() - 0.05, "of its outermost cells several lie as far out"
        config = cell.folder / "config.yaml"
        config.write_text(config.read_text().replace(f", {two}", ""))
        cell.service.reload()
        until(lambda: any(job["reason"] == 122 for job in cell.settled()), what="122")
        said = "recipe 2 is not configured; there are 1"
        until(lambda: said in cell.service.text, what=said)
    finally:
        cell.stop()
