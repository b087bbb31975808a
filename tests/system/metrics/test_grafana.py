"""The dashboards, of a cell and of a plant: of Grafana's own schema, and a real Prometheus answers what they ask.

No package of Debian or npm holds a Grafana server, so its published types stand in for it.
"""

from __future__ import annotations

import json
import re
import subprocess
import urllib.error
import urllib.parse
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.support.interop.programs import NODE_INSTALL, node_modules
from tests.support.processes.cell import ON_SAMPLES, Cell
from tests.support.processes.processes import BOUND_S, free_port, until
from tests.support.real_parts import need_program

PACKAGING = Path(__file__).parents[3] / "packaging"
FILE = PACKAGING / "grafana" / "combtrace-dashboard.json"
DASHBOARDS: dict[str, dict[str, Any]] = {
    file.name: json.loads(file.read_text()) for file in (FILE, PACKAGING / "plant" / "combtrace-plant-dashboard.json")
}
PANELS = [panel for one in DASHBOARDS.values() for panel in one["panels"] if panel["type"] != "row"]
QUESTIONS = {(panel["title"], target["expr"]) for panel in PANELS for target in panel["targets"]}
NAME = re.compile(r"\b((?:combtrace|process)_[a-z0-9_]+)\b")
PROMETHEUS_INSTALL = "apt-get install prometheus"
SCHEMA = ("@grafana/schema@13", "typescript@5")
# What a cell that accepts every block does not count; its calibration says not when it was made.
UNANSWERED = {"Refused and failed by reason", "Triggers not taken", "Calibration's age"}
UNANSWERED |= {"Refused of all jobs, an hour", "Refused", "Oldest calibration"}
TYPES = """
import type { Dashboard, GraphFieldConfig } from "@grafana/schema";
import type { Options as Stat } from "@grafana/schema/dist/esm/raw/composable/stat/panelcfg/x/StatPanelCfg_types.gen";
import type { Options as Lines } from
  "@grafana/schema/dist/esm/raw/composable/timeseries/panelcfg/x/TimeSeriesPanelCfg_types.gen";
// A file holds an enumeration's values as text.
type Plain<T> = T extends string ? `${T}` : T extends (infer U)[] ? Plain<U>[]
  : T extends object ? { [K in keyof T]: Plain<T[K]> } : T;
"""


def asked(expression: str) -> str:
    """An expression as Grafana sends it, of every instance."""
    return expression.replace("$__rate_interval", "10s").replace("$instance", ".+")


# --- the schema -------------------------------------------------------------------------------------------------------


def typed(dashboard: dict[str, Any]) -> str:
    """The dashboard as a program that compiles only where each of its fields is one of Grafana's."""
    lines = [TYPES, f"export const dashboard: Plain<Dashboard> = {json.dumps(dashboard)};"]
    for panel in dashboard["panels"]:
        kind = {"stat": "Stat", "timeseries": "Lines"}.get(panel["type"])
        if kind is not None:
            lines.append(f"export const options{panel['id']}: Plain<Partial<{kind}>> = {json.dumps(panel['options'])};")
            custom = json.dumps(panel["fieldConfig"]["defaults"].get("custom", {}))
            lines.append(f"export const custom{panel['id']}: Plain<GraphFieldConfig> = {custom};")
    return "\n".join(lines)


@pytest.fixture(scope="module")
def compiles() -> Callable[[dict[str, Any]], str]:
    """What the compiler says against a dashboard, nothing where it fits."""
    node = need_program("node", NODE_INSTALL)
    modules = node_modules(SCHEMA)
    options = ("--noEmit", "--strict", "--skipLibCheck", "--module", "nodenext", "--moduleResolution", "nodenext")

    def said(dashboard: dict[str, Any]) -> str:
        program = modules.parent / "dashboard.ts"
        program.write_text(typed(dashboard))
        command = [node, str(modules / "typescript" / "bin" / "tsc"), *options, program.name]
        return subprocess.run(command, cwd=modules.parent, capture_output=True, text=True, check=False).stdout

    return said


@pytest.mark.parametrize("name", DASHBOARDS)
def test_the_dashboard_is_of_grafanas_schema(compiles: Callable[[dict[str, Any]], str], name: str) -> None:
    assert compiles(DASHBOARDS[name]) == ""


@pytest.mark.parametrize(
    ("right", "wrong"),
    [('"refresh": "30s"', '"refreshes": "30s"'), ('"showLegend"', '"legend"'), ('"mode": "normal"', '"mode": "stack"')],
)
def test_what_is_none_of_grafanas_does_not_compile(
    compiles: Callable[[dict[str, Any]], str], right: str, wrong: str
) -> None:
    text = FILE.read_text()
    assert right in text
    assert "error TS" in compiles(json.loads(text.replace(right, wrong)))


@pytest.mark.parametrize("name", DASHBOARDS)
def test_no_two_panels_lie_on_each_other_or_share_a_number(name: str) -> None:
    panels = DASHBOARDS[name]["panels"]
    places = [panel["gridPos"] for panel in panels]
    cells = [
        (x, y)
        for place in places
        for x in range(place["x"], place["x"] + place["w"])
        for y in range(place["y"], place["y"] + place["h"])
    ]
    assert len(cells) == len(set(cells))
    assert max(x for x, _ in cells) < 24
    assert len({panel["id"] for panel in panels}) == len(panels)


# --- the questions ----------------------------------------------------------------------------------------------------


def test_prometheus_own_tool_can_read_every_question(tmp_path: Path) -> None:
    promtool = need_program("promtool", PROMETHEUS_INSTALL)
    rules = [{"record": f"q{number}", "expr": asked(text)} for number, (_, text) in enumerate(sorted(QUESTIONS))]
    (tmp_path / "rules.yml").write_text(json.dumps({"groups": [{"name": "dashboard", "rules": rules}]}))
    command = [promtool, "check", "rules", "rules.yml"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"{len(rules)} rules found" in done.stdout
    assert len(rules) > 25


@pytest.fixture(scope="module")
def prometheus(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A Prometheus that scrapes a daemon at work."""
    program, folder = need_program("prometheus", PROMETHEUS_INSTALL), tmp_path_factory.mktemp("prometheus")
    metrics, port = free_port(), free_port()
    (folder / "prometheus.yml").write_text(
        "global: {scrape_interval: 1s}\nscrape_configs:\n  - job_name: combtrace\n"
        f"    static_configs: [{{targets: ['127.0.0.1:{metrics}']}}]\n"
    )
    cell = Cell(folder, camera=ON_SAMPLES, trigger_every_s=0.2, more=f"metrics: {{port: {metrics}}}\n")
    options = ("--config.file=prometheus.yml", "--storage.tsdb.path=data", f"--web.listen-address=127.0.0.1:{port}")
    with (folder / "prometheus.log").open("wb") as log:
        process = subprocess.Popen([program, *options], cwd=folder, stdout=log, stderr=log)
        try:
            url = f"http://127.0.0.1:{port}/api/v1"
            cell.goes_on(3)
            until(lambda: answers(url, "sum(increase(combtrace_jobs_total[10s])) > 0"), 120, "jobs at Prometheus")
            yield url
        finally:
            process.terminate()
            process.wait(30)
            cell.stop()


def answers(url: str, expression: str) -> list[Any]:
    """What Prometheus answers; nothing while it is starting."""
    query = urllib.parse.urlencode({"query": expression})
    try:
        with urllib.request.urlopen(f"{url}/query?{query}", timeout=BOUND_S) as reply:
            told = json.load(reply)
    except ConnectionRefusedError:
        return []
    except urllib.error.HTTPError as error:
        if error.code == 503:
            return []
        raise
    except urllib.error.URLError as error:
        if isinstance(error.reason, ConnectionRefusedError):
            return []
        raise
    assert told["status"] == "success"
    return list(told["data"]["result"])


def test_a_real_prometheus_answers_every_question_of_a_daemon_at_work(prometheus: str) -> None:
    def silent() -> set[str]:
        return {title for title, expression in QUESTIONS if not answers(prometheus, asked(expression))} - UNANSWERED

    until(lambda: not silent(), 60, "an answer to each")
    assert silent() == set()


def test_the_questions_name_only_what_the_daemon_serves(prometheus: str) -> None:
    with urllib.request.urlopen(f"{prometheus}/label/__name__/values", timeout=BOUND_S) as reply:
        served = set(json.load(reply)["data"])
    named = {name for _, expression in QUESTIONS for name in NAME.findall(expression)}
    assert len(named) > 18
    assert named - served - {"combtrace_calibration_age_seconds"} == set()
