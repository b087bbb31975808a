"""Without `opcua` in the configuration there is nothing of it: no module, no thread, no folder."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

from tests.support.pictures.combs import write_combs
from tests.support.processes.processes import ENVIRONMENT

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
    done = subprocess.run(command, capture_output=True, text=True, env=ENVIRONMENT, timeout=60, check=False)
    modules, threads = json.loads(done.stdout.splitlines()[-1])
    assert (modules, [name for name in threads if "opcua" in name]) == ([], [])
    assert "written" in done.stderr, "a job was done"
    assert not (tmp_path / "state" / "opcua").exists()
