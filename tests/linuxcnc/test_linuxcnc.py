"""A contour from picture to motion: service, Modbus, bridge and a real CNC controller that moves along it."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import shapely
import yaml

from contour.geometry.rings import Contour
from tests.linuxcnc.machine import bridge_on, linuxcnc_session
from tests.linuxcnc.way_picture import draw_way
from tests.support.processes.processes import Process, combtrace, jobs, until
from tests.support.real_parts import need_program
from tests.support.scenes.sample_scenes import sample_scenes

ROOT = Path(__file__).parents[2]
SAMPLES = Path(__file__).parents[2] / "service" / "samples"
PICTURE = "4-with-holes"
ROTATION_DEG, SHIFT_MM = 25.0, (120.0, -80.0)  # of the machine's frame against the camera's
CUT_Z, SAFE_Z = 1.0, 50.0
FEED_MM_PER_S = 200.0
STATUS_S = 0.05  # how old a position may be that is read
PATH_TOLERANCE_MM = 0.01


@pytest.fixture(scope="module")
def machine():
    need_program("linuxcnc", "apt-get install linuxcnc-uspace")
    with linuxcnc_session() as session:
        yield session


class Cell:
    """A configuration of the service for the bridge, aligned to the machine."""

    def __init__(self, folder, bridge, shift_mm=SHIFT_MM, valid_for_s=30, aligned=True):
        self.folder = folder
        calibration = yaml.safe_load((SAMPLES / "calibration.yaml").read_text())
        del calibration["alignment"]
        if aligned:
            calibration["alignment"] = {"rotation_deg": ROTATION_DEG, "translation_mm": list(shift_mm)}
        (folder / "calibration.yaml").write_text(yaml.safe_dump(calibration))
        shutil.copy(SAMPLES / f"{PICTURE}.jpg", folder)
        (folder / "config.yaml").write_text(
            f"camera: {{kind: files, path: {PICTURE}.jpg, loop: true}}\n"
            "calibration: {file: calibration.yaml}\n"
            f"controller: {{kind: modbus-tcp, port: {bridge.port}, valid_for_s: {valid_for_s}}}\n"
            "triggers: [{kind: controller}]\n"
            "recipes: [{number: 1, name: default, thickness_mm: 20}]\n"
            "service: {state_dir: state}\n"
            "journal: {path: journal.sqlite}\n"
            "archive: {path: archive}\n"
        )

    def run_once(self):
        """`combtrace run --once`: its exit status and what it wrote."""
        done = combtrace("run", "--once", "--config", self.folder / "config.yaml")
        return done.returncode, done.stdout + done.stderr

    def service(self):
        """The daemon."""
        return Process(self.folder / "service.log", "run", "--config", self.folder / "config.yaml")

    def sent(self):
        """The polygon of the last job, as archived, mm."""
        (path,) = self.folder.glob("archive/*/*-accepted.json")
        rings = json.loads(path.read_text())["measurement"]["millimetres"]
        return [np.array(rings["exterior"]), *map(np.array, rings["holes"])]


def in_machine_frame(contour: Contour):
    angle = np.radians(ROTATION_DEG)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return [ring @ turn.T + SHIFT_MM for ring in contour.rings]


def lines_of(rings):
    return shapely.MultiLineString([shapely.LinearRing(ring) for ring in rings])


def test_the_machine_moves_along_the_true_outline_of_the_block_in_the_picture(machine, tmp_path):
    """The whole way: picture, contour, millimetres, Modbus, bridge, motion; sampled from the controller itself."""
    way = machine.folder / "way.json"
    with bridge_on(machine, "--run", "--cut-z", str(CUT_Z), "--simulated-too") as bridge:
        sampling = machine.sampling(way)
        cell = Cell(tmp_path, bridge)
        status, told = cell.run_once()
        assert status == 0, told + bridge.log.read_text()
        bridge.says(r"job \d+ done", 60)
        assert sampling.wait(30) == 0
    sent = cell.sent()
    truth = in_machine_frame(next(scene for scene in sample_scenes() if scene.name == PICTURE).outline)
    positions = np.array(json.loads(way.read_text()))
    positions = positions[int(np.argmax(positions[:, 2] >= SAFE_Z - 1e-3)) :]  # it begins by going up
    deep = positions[:, 2] < CUT_Z + 1e-3
    cutting = positions[deep][:, :2]
    assert len(cutting) > 500
    points = shapely.points(cutting)
    assert shapely.distance(points, lines_of(sent)).max() <= PATH_TOLERANCE_MM + 0.01
    assert shapely.distance(points, lines_of(truth)).max() <= 0.6
    # From sample to sample without leaving the material: as far as the feed goes in the time that the sampler took.
    uncut = deep[1:] & deep[:-1]
    step_mm = np.hypot(*np.diff(positions[:, :2], axis=0).T)[uncut]
    assert (step_mm <= FEED_MM_PER_S * (np.diff(positions[:, 3])[uncut] + STATUS_S)).all()
    went = shapely.MultiPoint(cutting)
    for ring in sent:  # nothing of it left out
        along = [shapely.LinearRing(ring).interpolate(s, normalized=True) for s in np.linspace(0, 1, 400)]
        apart = shapely.distance(shapely.points([p.coords[0] for p in along]), went)
        assert apart.max() <= step_mm.max()
        assert np.mean(apart <= 2.0) > 0.8
    fast = positions[positions[:, 2] >= CUT_Z + 1e-3]
    assert fast[:, 2].max() <= SAFE_Z + 1e-3
    if picture := os.environ.get("COMBTRACE_PICTURE"):
        angle = np.radians(-ROTATION_DEG)
        back = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        draw_way(Path(picture), *[[(part - SHIFT_MM) @ back.T for part in parts] for parts in (truth, sent, [cutting])])


MARGIN_MM = 10.0


def test_the_machine_drives_along_the_part_inside_the_block_by_its_margin(machine, tmp_path):
    """The way that was driven, and the block as it was rendered: neither is what the service believed."""
    way = machine.folder / "part-way.json"
    with bridge_on(machine, "--run", "--cut-z", str(CUT_Z), "--simulated-too", "--part-capacity", "4000") as bridge:
        sampling = machine.sampling(way)
        cell = Cell(tmp_path, bridge)
        shutil.copy(ROOT / "samples" / "part.dxf", tmp_path)
        config = tmp_path / "config.yaml"
        text = config.read_text().replace("valid_for_s", "part_block: {address: 2048, capacity: 4000}, valid_for_s")
        part = f"part: {{file: part.dxf, margin_mm: {MARGIN_MM:g}}}"
        config.write_text(text.replace("thickness_mm: 20", f"thickness_mm: 20, {part}"))
        status, told = cell.run_once()
        assert status == 0, told + bridge.log.read_text()
        bridge.says(r"job \d+ done", 60)
        assert sampling.wait(30) == 0
    positions = np.array(json.loads(way.read_text()))
    positions = positions[int(np.argmax(positions[:, 2] >= SAFE_Z - 1e-3)) :]
    cutting = positions[positions[:, 2] < CUT_Z + 1e-3][:, :2]
    assert len(cutting) > 200
    (path,) = tmp_path.glob("archive/*/*-accepted.json")
    laid = json.loads(path.read_text())["measurement"]["part"]["millimetres"]
    rings = [np.array(ring) for ring in (laid["exterior"], *laid["holes"])]
    driven = shapely.points(cutting)
    assert shapely.distance(driven, lines_of(rings)).max() <= PATH_TOLERANCE_MM + 0.01
    for ring in rings:
        along = [shapely.LinearRing(ring).interpolate(s, normalized=True) for s in np.linspace(0, 1, 200)]
        assert shapely.distance(along, shapely.MultiPoint(cutting)).max() <= FEED_MM_PER_S * 2 * STATUS_S
    exterior, *holes = in_machine_frame(next(scene for scene in sample_scenes() if scene.name == PICTURE).outline)
    block = shapely.Polygon(exterior, holes)
    assert shapely.contains(block, driven).all()
    assert shapely.distance(driven, block.boundary).min() >= MARGIN_MM - PATH_TOLERANCE_MM - 0.01


def test_without_run_it_is_shown_and_waits_for_the_operators_cycle_start(machine, tmp_path):
    with bridge_on(machine, "--simulated-too") as bridge:
        status, told = Cell(tmp_path, bridge).run_once()
        assert status == 0, told
        bridge.says("shown: cycle start runs it")
        assert "started" not in bridge.log.read_text()
        machine.operate("start")
        bridge.says(r"job \d+ started by the operator")
        bridge.says(r"job \d+ done", 60)


def test_a_contour_that_waits_too_long_is_let_go(machine, tmp_path):
    with bridge_on(machine, "--simulated-too") as bridge:
        status, told = Cell(tmp_path, bridge, valid_for_s=3).run_once()
        assert status == 0, told
        bridge.says(r"job \d+ let go: it is too old to be cut")
        assert "started" not in bridge.log.read_text()


@pytest.mark.parametrize(
    ("changes", "options", "why"),
    [
        ({"shift_mm": (1900.0, 0.0)}, ["--simulated-too"], "the machine goes from -2000 to 2000"),
        ({"aligned": False}, ["--simulated-too"], "its frame is not the machine's"),
        ({}, [], "its frame is not from a live camera"),
    ],
    ids=["outside the limits", "not aligned", "from a file"],
)
def test_what_the_machine_must_not_cut_is_refused_with_why(machine, tmp_path, changes, options, why):
    with bridge_on(machine, *options) as bridge:
        status, told = Cell(tmp_path, bridge, **changes).run_once()
        assert status == 3
        assert "151" in told
        assert why in bridge.log.read_text()


def test_the_operator_asks_for_a_measurement_and_an_emergency_stop_ends_the_readiness(machine, tmp_path):
    with bridge_on(machine, "--run", "--simulated-too") as bridge:
        service = Cell(tmp_path, bridge).service()
        try:
            log = tmp_path / "service.log"
            until(lambda: "-> Ready" in log.read_text(), what="the service is ready")
            bridge.request()
            bridge.says("a measurement is asked for")
            bridge.says(r"job \d+ started")
            machine.operate("estop")
            bridge.says(r"job \d+ stopped: ")  # whichever of off and emergency stop LinuxCNC shows first
            bridge.says("state 3: emergency stop")
            bridge.request()
            bridge.says("no measurement asked for: the machine is not ready")
            machine.operate("prepare")
            until(lambda: "-> Ready" in log.read_text().split("emergency")[-1], what="ready again")
        finally:
            service.stop()


def test_the_hal_pins_ask_for_a_measurement_at_each_rising_edge_and_show_how_it_stands(machine, tmp_path):
    with bridge_on(machine, "--run", "--simulated-too", "--hal") as bridge:
        assert [machine.pin(f"combtrace.{name}") for name in ("ready", "busy", "request")] == ["FALSE"] * 3
        service = Process(
            tmp_path / "service.log",
            *("simulate-service", "--controller", f"127.0.0.1:{bridge.port}", "--state", tmp_path / "state"),
            *("--aligned", "--shape", "corner"),
        )
        try:
            until(lambda: machine.pin("combtrace.ready") == "TRUE", what="ready")
            machine.set_pin("combtrace.recipe", "1")
            machine.set_pin("combtrace.thickness-mm", "12.5")
            machine.set_pin("combtrace.request", "1")
            until(lambda: machine.pin("combtrace.busy") == "TRUE", what="busy")
            assert machine.pin("combtrace.ready") == "FALSE"
            bridge.says(r"job \d+ done", 60)
            until(lambda: machine.pin("combtrace.ready") == "TRUE", what="ready again")
            assert machine.pin("combtrace.busy") == "FALSE"
            assert bridge.log.read_text().count("a measurement is asked for") == 1  # it is the edge that asks
            machine.set_pin("combtrace.request", "0")
            machine.set_pin("combtrace.recipe", "7")
            until(lambda: machine.pin("combtrace.request") == "FALSE", what="the pin let go")
            time.sleep(0.1)  # some scans of the bridge
            machine.set_pin("combtrace.request", "1")
            until(lambda: re.search(r"job \d+ refused", service.text), what="the second job")
        finally:
            service.stop()
        first, second = jobs(tmp_path / "state" / "journal.sqlite")
        assert (first["outcome"], first["recipe"], first["thickness_um"]) == ("accepted", 1, 12_500)
        assert (second["outcome"], second["reason"], second["recipe"]) == ("refused", 122, 7)


def test_the_bridge_keeps_the_protocols_rules_as_the_hardware_in_loop_suite_tries_them(machine):
    with bridge_on(machine) as bridge:
        command = [sys.executable, "-m", "pytest", "tests/hil/test_controller.py", "-p", "no:cacheprovider"]
        command += [f"--hil-controller=tcp://127.0.0.1:{bridge.port}"]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=120, check=False)
        assert done.returncode == 0, done.stdout
        assert " passed" in done.stdout
