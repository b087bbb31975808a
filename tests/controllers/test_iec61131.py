"""The Structured Text mailbox, run on golden vectors, behind a Modbus server, and against our own service."""

from __future__ import annotations

import json
import subprocess
import sys
import threading
import time
import zlib
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.support.controller.scanned_server import scanned_server
from tests.support.processes.processes import combtrace
from tests.support.structured_text import Program, StructuredTextError, compiled

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "controllers" / "iec61131"
TEXT = (FOLDER / "combtrace.st").read_text(encoding="utf-8")
VECTORS = json.loads((ROOT / "docs" / "reference" / "golden-vectors.json").read_text(encoding="utf-8"))
sys.path.insert(0, str(FOLDER))
from golden_vectors import program  # noqa: E402

ACCEPTED, BAD_CRC, BAD_LAYOUT, GEOMETRY, EXPIRED, BEFORE, OPERATOR, OUTDATED, MISSING, NOT_READY, WITHDRAWN = range(
    1, 12
)
EVERYTHING = {"take_simulated": 1, "take_unaligned": 1, "low_x": -(2**31), "low_y": -(2**31)}


class Plc:
    """A controller's program that does nothing but call the block, on registers of its own."""

    def __init__(self, vector=None, block=None):
        self.block = block or compiled(TEXT).block("CT_MAILBOX")
        self.registers = [0] * 2048
        self.inputs = {"state": 1, "now_ms": 10, "seed": 4711}
        self.accepted = 0
        self.lock = threading.Lock()
        if vector is not None:  # the session and the trigger that the vector was made for
            self.block.session = (vector["session"] - 2) % 65535 + 1
            self.block.trigger_counter = vector.get("trigger", 0)
            self.inputs |= {
                "now_ms": vector.get("captured_at", 0) + 10,
                "little": int(vector["word_order"] == "little"),
            }
        self.scan(2)

    def scan(self, count=1):
        for _ in range(count):
            self.block.scan(reg=self.registers, **self.inputs)
            self.accepted += self.block.accepted

    def write(self, start, words):
        """Registers as a Modbus server writes them."""
        with self.lock:
            self.registers[start : start + len(words)] = list(words)

    def send(self, page, transfer):
        """Write a page, scan until it is answered, and give the answer."""
        words = [transfer, *page["header"], *page["payload"]]
        self.registers[32 : 32 + len(words)] = words
        for _ in range(100):
            self.scan()
            if self.registers[6] == transfer:
                return self.registers[7]
        raise AssertionError("no answer in 100 scans")

    @property
    def last_job(self):
        high, low = self.registers[10:12] if not self.inputs.get("little") else self.registers[11:9:-1]
        return high << 16 | low

    def rings(self):
        """The contour that the block holds, µm."""
        block, place, rings = self.block, self.block.ring_count, []
        for ring in range(block.ring_count):
            count = block.value[ring]
            values = block.value[place : place + 2 * count]
            rings.append([list(pair) for pair in zip(values[::2], values[1::2], strict=True)])
            place += 2 * count
        return rings


def worked_example():
    """The vector of the protocol's page, and a controller for it that takes all kinds of contours."""
    plc = Plc(VECTORS["contours"][0])
    plc.inputs |= EVERYTHING
    return VECTORS["contours"][0]["pages"][0], plc


@pytest.mark.parametrize("vector", VECTORS["contours"], ids=lambda v: f"{v['name'][:30]}-{v['word_order']}")
def test_every_golden_contour_arrives_as_it_was_written(vector):
    plc = Plc(vector)
    plc.inputs |= EVERYTHING
    answers = [plc.send(page, number) for number, page in enumerate(vector["pages"], 1)]
    assert answers == [ACCEPTED] * len(answers)
    assert plc.accepted == 1
    assert plc.rings() == [vector["exterior"], *vector["holes"]]
    block = plc.block
    sure = 2**32 - 1 if vector["uncertainty"] is None else vector["uncertainty"]
    assert (block.job_id, block.area, block.uncertainty) == (vector["job_id"], vector["area"], sure)
    assert (block.recipe, block.captured_at, block.valid_for) == (
        vector["recipe"],
        vector["captured_at"],
        vector["valid_for"],
    )
    assert (plc.last_job, plc.registers[12]) == (vector["job_id"], ACCEPTED)
    assert plc.send(vector["pages"][-1], 77) == BEFORE
    assert plc.accepted == 1


@pytest.mark.parametrize("vector", VECTORS["withdrawals"], ids=lambda v: f"{v['job_id']}-{v['word_order']}")
def test_every_golden_withdrawal_ends_its_job(vector):
    plc = Plc(vector)
    assert plc.send(vector, 1) == WITHDRAWN
    assert plc.last_job == vector["job_id"]
    assert plc.accepted == 0


def test_a_page_with_one_wrong_bit_is_never_taken():
    page, plc = worked_example()
    for place in range(31):
        torn = {"header": list(page["header"]), "payload": page["payload"]}
        torn["header"][place] ^= 0x10
        assert plc.send(torn, place + 1) in (BAD_CRC, BAD_LAYOUT)
    assert (plc.accepted, plc.last_job) == (0, 0)


def test_what_speaks_against_a_page_is_answered_in_the_protocols_order():
    page, plc = worked_example()
    plc.inputs["state"] = 2
    assert plc.send(page, 1) == NOT_READY
    plc.inputs["now_ms"] += 30_000
    assert plc.send(page, 2) == EXPIRED
    assert plc.send(page, 3) == EXPIRED  # for ever: it was final
    page, plc = worked_example()
    plc.block.trigger_counter = 6
    assert plc.send(page, 1) == EXPIRED
    page, plc = worked_example()
    plc.block.session = 8
    assert plc.send(page, 1) == OUTDATED
    page, plc = worked_example()
    plc.inputs["operator_refuses"] = 1
    assert plc.send(page, 1) == OPERATOR
    assert plc.accepted == 0


@pytest.mark.parametrize(
    "limits", [{"low_x": 1}, {"high_x": 99_999}, {"low_y": 1}, {"high_y": 49_999}, {"take_unaligned": 0}]
)
def test_a_contour_outside_of_the_machines_limits_is_refused(limits):
    page, plc = worked_example()
    plc.inputs |= limits
    assert plc.send(page, 1) == GEOMETRY
    assert plc.accepted == 0


def test_a_contour_of_no_camera_is_refused_unless_it_is_asked_for():
    vector = next(vector for vector in VECTORS["contours"] if not vector["from_a_live_camera"])
    assert Plc(vector).send(vector["pages"][0], 1) == GEOMETRY


def test_a_contour_that_expires_while_it_is_being_checked_is_not_accepted():
    page, plc = worked_example()
    plc.block.PER_SCAN = 1  # the constant that spreads the work over scans
    words = [1, *page["header"], *page["payload"]]
    plc.registers[32 : 32 + len(words)] = words
    plc.scan(20)
    assert plc.registers[6] == 0
    plc.inputs["now_ms"] += 30_000
    plc.scan(40)
    assert plc.registers[6:8] == [1, EXPIRED]
    assert plc.accepted == 0


def test_pages_out_of_order_are_asked_for_again_from_the_first():
    vector = next(vector for vector in VECTORS["contours"] if len(vector["pages"]) == 4)
    first, second, third, fourth = vector["pages"]
    plc = Plc(vector)
    plc.inputs |= EVERYTHING
    said = [plc.send(page, n) for n, page in enumerate([second, first, third, second, second, third, fourth], 1)]
    assert said == [MISSING, ACCEPTED, MISSING, ACCEPTED, ACCEPTED, ACCEPTED, ACCEPTED]
    assert plc.accepted == 1
    assert plc.rings() == [vector["exterior"]]


def test_a_contour_whose_counts_contradict_its_points_is_not_accepted_with_its_last_page_either():
    page, plc = worked_example()
    for place, value in ((9, 5), (5, 2), (15, 99), (5, 0)):  # point_count, ring_count, max_x's half, no ring
        wrong = {"header": list(page["header"]), "payload": list(page["payload"])}
        wrong["header"][place + 1 if place == 9 else place] = value
        sealed(wrong)
        assert [plc.send(wrong, 1), plc.send(wrong, 2)] == [BAD_LAYOUT, BAD_LAYOUT]
    assert (plc.accepted, plc.last_job) == (0, 0)
    assert plc.send(page, 3) == ACCEPTED


def sealed(page):
    """Its CRC made right, for a page that is wrong in other ways."""
    page["header"][7:9] = 0, 0
    words = [*page["header"], *page["payload"]]
    crc = zlib.crc32(b"".join(word.to_bytes(2, "big") for word in words))
    page["header"][7:9] = crc >> 16, crc & 0xFFFF


def test_what_was_answered_is_remembered_over_a_restart_and_each_start_has_a_session_of_its_own():
    page, plc = worked_example()
    assert plc.send(page, 1) == ACCEPTED
    again = Plc(block=plc.block.restarted())
    again.inputs |= EVERYTHING
    assert again.registers[10:14] == [0, 7, ACCEPTED, 10]
    assert again.send(page, 1) == OUTDATED
    forgetful = Plc()
    assert forgetful.registers[13] == 4711
    assert again.accepted + forgetful.accepted == 0


def test_the_session_is_written_last_and_a_scan_after_all_else():
    plc = Plc()
    plc.registers = [0xAAAA] * 16 + [0] * 2032
    plc.block = plc.block.restarted()
    plc.scan()
    assert plc.registers[13] == 0
    assert plc.registers[2:8] == [0] * 6
    plc.scan()
    assert plc.registers[13] == 4712


def test_the_echo_the_heartbeat_and_the_clock_follow():
    plc = Plc()
    for value, echo in ((0x01020304, 0x01020305), (0xFFFF, 0x10000), (0x7FFFFFFF, 0x80000000), (0xFFFFFFFF, 0)):
        plc.registers[24:26] = value >> 16, value & 0xFFFF
        plc.inputs["now_ms"] = value
        beat = plc.registers[1]
        plc.scan()
        assert plc.registers[8] << 16 | plc.registers[9] == echo
        assert plc.registers[14] << 16 | plc.registers[15] == value
        assert plc.registers[1] != beat


def test_a_measurement_is_asked_for_once_and_ends_by_what_the_service_says():
    plc = Plc()
    plc.inputs |= {"request": 1, "request_recipe": 3, "request_thickness": 70_000}
    plc.scan(3)
    assert plc.registers[2] == 0  # no service is ready
    plc.registers[17] = 5
    plc.registers[18] = 1
    plc.scan(3)
    plc.inputs["request"] = 0
    plc.scan()
    assert plc.block.can_request
    plc.inputs["request"] = 1
    plc.scan(4)
    assert plc.registers[2:6] == [1, 3, 1, 4464]
    assert plc.block.trigger_open
    plc.registers[29] = 4  # settled_job of before the acknowledgement
    plc.scan(3)
    assert plc.block.trigger_open
    plc.registers[19], plc.registers[23], plc.registers[26] = 1, 5, plc.registers[13]
    plc.scan(3)
    assert plc.block.trigger_open
    plc.registers[21], plc.registers[29] = 110, 5
    plc.scan()
    assert plc.block.trigger_open  # one scan may have seen half of it
    plc.scan()
    assert not plc.block.trigger_open
    assert plc.block.reject_reason == 110
    assert plc.registers[2] == 1


def test_a_service_that_falls_silent_is_not_asked():
    plc = Plc()
    plc.registers[17], plc.registers[18] = 5, 1
    plc.scan(3)
    assert plc.block.can_request
    plc.inputs["now_ms"] += 3001
    plc.scan(3)
    assert not plc.block.service_alive
    assert not plc.block.can_request


# --- the program that tries it in a PLC -----------------------------------------------------------------------------


def test_the_golden_program_is_what_the_vectors_make_now():
    assert (FOLDER / "golden_vectors.st").read_text(encoding="utf-8") == program(VECTORS), (
        "write it anew: python3 controllers/iec61131/golden_vectors.py docs/reference/golden-vectors.json "
        "controllers/iec61131/golden_vectors.st"
    )


def tried(text):
    block = Program(text + program(VECTORS)).block("CT_TRY")
    for _ in range(1000):
        block.scan()
        if block.done:
            return block
    raise AssertionError("not done in 1000 scans")


def test_the_golden_program_passes_and_finds_a_wrong_crc_word_order_or_answer():
    ended = tried(TEXT)
    assert (ended.failed, ended.first_failed) == (0, -1)
    assert f"passed = {ended.passed}." in program(VECTORS)
    for right, wrong in (
        ("EDB88320", "04C11DB7"),
        ("IF little THEN", "IF NOT little THEN"),
        (":= UINT#6", ":= UINT#8"),
    ):
        assert right in TEXT
        assert tried(TEXT.replace(right, wrong)).failed > 0


# --- behind a Modbus server ------------------------------------------------------------------------------------------


@contextmanager
def served(**inputs):
    """The block behind a Modbus server: its port, and the controller."""
    plc = Plc()
    plc.inputs |= inputs
    plc.writable = range(16, 2048)
    begun = time.monotonic()

    def scan():
        plc.inputs["now_ms"] = 1 + int((time.monotonic() - begun) * 1000)
        with plc.lock:
            plc.scan()

    with scanned_server(plc, scan) as port:
        yield port, plc


def test_our_service_brings_it_a_contour_of_many_pages(tmp_path):
    with served(take_simulated=1) as (port, plc):
        options = ("--controller", f"127.0.0.1:{port}", "--state", tmp_path, "--once", "--aligned")
        for shape, expected in (("holes", [4, 4, 3]), ("gear", [1500])):
            done = combtrace("simulate-service", *options, "--shape", shape)
            assert done.returncode == 0, done.stderr
            assert [len(ring) for ring in plc.rings()] == expected
    assert plc.accepted == 2


def test_it_keeps_the_protocols_rules_as_the_hardware_in_loop_suite_tries_them():
    with served(take_simulated=1, take_unaligned=1) as (port, plc):
        command = [
            sys.executable,
            "-m",
            "pytest",
            "tests/hil/test_controller.py",
            "-p",
            "no:cacheprovider",
            "--hil-move",
        ]
        command += [f"--hil-controller=tcp://127.0.0.1:{port}"]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stdout
    assert " passed" in done.stdout
    assert "skipped" not in done.stdout
    assert plc.accepted == 2


# --- what compiles it ------------------------------------------------------------------------------------------------

HEAD = "FUNCTION F : UINT VAR_INPUT a : UINT; w : WORD; END_VAR VAR t : ARRAY[0..3] OF UINT; i : INT; END_VAR "


@pytest.mark.parametrize(
    ("body", "why"),
    [
        ("F := w;", "WORD where UINT is expected"),
        ("F := a + w;", "WORD where UINT is expected"),
        ("F := a AND a;", "AND of UINT is not defined"),
        ("F := b;", "b is not declared"),
        ("a := UINT#1;", "cannot be assigned to"),
        ("F := t;", "t is an array"),
        ("IF a THEN F := a; END_IF;", "UINT where BOOL is expected"),
        ("F := SQRT(a);", "SQRT with 1 arguments is not known"),
        ("F := a", "not understood"),
        ("IF a = a THEN F := a;", "not understood"),
    ],
)
def test_what_a_compiler_would_refuse_is_refused(body, why):
    with pytest.raises(StructuredTextError, match=why):
        Program(f"{HEAD}{body} END_FUNCTION")


@pytest.mark.parametrize("body", ["F := a - UINT#2;", "F := a * UINT#65535 * UINT#3;", "i := 4; t[i] := a;"])
def test_what_no_controller_defines_stops_the_run(body):
    with pytest.raises(StructuredTextError):
        Program(f"{HEAD}{body} END_FUNCTION").call("F", 1, 2)
