"""status, halt, resume and reset at a running daemon, over its local socket."""

from __future__ import annotations

import json
import os
import socket
import stat
from collections.abc import Iterator
from pathlib import Path

import pytest
from pymodbus.client import ModbusTcpClient

from service.daemon.control import ask
from tests.support.nobody import needs_root, python_as_nobody
from tests.support.processes.cell import Cell
from tests.support.processes.processes import called, combtrace, until
from tests.support.processes.terminal import Terminal

SERVICE_BLOCK, OWNER = 16, 11


@pytest.fixture
def terminal() -> Iterator[Terminal]:
    opened = Terminal()
    yield opened
    opened.close()


@pytest.fixture
def cell(tmp_path: Path, terminal: Terminal) -> Iterator[Cell]:
    started = Cell(tmp_path, triggers=f"[{{kind: serial, port: {terminal.name}}}]", trigger_every_s=None)
    try:
        started.ready()
        yield started
    finally:
        started.stop()


@pytest.fixture(scope="module")
def lasting(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cell]:
    """One for all tests that leave it ready."""
    started = Cell(tmp_path_factory.mktemp("cell"), triggers="[]", trigger_every_s=None)
    try:
        started.ready()
        yield started
    finally:
        started.stop()


def state_of(cell: Cell) -> str:
    return str(ask(cell.folder / "state", {"command": "status"})["state"])


def connected(cell: Cell) -> socket.socket:
    """A client of the control socket, however deep the test's folder lies: addresses hold 107 bytes."""
    client = socket.socket(socket.AF_UNIX)
    client.settimeout(60)
    folder = os.open(cell.folder / "state", os.O_PATH)
    client.connect(f"/proc/self/fd/{folder}/control.sock")
    os.close(folder)
    return client


def test_a_halt_holds_over_a_restart_until_it_is_resumed(cell: Cell, terminal: Terminal) -> None:
    config = ("--config", cell.folder / "config.yaml")
    halted = called("halt", *config, "--reason", "blade is being changed")
    assert (halted.returncode, halted.stdout) == (0, "state Halted\n"), halted.stderr
    terminal.type(b"TRIG\nSTAT\n")
    assert [terminal.line(), terminal.line()] == ["NAK 121 not_ready", "STAT Halted 0 0 1 0 ok"]
    cell.service.kill()
    cell.service = cell.start_service()
    until(lambda: cell.service.text.count("-> Halted") == 2, what="Halted again")
    until(lambda: "state     Halted" in called("status", *config).stdout, what="a daemon that answers")
    status = called("status", *config)
    assert status.returncode == 1
    assert "blade is being changed" in status.stdout
    resumed = called("resume", *config)
    assert resumed.returncode == 0, resumed.stderr
    until(lambda: state_of(cell) == "Ready", what="Ready")
    again = called("resume", *config)
    assert (again.returncode, "nothing to resume" in again.stderr) == (1, True)
    terminal.type(b"TRIG\n")
    job = terminal.acknowledged()
    assert terminal.line().startswith(f"DONE {job} ")
    told = json.loads(called("status", *config, "--json").stdout)
    assert (told["state"], told["service_state"], told["settled_job"]) == ("Ready", 5, job)
    assert told["last_job"]["outcome"] == "accepted"
    assert {"kind": "serial", "what": "taken", "count": 1} in told["triggers"]


def test_a_halt_is_done_whatever_its_reason_holds(lasting: Cell) -> None:
    config = ("--config", lasting.folder / "config.yaml")
    for given, told in (
        (b"Messer gewechselt \xfc", "Messer gewechselt \\udcfc"),
        ("нож\n\tменяют\x1b[31m".encode(), "нож меняют?[31m"),
        (b"x" * 5000, "x" * 200),
    ):
        halted = called("halt", *config, "--reason", os.fsdecode(given))
        assert (halted.returncode, halted.stdout) == (0, "state Halted\n"), halted.stderr
        status = json.loads(called("status", *config, "--json").stdout)
        assert status["reason"].startswith(f"halted: {told} (")
        assert called("resume", *config).returncode == 0
    with connected(lasting) as client:
        client.sendall(b'{"command": "halt", "reason": "\\udce4"}\n')
        assert json.loads(client.makefile("rb").readline()) == {"ok": True, "state": "Halted"}
    assert "udce4" in combtrace("status", *config).stdout
    assert called("resume", *config).returncode == 0


def test_a_reset_opens_everything_anew(cell: Cell, terminal: Terminal) -> None:
    reset = called("reset", "--config", cell.folder / "config.yaml")
    assert reset.returncode == 0, reset.stderr
    assert "Ready -> Preoperational" in cell.service.text
    until(lambda: state_of(cell) == "Ready", what="Ready")
    terminal.type(b"TRIG\n")
    job = terminal.acknowledged()
    assert terminal.line().startswith(f"DONE {job} ")


def test_after_another_service_only_a_persons_word_has_the_daemon_go_on(cell: Cell, terminal: Terminal) -> None:
    config = ("--config", cell.folder / "config.yaml")
    nothing = called("confirm", *config)
    assert (nothing.returncode, "nothing waits for a person's word" in nothing.stderr) == (1, True)
    with ModbusTcpClient("127.0.0.1", port=cell.port) as another:
        block = another.read_holding_registers(SERVICE_BLOCK, count=16, device_id=1).registers
        block[OWNER] ^= 1

        def seen() -> bool:
            # As a service does, again and again: the daemon may have been about to write its own.
            assert not another.write_registers(SERVICE_BLOCK, block, device_id=1).isError()
            return state_of(cell) == "Error"

        until(seen, what="Error")
        assert "another service" in called("status", *config).stdout
        found = another.read_holding_registers(SERVICE_BLOCK, count=16, device_id=1).registers
        assert found == block, "nothing is written over it"
    confirmed = called("confirm", *config)
    assert (confirmed.returncode, "watched anew" in confirmed.stdout) == (0, True), confirmed.stderr
    until(lambda: state_of(cell) == "Ready", what="Ready")
    terminal.type(b"TRIG\n")
    job = terminal.acknowledged()
    assert terminal.line().startswith(f"DONE {job} ")


@pytest.mark.parametrize("content", ["triggers: [", "service: {state_dir: state}\ntriggers: 7\ncolour: red\n"])
def test_a_daemon_can_be_halted_while_its_configuration_is_being_written(cell: Cell, content: str) -> None:
    config = cell.folder / "config.yaml"
    config.write_text(content)
    if content.endswith("["):  # not even YAML: nothing says where it keeps its state
        lost = called("halt", "--config", config)
        assert (lost.returncode, "--state-dir" in lost.stderr) == (2, True)
        halted = called("halt", "--state-dir", cell.folder / "state")
    else:
        halted = called("halt", "--config", config)
    assert (halted.returncode, halted.stdout) == (0, "state Halted\n"), halted.stderr


def test_the_socket_is_the_owners_and_groups_and_serves_several_and_odd_clients(lasting: Cell) -> None:
    path = lasting.folder / "state" / "control.sock"
    assert stat.S_IMODE(path.stat().st_mode) == 0o660
    clients = [connected(lasting) for _ in range(3)]
    for line, expected in (
        (b"\x00\xff no json\n", "no line of JSON"),
        (b'{"command": "explode"}\n', "expected one of confirm, end, halt, reset, resume, status, trigger"),
        (b'["status"]\n', "expected one of"),
    ):
        clients[0].sendall(line)
        answer = json.loads(clients[0].makefile("rb").readline())
        assert not answer["ok"]
        assert expected in answer["error"]
    clients[1].sendall(b"x" * 10_000)
    assert b"beyond 4096 bytes" in clients[1].makefile("rb").readline()
    clients[2].sendall(b'{"command": "status"}\n{"command": "status"}\n')
    answers = clients[2].makefile("rb")
    assert [json.loads(answers.readline())["state"] for _ in range(2)] == ["Ready", "Ready"]
    for client in clients:
        client.close()
    assert state_of(lasting) == "Ready"


def test_a_dead_daemons_socket_is_told_and_taken_over(cell: Cell) -> None:
    cell.service.kill()
    assert (cell.folder / "state" / "control.sock").exists()
    status = called("status", "--config", cell.folder / "config.yaml")
    assert status.returncode == 1
    assert "no daemon listens" in status.stderr
    cell.service = cell.start_service()
    until(lambda: cell.service.text.count("-> Ready") == 2, what="Ready")
    assert state_of(cell) == "Ready"
    cell.service.stop()
    assert not (cell.folder / "state" / "control.sock").exists()


@needs_root
def test_without_rights_the_error_says_who_may(lasting: Cell) -> None:
    lasting.folder.chmod(0o755)
    done = python_as_nobody(
        # By its descriptor: pytest's own folders are closed to others.
        "import os; from pathlib import Path; from service.daemon.control import ControlError, ask\n"
        "state = Path('/proc/self/fd') / str(os.open(sys.argv[1], os.O_PATH))",
        "try:\n    print(ask(state, {'command': 'halt'}))\nexcept ControlError as error:\n    print(error)",
        lasting.folder / "state",
    )
    assert "you may not use it. User root and group root may" in done.stdout, done.stderr
    assert state_of(lasting) == "Ready"
