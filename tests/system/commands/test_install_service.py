"""`combtrace install-service`, and what systemd's own tools say of what it writes."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from tests.support.processes.processes import called, combtrace
from tests.support.real_parts import missing, need_program

COMMAND = Path(sys.executable).parent / "combtrace"
MOST_EXPOSED = 22  # tenths of what systemd-analyze counts as exposed; without hardening it is 96


def test_systemd_accepts_the_unit_and_finds_it_hardened(tmp_path: Path) -> None:
    analyze = need_program("systemd-analyze", "apt-get install systemd")
    (tmp_path / "two words 100%").mkdir()
    for config in (Path("/etc/combtrace/config.yaml"), tmp_path / "two words 100%" / "config.yaml"):
        if config.is_relative_to(tmp_path):
            config.write_text("camera: {kind: files, path: .}\ncontroller: {kind: none}\ntriggers: []\n")
        printed = called("install-service", "--print", "--config", config)
        assert printed.returncode == 0, printed.stderr
        unit = tmp_path / "combtrace.service"
        unit.write_text(printed.stdout)
        for command in (("verify",), ("security", "--offline=yes", f"--threshold={MOST_EXPOSED}")):
            done = subprocess.run([analyze, *command, unit], capture_output=True, text=True, check=False)
            assert done.returncode == 0, done.stdout + done.stderr
            assert "verify" not in command or not done.stderr, done.stderr


def test_systemd_refuses_a_unit_that_was_spoiled(tmp_path: Path) -> None:
    """So that the test above can fail."""
    analyze = need_program("systemd-analyze", "apt-get install systemd")
    unit = tmp_path / "combtrace.service"
    unit.write_text(called("install-service", "--print").stdout.replace("WatchdogSec=60", "WatchdogSeconds=60"))
    done = subprocess.run([analyze, "verify", unit], capture_output=True, text=True, check=False)
    assert "WatchdogSeconds" in done.stderr


def udev_says(rules: Path) -> str:
    """What udev's own reader says of the rules in a folder; nothing where all are sound."""
    udevadm = need_program("udevadm", "apt-get install udev")
    verify = subprocess.run(
        [udevadm, "verify", "--no-summary", *rules.iterdir()], capture_output=True, text=True, check=False
    )
    if "Unknown command" not in verify.stderr:  # from systemd 254 on
        return verify.stderr + verify.stdout
    # Before, only `test` reads rules, where the machine keeps them: in a namespace whose /etc/udev, /run and /dev are
    # empty folders of its own, so that it takes neither root nor what a machine has there, and changes nothing.
    script = (
        'mount -t tmpfs tmpfs /etc/udev && cp -r "$1" /etc/udev/rules.d && mount -t tmpfs tmpfs /run '
        "&& mount -t tmpfs tmpfs /dev || exit 77; udevadm test /sys/class/mem/null"
    )
    done = subprocess.run(
        ["unshare", "--map-root-user", "--mount", "sh", "-c", script, "sh", rules],
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode == 77 or done.stderr.startswith("unshare:"):
        missing(f"this udevadm has no verify, and mount namespaces are not allowed here: {done.stderr.strip()}")
    read = [line for line in done.stderr.splitlines() if "rules.d/70-combtrace.rules" in line]
    assert any(line.startswith("Reading rules file") for line in read), done.stderr
    return "\n".join(line for line in read if not line.startswith("Reading rules file"))


def test_udev_accepts_the_rules(tmp_path: Path) -> None:
    rules = tmp_path / "rules"
    rules.mkdir()
    printed = called("install-service", "--print", "udev")
    file = rules / "70-combtrace.rules"
    file.write_text(printed.stdout)
    assert udev_says(rules) == ""
    file.write_text(printed.stdout.replace("SUBSYSTEMS==", "SUBSISTEMS=="))
    assert "SUBSISTEMS" in udev_says(rules)


def test_files_are_written_below_the_root_and_the_next_steps_are_told(tmp_path: Path) -> None:
    (tmp_path / "config.yaml").write_text("camera: {kind: files, path: .}\ncontroller: {kind: none}\ntriggers: []\n")
    done = called("install-service", "--root", tmp_path / "root", "--config", tmp_path / "config.yaml")
    assert done.returncode == 0, done.stderr
    unit = (tmp_path / "root/etc/systemd/system/combtrace.service").read_text()
    assert f"ExecStart={COMMAND} run --config {tmp_path}/config.yaml" in unit
    assert (tmp_path / "root/etc/udev/rules.d/70-combtrace.rules").exists()
    assert f"install -d -o combtrace -g combtrace -m 0750 {tmp_path}/var\n" in done.stdout
    assert done.stdout.endswith("systemctl enable --now combtrace\n")


def test_a_bad_configuration_or_user_is_told_and_nothing_is_written(tmp_path: Path) -> None:
    (tmp_path / "config.yaml").write_text("colour: red\n")
    bad = called("install-service", "--root", tmp_path / "root", "--config", tmp_path / "config.yaml")
    assert (bad.returncode, "colour: unknown key" in bad.stderr) == (2, True)
    bad = called("install-service", "--root", tmp_path / "root", "--user", "Anna Maria")
    assert (bad.returncode, "expected a name" in bad.stderr) == (2, True)
    assert not (tmp_path / "root").exists()


def test_what_cannot_be_written_is_told_with_the_next_step(tmp_path: Path) -> None:
    (tmp_path / "etc").write_text("a file where a folder is needed")
    done = combtrace("install-service", "--root", tmp_path)
    assert (done.returncode, "Run it with sudo, or with --print" in done.stderr) == (1, True)
