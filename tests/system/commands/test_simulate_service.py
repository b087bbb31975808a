"""`combtrace simulate-service` as a process, against controllers of three makes on real sockets."""

from __future__ import annotations

import json
import re
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest
from pymodbus.client import ModbusTcpClient

from tests.support.controller.protocol_decoder import decode_contour
from tests.support.controller.scanned_server import scanned_server
from tests.support.interop.programs import libmodbus_tcp
from tests.support.processes.processes import BOUND_S, Process, combtrace, free_port, jobs, lines, until

ROOT = Path(__file__).parents[3]
sys.path.insert(0, str(ROOT / "controllers" / "linuxcnc"))
import mailbox as bridge  # noqa: E402

RECTANGLE = [[0, 0], [100, 0], [100, 50], [0, 50]]
FROM_NO_CAMERA, LAST_PAGE, ALIGNED = 1, 4, 8


def once(folder: Path, port: int, *options: str | Path):
    return combtrace("simulate-service", "--controller", f"127.0.0.1:{port}", "--once", "--state", folder, *options)


@contextmanager
def simulated_controller(folder: Path, *options: str):
    """The product's own simulated controller, and its port."""
    port = free_port()
    process = Process(
        folder / "controller.log",
        *("simulate-controller", "--tcp", f"127.0.0.1:{port}", "--log", folder / "accepted.jsonl"),
        *("--verdict", folder / "verdict.json", *options),
    )
    try:
        until(lambda: "simulated controller on" in process.text, what="the controller")
        yield port
    finally:
        process.stop()


@contextmanager
def linuxcnc_mailbox(folder: Path):
    """The mailbox of the LinuxCNC bridge, which shares no line with ours: its port, and what it took."""
    taken: list[bridge.Contour] = []
    mailbox = bridge.Mailbox(bridge.Memory(str(folder / "memory.json")), lambda _: bridge.ACCEPTED, taken.append)
    mailbox.set_state(bridge.READY_STATE)
    with scanned_server(mailbox, mailbox.scan) as port:
        yield port, taken


def test_a_controller_that_asks_gets_shape_after_shape_or_a_reason(tmp_path):
    with simulated_controller(tmp_path, "--trigger-every", "0.1") as port:
        service = Process(
            tmp_path / "service.log",
            *("simulate-service", "--controller", f"127.0.0.1:{port}", "--state", tmp_path / "state"),
            *("--shape", "holes", "--shape", "gear", "--shape", "crossing", "--aligned"),
        )
        try:
            until(lambda: len(lines(tmp_path / "accepted.jsonl")) >= 4, what="four accepted contours")
        finally:
            assert service.stop() == 0
    accepted = lines(tmp_path / "accepted.jsonl")
    assert [len(contour["millimetres"]["exterior"]) for contour in accepted[:4]] == [4, 1500, 4, 1500]
    assert [len(contour["millimetres"]["holes"]) for contour in accepted[:2]] == [2, 0]
    assert all(contour["flags"] & (FROM_NO_CAMERA | ALIGNED) == FROM_NO_CAMERA | ALIGNED for contour in accepted)
    journal = jobs(tmp_path / "state" / "journal.sqlite")
    outcomes = [(job["outcome"], job["reason"]) for job in journal[:4]]
    assert outcomes == [("accepted", None), ("accepted", None), ("refused", 131), ("accepted", None)]
    verdict = json.loads((tmp_path / "verdict.json").read_text())
    assert verdict["clean"], verdict["violations"]
    told = service.text
    second, third = (job["job_id"] for job in journal[1:3])
    assert f"page 4 of 4 of job {second}: 1 rings, 1500 vertices" in told
    assert f"ack_result 1 (accepted), last_job {second}" in told
    assert f"reject_reason 131 (self_intersecting), settled_job {third}" in told


def test_a_controller_of_another_make_takes_the_contour_of_a_file_once(tmp_path):
    path = tmp_path / "contours.jsonl"
    path.write_text(json.dumps({"millimetres": {"exterior": RECTANGLE, "holes": []}, "uncertainty_mm": 0.4}) + "\n")
    with linuxcnc_mailbox(tmp_path) as (port, taken):
        done = once(tmp_path / "state", port, "--contours", path, "--registers")
        assert done.returncode == 0, done.stderr
        first = re.match(r"job (\d+) accepted: 4 vertices, 5000.0 mm²", done.stdout)
        assert first is not None
        again = once(tmp_path / "state", port, "--contours", path)
        second = re.match(r"job (\d+) accepted", again.stdout)
        assert second is not None
        assert int(second[1]) > int(first[1]) + 1000, "as at every start"
    assert [contour.rings for contour in taken] == [[[tuple(point) for point in RECTANGLE]]] * 2
    assert taken[0].uncertainty_mm == 0.4
    assert taken[0].flags == FROM_NO_CAMERA | LAST_PAGE
    assert f"33: 0001 0000 {int(first[1]):04X} 0001 0001 0001 0012" in done.stderr  # the header, word by word


def test_registers_that_a_stranger_serves_hold_the_contour_where_the_configuration_says(tmp_path):
    with libmodbus_tcp() as (_, port):
        (tmp_path / "config.yaml").write_text(
            "camera: {kind: files, path: none}\ncalibration: {file: none.yaml}\n"
            f"controller: {{kind: modbus-tcp, port: {port}, handshake: none, contour_address: 500, "
            "word_order: little}\n"
        )
        done = combtrace(
            *("simulate-service", "--config", tmp_path / "config.yaml", "--state", tmp_path / "state"),
            *("--once", "--shape", "rectangle", "--at", "-10", "5"),
        )
        assert done.returncode == 0, done.stderr
        assert re.match(r"job \d+ written", done.stdout)
        client = ModbusTcpClient("127.0.0.1", port=port, timeout=BOUND_S)
        assert client.connect()
        header = client.read_holding_registers(500, count=32).registers
        payload = client.read_holding_registers(532, count=header[7]).registers
        client.close()
    contour = decode_contour([(header, payload)], "little")
    assert contour.rings == (((-10_000, 5000), (90_000, 5000), (90_000, 55_000), (-10_000, 55_000)),)
    assert contour.header.flags == FROM_NO_CAMERA | LAST_PAGE


@pytest.mark.parametrize(
    ("options", "reason"), [(["--shape", "crossing"], "131 self_intersecting"), (["--contours"], "130 too_many_points")]
)
def test_a_contour_that_breaks_a_limit_is_refused_and_nothing_of_it_is_sent(tmp_path, options, reason):
    if "--contours" in options:
        stairs = [[x, y] for n in range(2100) for x, y in ((n, n), (n + 1, n))]
        (tmp_path / "many.json").write_text(json.dumps({"exterior": [*stairs, [0, 2100]]}))
        options = [*options, tmp_path / "many.json"]
    with simulated_controller(tmp_path) as port:
        done = once(tmp_path / "state", port, *options)
    assert done.returncode == 3
    assert re.match(rf"job \d+ refused: {reason}", done.stdout)
    assert "page 1" not in done.stderr
    assert lines(tmp_path / "accepted.jsonl") == []


def test_what_an_operator_refuses_is_told_as_refused(tmp_path):
    with simulated_controller(tmp_path, "--refuse") as port:
        done = once(tmp_path / "state", port)
    assert done.returncode == 3
    assert "151 controller_refused: answer 7 operator_refused" in done.stdout


def test_a_controller_that_is_not_there_fails_the_one_job(tmp_path):
    (tmp_path / "config.yaml").write_text(
        "camera: {kind: files, path: none}\ncalibration: {file: none.yaml}\n"
        f"controller: {{kind: modbus-tcp, port: {free_port()}, ready_timeout_s: 1}}\n"
    )
    done = combtrace("simulate-service", "--config", tmp_path / "config.yaml", "--once", "--state", tmp_path / "state")
    assert done.returncode == 1
    assert "not triggered: 121 not_ready" in done.stderr


@pytest.mark.parametrize(
    ("options", "why"),
    [
        (["--controller", "nowhere"], "expected HOST:PORT"),
        (["--controller", "a:1", "--layout", "1,2"], "expected four numbers"),
        (["--controller", "a:1", "--layout", "0,8,32,64"], "overlap"),
        (["--controller", "a:1", "--at", "nan", "0"], "less than 1 km"),
        (["--controller", "a:1", "--every", "0"], "period_s"),
        (["--controller", "a:1", "--contours", "nowhere.json"], "cannot be read"),
        (["--config", "nowhere.yaml"], "cannot be read"),
        (["--config", "observing.yaml", "--word-order", "big"], "belongs to --controller"),
        (["--config", "none.yaml"], "controller.kind is none"),
        (["--config", "mute.yaml"], "Give --every S or --once"),
    ],
)
def test_what_cannot_be_done_is_told_before_anything_is_sent(tmp_path, options, why):
    head = "camera: {kind: files, path: none}\ncalibration: {file: none.yaml}\ncontroller: "
    (tmp_path / "none.yaml").write_text(head + "{kind: none}\n")
    (tmp_path / "mute.yaml").write_text(head + "{kind: modbus-tcp, handshake: none}\n")
    (tmp_path / "observing.yaml").write_text(head + "{kind: modbus-tcp, mode: observe}\n")
    done = combtrace("simulate-service", *options, cwd=tmp_path)
    assert done.returncode == 2, done.stderr
    assert why in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "var").exists()
