"""The tutorial, played as it stands: its commands in their order, those that go on until Ctrl-C in the background."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pytest

from tests.support.processes.processes import ENVIRONMENT, ROOT, free_port

PAGE = ROOT / "docs" / "tutorial" / "first-block.md"
SHOWN_FIRST = "make demo\n. .venv/bin/activate\n"
"""What the page has done before; the demo has tests of its own."""
UNTIL_IT_LISTENS = "until grep -q 'simulated controller on' simulate-controller.log; do sleep 0.1; done"
UNTIL_READY = "until grep -q -e '-> Ready' run.log; do sleep 0.1; done"
UNTIL_ARCHIVED = "until ls var/archive/*/*-accepted.json > /dev/null 2>&1; do sleep 0.1; done"
BOUND_S = 300


def as_script(page: str, port: int) -> str:
    """The page's commands and its configuration, for one shell; where a reader waits and looks, it waits too."""
    steps = ["set -e", "trap 'kill $(jobs -p); wait' EXIT"]
    for language, block in re.findall(r"^```(sh|yaml)\n(.*?)^```$", page.replace("5020", str(port)), re.M | re.S):
        if language == "yaml":
            steps.append(f"cat > cell.yaml <<'END'\n{block}END")
            continue
        for command in block.splitlines():
            if command.startswith("combtrace simulate-controller"):
                steps += [f"{command} > simulate-controller.log 2>&1 &", UNTIL_IT_LISTENS]
            elif command.startswith("combtrace run"):
                steps += [f"{command} > run.log 2>&1 &", UNTIL_READY]
            elif command.startswith("combtrace replay"):
                steps += [UNTIL_ARCHIVED, command]
            else:
                steps.append(command)
    return "\n".join(steps)


@pytest.fixture
def source_tree(tmp_path: Path) -> Path:
    """A folder that looks as the source tree does to the page's commands, with `combtrace` as a command."""
    (tmp_path / "samples").symlink_to(ROOT / "service" / "samples")
    command = tmp_path / "bin" / "combtrace"
    command.parent.mkdir()
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m service.cli.main "$@"\n')
    command.chmod(0o755)
    return tmp_path


def test_the_tutorial_comes_to_an_accepted_block_and_a_verdict_that_flips(source_tree: Path) -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert SHOWN_FIRST in page
    environment = {**ENVIRONMENT, "PATH": f"{source_tree / 'bin'}:{os.environ['PATH']}"}
    process = subprocess.Popen(
        ["bash", "-c", as_script(page, free_port())],
        cwd=source_tree,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    try:
        told, _ = process.communicate(timeout=BOUND_S)
    finally:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
    assert process.returncode == 0, told
    assert "FAULT" not in told
    assert re.search(r"^DONE \d+ 9 \d+$", told, re.MULTILINE)
    assert "1 jobs, 1 verdicts flip: 1 sent -> refused" in told
    folder = source_tree / "first"
    assert (folder / "seen.png").exists()
    assert (folder / "mine.dxf").exists()
    accepted = [json.loads(line) for line in (folder / "accepted.jsonl").read_text().splitlines()]
    assert [len(contour["millimetres"]["exterior"]) for contour in accepted] == [9]
    assert json.loads((folder / "verdict.json").read_text())["clean"]
