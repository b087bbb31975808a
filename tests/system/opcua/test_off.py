"""Without `opcua` in the configuration there is nothing of it; where it cannot be served, jobs go on."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

from tests.support.pictures.combs import write_combs
from tests.support.processes.processes import BOUND_S, ENVIRONMENT, Process, free_port, until

PROGRAM = """
import json, sys, threading
from service.cli.main import main
main(sys.argv[1:])
ours = [name for name in sys.modules if name.split(".")[0] in ("asyncua", "cryptography") or "opcua" in name]
print(json.dumps([ours, [thread.name for thread in threading.enumerate()]]))
"""


def test_a_daemon_without_it_imports_nothing_of_it_and_has_no_thread_for_it(tmp_path: Path) -> None:
    combs = write_combs(tmp_path / "combs")
    config = tmp_path / "config.yaml"
    config.write_text(
        f"camera: {{kind: files, path: {combs}}}\ncalibration: {{file: combs.yaml}}\ncontroller: {{kind: none}}\n"
        "service: {state_dir: state}\njournal: {path: journal.sqlite}\narchive: {path: archive}\n"
    )
    command = [sys.executable, "-c", PROGRAM, "run", "--once", "--config", str(config)]
    done = subprocess.run(command, capture_output=True, text=True, env=ENVIRONMENT, timeout=BOUND_S, check=False)
    modules, threads = json.loads(done.stdout.splitlines()[-1])
    assert (modules, [name for name in threads if "opcua" in name]) == ([], [])
    assert "written" in done.stderr, "a job was done"
    assert not (tmp_path / "state" / "opcua").exists()


def test_what_keeps_opcua_from_being_served_keeps_no_job(tmp_path: Path) -> None:
    combs, port = write_combs(tmp_path / "combs"), free_port()
    (tmp_path / "state").mkdir()
    (tmp_path / "state" / "opcua").write_text("where its folder should be")
    config = tmp_path / "config.yaml"
    config.write_text(
        f"camera: {{kind: files, path: {combs}, loop: true}}\ncalibration: {{file: combs.yaml}}\n"
        "controller: {kind: none}\ntriggers: [{kind: interval, period_s: 0.2}]\n"
        f"service: {{state_dir: state}}\njournal: {{path: journal.sqlite}}\nopcua: {{port: {port}}}\n"
    )
    process = Process(tmp_path / "log", "run", "--config", config)
    try:
        until(lambda: "opcua: not served, tried again in 10 s" in process.text, what="the warning")
        until(lambda: "written" in process.text.partition("not served")[2], what="a job after it")
        assert "no folders can be made there" in process.text
        assert "-> Error" not in process.text
    finally:
        assert process.stop() == 0
