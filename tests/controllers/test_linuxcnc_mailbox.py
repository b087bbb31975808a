"""The bridge's mailbox, which knows nothing of our code, on the golden vectors and behind its own Modbus server."""

from __future__ import annotations

import json
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from pymodbus.client import ModbusTcpClient

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "controllers" / "linuxcnc"))
import mailbox as bridge  # noqa: E402

from modbus_server import ModbusServer, answer  # noqa: E402

VECTORS = json.loads((ROOT / "docs" / "reference" / "golden-vectors.json").read_text())


class FixedMailbox(bridge.Mailbox):
    """A mailbox whose clock and session are those of a vector."""

    def __init__(self, memory, vector, judge=lambda _: bridge.ACCEPTED, part_capacity=None):
        self.taken = []
        capacity = vector.get("payload_capacity", 1984)
        super().__init__(memory, judge, self.taken.append, vector["word_order"], capacity, part_capacity)
        self.now_ms = vector.get("captured_at", 0) + 10
        self.session = self.registers[13] = vector["session"]
        self.registers[2] = vector.get("trigger", 0)
        self.set_state(bridge.READY_STATE)

    def clock_ms(self):
        return self.now_ms

    def send(self, page, transfer):
        """Write a page, scan, and give the answer."""
        words = [transfer, *page["header"], *page["payload"]]
        self.registers[bridge.CONTOUR : bridge.CONTOUR + len(words)] = words
        self.scan()
        assert self.registers[6] == transfer
        return self.registers[7]


@pytest.fixture
def memory(tmp_path):
    return bridge.Memory(str(tmp_path / "memory.json"))


@pytest.mark.parametrize("vector", VECTORS["contours"], ids=lambda vector: vector["name"])
def test_every_golden_contour_arrives_as_it_was_written(vector, memory):
    mailbox = FixedMailbox(memory, vector)
    answers = [mailbox.send(page, number) for number, page in enumerate(vector["pages"], 1)]
    assert answers == [bridge.ACCEPTED] * len(answers)
    (contour,) = mailbox.taken
    rings = [[(x / 1000, y / 1000) for x, y in ring] for ring in (vector["exterior"], *vector["holes"])]
    assert contour.rings == rings
    assert contour.area_mm2 == vector["area"]
    assert (contour.flags & 1 == 0) == vector["from_a_live_camera"]
    assert memory.last_job == vector["job_id"]
    assert mailbox.send(vector["pages"][-1], 77) == bridge.BEFORE
    assert len(mailbox.taken) == 1


def with_parts(vector, memory, torn=None, part_capacity=200):
    """The mailbox that got a golden part block, a bit of which may be wrong, and its answer to the page."""
    example = {"captured_at": 60_000, "session": 9, "trigger": 5, "word_order": vector["word_order"]}
    mailbox = FixedMailbox(memory, example, part_capacity=part_capacity)
    block = vector["part_block"][: 16 + part_capacity]
    mailbox.registers[2048 : 2048 + len(block)] = block
    if torn is not None:
        mailbox.registers[2048 + torn] ^= 0x10
    return mailbox, mailbox.send(vector["page"], 1)


@pytest.mark.parametrize("vector", VECTORS["parts"], ids=lambda vector: vector["name"])
def test_every_golden_part_block_arrives_with_its_contour(vector, memory):
    mailbox, given = with_parts(vector, memory)
    assert given == bridge.ACCEPTED
    (contour,) = mailbox.taken
    for part, sent in zip(contour.parts, vector["parts"], strict=True):
        rings = [[(x / 1000, y / 1000) for x, y in ring] for ring in (sent["exterior"], *sent["holes"])]
        assert part.rings == rings
        assert (part.number, part.margin_mm, part.needed_mm) == (
            sent["part"],
            sent["margin"] / 1000,
            sent["needed"] / 1000,
        )


@pytest.mark.parametrize("place", range(38))
def test_a_part_block_with_one_wrong_bit_is_never_taken_and_its_repeat_is(place, memory):
    vector = next(vector for vector in VECTORS["parts"] if len(vector["parts"]) == 1)
    mailbox, given = with_parts(vector, memory, place)
    assert given == bridge.BAD_CRC
    assert (mailbox.taken, memory.last_job) == ([], 0)
    mailbox.registers[2048 + place] ^= 0x10
    assert mailbox.send(vector["page"], 2) == bridge.ACCEPTED


def test_a_part_block_longer_than_its_room_is_answered_2(memory):
    assert with_parts(VECTORS["parts"][0], memory, part_capacity=12)[1] == bridge.BAD_CRC


@pytest.mark.parametrize("vector", VECTORS["withdrawals"], ids=lambda vector: vector["word_order"])
def test_every_golden_withdrawal_ends_its_job(vector, memory):
    mailbox = FixedMailbox(memory, vector)
    assert mailbox.send(vector, 1) == bridge.WITHDRAWN
    assert memory.last_job == vector["job_id"]
    assert mailbox.taken == []


@pytest.mark.parametrize("word", range(1, 32))
def test_a_page_with_one_wrong_bit_is_never_taken(word, memory):
    vector = VECTORS["contours"][0]
    mailbox = FixedMailbox(memory, vector)
    page = json.loads(json.dumps(vector["pages"][0]))
    page["header"][word - 1] ^= 0x10
    assert mailbox.send(page, 1) in (bridge.BAD_CRC, bridge.BAD_LAYOUT)
    assert mailbox.taken == []
    assert memory.last_job == 0


def test_too_old_foreign_and_unready_are_told_apart(memory):
    vector = VECTORS["contours"][0]
    mailbox = FixedMailbox(memory, vector)
    mailbox.set_state(bridge.BUSY_STATE)
    assert mailbox.send(vector["pages"][0], 1) == bridge.NOT_READY
    mailbox.session = 8
    assert mailbox.send(vector["pages"][0], 2) == bridge.OUTDATED
    mailbox.session, mailbox.now_ms = vector["session"], vector["captured_at"] + vector["valid_for"] + 1
    assert mailbox.send(vector["pages"][0], 3) == bridge.EXPIRED
    assert mailbox.taken == []


def test_what_was_answered_is_remembered_over_a_restart(tmp_path):
    path = str(tmp_path / "memory.json")
    vector = VECTORS["contours"][0]
    FixedMailbox(bridge.Memory(path), vector).send(vector["pages"][0], 1)
    again = FixedMailbox(bridge.Memory(path), vector)
    assert again.registers[11] == vector["job_id"]
    assert again.registers[12] == bridge.ACCEPTED
    assert again.send(vector["pages"][0], 1) == bridge.BEFORE
    assert again.taken == []


def test_two_starts_have_two_sessions(tmp_path):
    sessions = {bridge.Mailbox(bridge.Memory(str(tmp_path / "memory.json")), None, None).session for _ in range(3)}
    assert len(sessions) == 3
    assert 0 not in sessions


def test_a_memory_that_cannot_be_read_is_no_memory_to_guess(tmp_path):
    (tmp_path / "memory.json").write_text("{")
    with pytest.raises(SystemExit, match="The last job is not known"):
        bridge.Memory(str(tmp_path / "memory.json"))


def service_says(mailbox, session, **fields):
    """Write the service block as a service of this session does."""
    offsets = {"trigger_ack": 3, "job_id": 7, "settled_job": 13}
    words = [1, 5, *[0] * 8, session, 1, *[0] * 4]
    for name, value in fields.items():
        words[offsets[name]] = value
    mailbox.write(bridge.SERVICE, words)


def test_a_trigger_that_brought_no_contour_is_closed_for_good(memory):
    """A job of another trigger that begins then is no reason to wait for the old one again, nor to refuse it (5)."""
    vector = next(v for v in VECTORS["contours"] if v["trigger"] == 0 and len(v["pages"]) == 1)
    mailbox = FixedMailbox(memory, vector)
    session, job = vector["session"], vector["job_id"]
    service_says(mailbox, session)
    assert mailbox.request()
    assert mailbox.open_trigger()
    counter = mailbox.registers[2]
    service_says(mailbox, session, trigger_ack=counter, job_id=job - 1)
    assert mailbox.open_trigger()
    service_says(mailbox, session, trigger_ack=counter, job_id=job - 1, settled_job=job - 1)
    assert not mailbox.open_trigger()
    service_says(mailbox, session, trigger_ack=counter, job_id=job, settled_job=job - 1)
    assert not mailbox.open_trigger()
    assert mailbox.send(vector["pages"][0], 1) == bridge.ACCEPTED


def test_while_its_own_trigger_is_open_the_contour_of_another_is_refused(memory):
    vector = next(v for v in VECTORS["contours"] if v["trigger"] == 0 and len(v["pages"]) == 1)
    mailbox = FixedMailbox(memory, vector)
    service_says(mailbox, vector["session"])
    assert mailbox.request()
    assert not mailbox.request(), "one at a time"
    assert mailbox.send(vector["pages"][0], 1) == bridge.EXPIRED


def test_the_final_answer_to_its_contour_closes_a_trigger(memory):
    vector = next(v for v in VECTORS["contours"] if v["trigger"] and len(v["pages"]) == 1)
    mailbox = FixedMailbox(memory, vector)
    service_says(mailbox, vector["session"])
    mailbox.registers[2] = vector["trigger"] - 1
    assert mailbox.request()
    assert mailbox.send(vector["pages"][0], 1) == bridge.ACCEPTED
    assert not mailbox.open_trigger()


# --- its Modbus server -----------------------------------------------------------------------------------------------


@pytest.fixture
def client(memory):
    mailbox = bridge.Mailbox(memory, lambda _: bridge.ACCEPTED, lambda _: None)
    server = ModbusServer(("127.0.0.1", 0), mailbox)
    thread = threading.Thread(target=server.serve_forever, args=(0.05,))
    thread.start()
    client = ModbusTcpClient("127.0.0.1", port=server.server_address[1], timeout=60)
    assert client.connect()
    client.mailbox = mailbox
    yield client
    client.close()
    server.shutdown()
    thread.join()
    server.server_close()


def test_a_foreign_client_reads_and_writes_registers(client):
    assert not client.write_registers(16, [1, 2, 3]).isError()
    assert not client.write_register(20, 65535).isError()
    assert client.read_holding_registers(16, count=5).registers == [1, 2, 3, 0, 65535]
    assert client.read_holding_registers(0, count=125).registers == client.mailbox.registers[:125]


def test_what_is_not_there_or_not_the_clients_is_an_exception(client):
    assert client.read_holding_registers(2000, count=100).exception_code == 2
    assert client.write_register(0, 1).exception_code == 2
    assert client.write_registers(15, [1, 2]).exception_code == 2
    assert client.read_coils(0, count=1).exception_code == 1
    assert client.mailbox.registers[0] == 0


@pytest.mark.parametrize("body", [b"", b"\0", b"\0\0\0\0", b"\0\0\0\x7e", b"\0\x10\0\x02\x04\0\1"])
@pytest.mark.parametrize("function", [3, 6, 16, 99])
def test_a_torn_request_changes_nothing(function, body, memory):
    mailbox = bridge.Mailbox(memory, None, None)
    before = list(mailbox.registers)
    reply = answer(mailbox, function, body)
    assert reply[0] in (function, function | 0x80)
    if reply[0] & 0x80:
        assert mailbox.registers == before


def test_it_runs_on_the_standard_library_alone():
    folder = ROOT / "controllers" / "linuxcnc"
    code = f"import sys; sys.path.insert(0, {str(folder)!r}); import mailbox, modbus_server, program"
    done = subprocess.run(
        [sys.executable, "-I", "-c", f"{code}; print(*sys.modules)"], capture_output=True, text=True, check=True
    )
    assert not {"pymodbus", "numpy", "yaml"} & set(done.stdout.split())
