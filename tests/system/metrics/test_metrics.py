"""Metrics over HTTP from a running daemon; the alert rules, by Prometheus' own tool, name only what is served."""

from __future__ import annotations

import re
import socket
import subprocess
import urllib.request
from pathlib import Path

import pytest

from tests.support.processes.cell import ON_SAMPLES, Cell
from tests.support.processes.processes import BOUND_S, free_port, until
from tests.support.real_parts import need_program

RULES = Path(__file__).parents[3] / "packaging" / "prometheus"
NAME = re.compile(r"\b(combtrace_[a-z0-9_]+)\b")


def served(port: int) -> str:
    with urllib.request.urlopen(f"http://127.0.0.1:{port}/metrics", timeout=BOUND_S) as answer:
        return answer.read().decode()


def value(text: str, series: str) -> float:
    (found,) = re.findall(rf"^{re.escape(series)} (\S+)$", text, re.MULTILINE)
    return float(found)


@pytest.fixture(scope="module")
def text(tmp_path_factory: pytest.TempPathFactory) -> str:
    """What a daemon serves after some jobs."""
    port = free_port()
    cell = Cell(
        tmp_path_factory.mktemp("cell"), camera=ON_SAMPLES, trigger_every_s=0.2, more=f"metrics: {{port: {port}}}\n"
    )
    try:
        cell.goes_on(2)
        until(lambda: value(served(port), 'combtrace_evidence_total{result="stored"}') >= 2, what="evidence")
        cell.controller.stop()
        until(lambda: value(served(port), 'combtrace_part_up{part="controller"}') == 0, what="the loss, in the metrics")
        # The machine's other addresses stand for the network: this one every machine has.
        with pytest.raises(ConnectionRefusedError), socket.create_connection(("127.0.0.2", port), timeout=10):
            pytest.fail("open to the network")
        return served(port)
    finally:
        cell.service.kill()
        cell.stop()


def test_jobs_stages_picture_link_and_storage_are_served(text: str) -> None:
    assert value(text, 'combtrace_jobs_total{outcome="accepted",reason="none"}') >= 2
    for stage in ("frame", "trace", "transfer", "job"):
        assert value(text, f'combtrace_stage_seconds_count{{stage="{stage}"}}') >= 2
    assert 0 < value(text, "combtrace_picture_blur_pixels") < 5
    assert value(text, "combtrace_picture_contrast") > 20
    assert value(text, 'combtrace_part_up{part="controller"}') == 0
    assert 'combtrace_fault{part="controller",reason="controller_lost"} 1.0' in text
    assert value(text, 'combtrace_triggers_total{kind="controller",result="taken"}') >= 2
    assert value(text, "combtrace_archive_bytes") > 100_000
    assert value(text, "combtrace_journal_disk_free_bytes") > 0
    assert value(text, "process_resident_memory_bytes") > 1e6


def test_prometheus_own_tool_accepts_what_is_served(text: str) -> None:
    promtool = need_program("promtool", "apt-get install prometheus")
    done = subprocess.run([promtool, "check", "metrics"], input=text, capture_output=True, text=True, check=False)
    ours = [line for line in (done.stdout + done.stderr).splitlines() if line.startswith("combtrace")]
    assert ours == []
    assert done.returncode in (0, 3), done.stderr  # 3: it minds names of prometheus_client's own


@pytest.mark.parametrize(
    "command", [("check", "rules", "combtrace-alerts.yml"), ("test", "rules", "combtrace-alerts.test.yml")]
)
def test_prometheus_own_tool_accepts_the_alert_rules_and_their_tests(command: tuple[str, ...]) -> None:
    promtool = need_program("promtool", "apt-get install prometheus")
    done = subprocess.run([promtool, *command], cwd=RULES, capture_output=True, text=True, check=False, timeout=BOUND_S)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_alert_rules_name_only_what_is_served(text: str) -> None:
    rules = (RULES / "combtrace-alerts.yml").read_text()
    expressions = re.findall(r"expr: (.*?)\n        (?:for|labels):", rules, re.DOTALL)
    named = {name for expression in expressions for name in NAME.findall(expression)}
    missing = {name for name in named if not re.search(rf"^{name}(\{{| )", text, re.MULTILINE)}
    assert len(expressions) >= 11
    assert missing == set()


def test_every_metric_is_explained(text: str) -> None:
    page = (Path(__file__).parents[3] / "docs" / "reference" / "metrics.md").read_text()
    names = set(re.findall(r"^# TYPE (combtrace_[a-z_]+)", text, re.MULTILINE))
    assert {name for name in names if f"`{name}`" not in page and not name.endswith("_created")} == set()


def test_without_the_configuration_nothing_is_served(tmp_path: Path) -> None:
    cell = Cell(tmp_path, trigger_every_s=None)
    try:
        cell.ready()
        listening = Path(f"/proc/{cell.service.process_id}/net/tcp").read_text()
        inodes = {
            path.readlink().name for path in Path(f"/proc/{cell.service.process_id}/fd").iterdir() if path.is_symlink()
        }
        ours = [line for line in listening.splitlines()[1:] if f"socket:[{line.split()[9]}]" in inodes]
        assert [line for line in ours if line.split()[3] == "0A"] == [], "0A: listening"
    finally:
        cell.stop()
