"""The Debian packages in a clean machine without a network: installed, run under its systemd, upgraded, removed."""

from __future__ import annotations

import json
import os
import re
import shutil
import sqlite3
import subprocess
import zipfile
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from service.cli.main import COMMANDS
from service.commissioning.install_files import packaged
from tests.deb.clean_root import Machine, booted, made
from tests.support.processes.processes import ROOT, until

PACKAGES = Path(os.environ["COMBTRACE_DEB"]).resolve()
OLD = ROOT / "tests" / "upgrades" / "0.1.0"
PAGE = ROOT / "docs" / "how-to" / "install.md"
STATE, CONFIG = Path("/var/lib/combtrace"), Path("/etc/combtrace/config.yaml")
EARLIER = "0.1.9"
PORT = 15020


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made(tmp_path_factory.mktemp("clean"))


@pytest.fixture(scope="module")
def media(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What is carried to the machine: the packages, the same as an earlier version, and what a first version wrote."""
    folder = tmp_path_factory.mktemp("media")
    for package in PACKAGES.glob("*.deb"):
        shutil.copy(package, folder)
        tree = folder / "tree"
        subprocess.run(["dpkg-deb", "--raw-extract", package, tree], check=True)
        control = tree / "DEBIAN" / "control"
        control.write_text(control.read_text().replace(version(), EARLIER))
        name = package.name.replace(version(), EARLIER)
        (folder / "earlier").mkdir(exist_ok=True)
        subprocess.run(["dpkg-deb", "-Zzstd", "-z1", "--build", tree, folder / "earlier" / name], check=True)
        shutil.rmtree(tree)
    shutil.copytree(OLD, folder / "old")
    with closing(sqlite3.connect(folder / "old" / "journal.sqlite")) as database:
        database.executescript((OLD / "journal.sql").read_text(encoding="utf-8"))
    return folder


@pytest.fixture
def machine(root: Path, media: Path, tmp_path: Path) -> Iterator[Machine]:
    """A machine on a copy of the clean root, with the media in /media."""
    subprocess.run(["cp", "-a", root, tmp_path / "root"], check=True)
    with booted(tmp_path / "root", media) as running:
        yield running
    shutil.rmtree(tmp_path / "root")


def version() -> str:
    """Of the packages."""
    (core,) = PACKAGES.glob("combtrace_*.deb")
    return core.name.split("_")[1]


def commands_of_the_page() -> list[list[str]]:
    """The two commands of the page, as root gives them beside the packages."""
    (block,) = re.findall(r"^## Two commands\n.*?^```\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), re.M | re.S)
    return [["sh", "-c", f"cd /media && {line.removeprefix('sudo ')} --yes"] for line in block.splitlines()]


def jobs(machine: Machine) -> list[dict[str, object]]:
    return [json.loads(line) for line in machine.done("combtrace", "jobs", "--config", CONFIG, "--json").splitlines()]


def test_two_commands_install_run_upgrade_and_remove_it_without_a_network(machine: Machine) -> None:
    install, remove = commands_of_the_page()
    assert not machine.tried("cat", "/proc/net/route").stdout.splitlines()[1:], "no network"
    machine.done(*install)
    assert machine.done("combtrace", "--version") == f"combtrace {version()}"
    assert machine.done("systemctl", "is-enabled", "combtrace") == "enabled"
    until(lambda: machine.done("systemctl", "show", "-P", "StatusText", "combtrace") == "Ready", what="Ready")
    assert machine.done("combtrace", "trigger", "--config", CONFIG).splitlines()[1].startswith("DONE 1 ")
    machine.done("combtrace", "check", "--config", CONFIG)
    is_closed(machine)

    machine.done("sh", "-c", f"echo '# ours' >> {CONFIG}; echo ours > {CONFIG.parent}/calibration.yaml")
    machine.done(*install)  # the same again
    machine.done(*remove)
    assert machine.tried("systemctl", "is-active", "combtrace").stdout.strip() == "inactive"
    assert machine.tried("test", "-e", "/opt/combtrace").returncode == 1
    kept = ("journal.sqlite", "archive/0000000xxx/1-frame.png", "archive/0000000xxx/1-written.json")
    machine.done("ls", *(STATE / name for name in kept), CONFIG.parent / "calibration.yaml")
    assert "# ours" in machine.done("cat", CONFIG)
    machine.done("apt-get", "purge", "--yes", "combtrace")
    machine.done("ls", *(STATE / name for name in kept), CONFIG.parent / "calibration.yaml")
    assert machine.tried("test", "-e", CONFIG).returncode == 1


def is_closed(machine: Machine) -> None:
    """The daemon runs under its unit's hardening: the machine's own systemd has applied it."""
    assert (
        machine.done("cat", "/lib/systemd/system/combtrace.service") == packaged()["systemd/combtrace.service"].strip()
    )
    main = machine.done("systemctl", "show", "-P", "MainPID", "combtrace")
    status = dict(line.split(":\t", 1) for line in machine.done("cat", f"/proc/{main}/status").splitlines())
    assert status["Uid"].split()[0] == machine.done("id", "-u", "combtrace") != "0"
    assert {int(status[name], 16) for name in ("CapEff", "CapPrm", "CapBnd", "CapAmb")} == {0}
    assert (status["NoNewPrivs"], status["Seccomp"]) == ("1", "2")
    for folder, writable in (("/etc/combtrace", False), ("/opt/combtrace", False), (STATE, True)):
        command = ("nsenter", "--target", main, "--mount", "--root", "touch", f"{folder}/tried")
        assert (machine.tried(*command).returncode == 0) is writable, folder


def test_what_the_first_version_left_is_taken_on_by_an_upgrade_and_a_downgrade_is_refused(machine: Machine) -> None:
    machine.done("sh", "-c", "apt-get install --yes /media/earlier/*.deb")
    machine.done("systemctl", "stop", "combtrace")
    machine.done(
        *("sh", "-c"),
        f"cd /media/old && rm -rf {STATE}/* && cp -r archive journal.sqlite {STATE} && chown -R combtrace: {STATE}"
        f" && cp -r config.yaml calibration.yaml pictures {CONFIG.parent}"
        f" && sed -i 's|var/|{STATE}/|; s|state_dir: var|state_dir: {STATE}|' {CONFIG} && cp controller.json /run",
    )
    told = machine.done("cat", CONFIG)
    controller = machine.process(
        *("combtrace", "simulate-controller", "--tcp", f"127.0.0.1:{PORT}", "--trigger-every", "1"),
        *("--memory", "/run/controller.json"),
    )
    machine.done(*commands_of_the_page()[0])
    assert machine.done("cat", CONFIG) == told
    until(lambda: len(jobs(machine)) >= 5, what="a job after the one in flight")
    machine.done("systemctl", "stop", "combtrace")
    controller.terminate()
    controller.wait()
    found = {job["job_id"]: job["outcome"] for job in jobs(machine)}
    assert [found[number] for number in (1, 2, 3, 4)] == ["accepted", "refused", "refused", "accepted"]
    assert "job 4 was in flight when the service ended" in machine.log()

    refused = machine.tried("sh", "-c", "apt-get install --yes --allow-downgrades /media/earlier/*.deb")
    assert refused.returncode != 0
    assert "Downgrade refused. To go back: apt remove combtrace" in refused.stdout + refused.stderr
    assert machine.done("combtrace", "--version") == f"combtrace {version()}"


def test_the_sbom_names_what_is_installed_and_every_file_is_as_its_maker_noted(machine: Machine) -> None:
    for package in ("combtrace", "combtrace-extras"):
        machine.done("sh", "-c", f"apt-get install --yes --no-install-recommends /media/{package}_*.deb")
        document = json.loads(machine.done("cat", f"/usr/share/doc/{package}/sbom.cdx.json"))
        named = {(part["name"].lower(), part["version"]) for part in document["components"]}
        listed = machine.done("/opt/combtrace/bin/python3", "-c", LIST)
        installed = {tuple(line.split()) for line in listed.splitlines()}
        assert named == installed
        assert all(part["licenses"] for part in document["components"])
        libraries = machine.done("sh", "-c", "ls /opt/combtrace/lib/python3*/site-packages/*.libs/*.so*")
        inside = [one for part in document["components"] for one in part.get("components", [])]
        assert len(inside) == len(libraries.splitlines())
    assert machine.done("/opt/combtrace/bin/python3", "-c", VERIFY) == ""
    assert "Copyright" in machine.done("cat", "/usr/share/doc/combtrace/copyright")


LIST = """
from importlib.metadata import distributions
for one in distributions():
    print(one.name.lower(), one.version)
"""
VERIFY = """
from base64 import urlsafe_b64encode
from hashlib import sha256
from importlib.metadata import distributions
for file in (file for one in distributions() for file in one.files if file.hash):
    if urlsafe_b64encode(sha256(file.read_binary()).digest()).rstrip(b"=").decode() != file.hash.value:
        print(file)
"""


def test_there_is_a_manual_page_a_command_and_completion(media: Path) -> None:
    (core,) = media.glob("combtrace_*.deb")
    listed = subprocess.run(["dpkg-deb", "--contents", core], capture_output=True, text=True, check=True).stdout
    for command in COMMANDS:
        assert f"./usr/share/man/man1/combtrace-{command}.1.gz\n" in listed
    for file in (
        "./usr/share/man/man1/combtrace.1.gz",
        "./usr/share/bash-completion/completions/combtrace",
        "./usr/share/zsh/vendor-completions/_combtrace",
        "./usr/share/fish/vendor_completions.d/combtrace.fish",
        "./lib/udev/rules.d/70-combtrace.rules",
        "./usr/lib/sysctl.d/70-combtrace.conf",
    ):
        assert f"{file}\n" in listed


def test_a_dependency_with_another_hash_is_refused_and_nothing_is_installed(tmp_path: Path) -> None:
    wheels = tmp_path / "wheelhouse"
    made = subprocess.run(
        ["sh", ROOT / "packaging" / "wheelhouse.sh", wheels], capture_output=True, text=True, check=False
    )
    assert made.returncode == 0, made.stderr
    install = ["unshare", "--net", "sh", wheels / "install.sh"]
    sound = subprocess.run([*install, tmp_path / "sound"], capture_output=True, text=True, check=False)
    assert sound.stdout.endswith(f"combtrace {version()}\n"), sound.stderr
    (changed,) = wheels.glob("pyserial-*.whl")
    with zipfile.ZipFile(changed, "a") as wheel:
        wheel.writestr("serial/not_theirs.py", "")
    refused = subprocess.run([*install, tmp_path / "bad"], capture_output=True, text=True, check=False)
    assert refused.returncode != 0
    assert "DO NOT MATCH THE HASHES" in refused.stderr
    assert not list(tmp_path.glob("bad/lib/python3*/site-packages/numpy"))
