"""Service and controller as two processes, each killed and started again in turn: every acknowledged job is settled."""

from __future__ import annotations

import random
import time
from pathlib import Path

from tests.support.processes.cell import Cell
from tests.support.processes.processes import jobs, lines, until


def test_every_acknowledged_job_is_settled_though_either_side_is_killed(tmp_path: Path) -> None:
    chance = random.Random(20)
    cell = Cell(tmp_path)
    try:
        for _ in range(4):
            cell.goes_on(1)
            time.sleep(chance.uniform(0, 0.4))
            cell.service.kill()
            cell.service = cell.start_service()
            cell.goes_on(1)
            time.sleep(chance.uniform(0, 0.4))
            cell.controller.kill()
            cell.controller = cell.start_controller()
        cell.goes_on(1)
        assert cell.service.stop() == 0
        assert cell.controller.stop() == 0
    finally:
        cell.stop()
    found = jobs(cell.journal)
    assert len(found) >= 9
    in_flight = [job["job_id"] for job in found if job["outcome"] is None]
    assert len(in_flight) <= 1, "at most the one that the shutdown cut short"
    accepted = [contour["job_id"] for contour in lines(cell.accepted)]
    assert len(accepted) == len(set(accepted)), "accepted twice"
    claimed = {job["job_id"] for job in found if job["outcome"] == "accepted"}
    assert claimed <= set(accepted), "accepted in the journal, not at the controller"
    denied = {job["job_id"]: job["reason"] for job in found if job["outcome"] in ("failed", "refused")}
    lost_memory = {job for job, reason in denied.items() if reason == 153}
    assert set(accepted) & set(denied) <= lost_memory, "accepted at the controller, denied in the journal"
    pairs = [(job["trigger_session"], job["trigger_counter"]) for job in found]
    assert len(pairs) == len(set(pairs)), "one trigger gave two jobs"


def test_the_daemon_ends_cleanly_on_sigterm_and_says_so_in_its_register(tmp_path: Path) -> None:
    cell = Cell(tmp_path)
    try:
        cell.goes_on(1)
        assert cell.service.stop() == 0
        assert "Traceback" not in cell.service.text
        assert "-> Halted" in cell.service.text
    finally:
        cell.stop()


def test_losing_the_controller_leads_to_error_and_its_return_back_to_ready(tmp_path: Path) -> None:
    cell = Cell(tmp_path)
    try:
        cell.goes_on(1)
        cell.controller.kill()
        cell.in_error()
        assert cell.service.running
        cell.controller = cell.start_controller()
        cell.goes_on(1)
    finally:
        cell.stop()


def test_losing_the_camera_leads_to_error_and_its_return_back_to_ready(tmp_path: Path) -> None:
    pictures, unplugged = tmp_path / "combs", tmp_path / "unplugged"
    cell = Cell(tmp_path)
    try:
        cell.goes_on(1)
        pictures.rename(unplugged)
        cell.in_error()
        unplugged.rename(pictures)
        cell.goes_on(2)
        assert cell.service.stop() == 0
    finally:
        cell.stop()
    others = {(job["outcome"], job["reason"]) for job in jobs(cell.journal) if job["outcome"] != "accepted"}
    assert others <= {("failed", 100), (None, None)}, "a job that met it failed by name; no other was begun"


def test_a_second_service_on_the_same_state_is_refused(tmp_path: Path) -> None:
    cell = Cell(tmp_path)
    try:
        cell.goes_on(1)
        second = cell.start_service()
        until(lambda: not second.running, what="the second one's end")
        assert "another combtrace (process" in second.text
        second.stop()
    finally:
        cell.stop()
