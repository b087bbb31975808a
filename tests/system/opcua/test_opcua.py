"""A running daemon seen by node-opcua: states, results, refusals; and what is refused of clients, and logged."""

from __future__ import annotations

import contextlib
import itertools
import shutil
import socket
import sqlite3
import struct
from collections.abc import Iterator
from pathlib import Path

import pytest
from asyncua import Client, ua
from asyncua.crypto.security_policies import SecurityPolicyBasic256Sha256
from cryptography import x509
from cryptography.hazmat.primitives.serialization import Encoding

from tests.support.interop.opcua import AUTOMATIC, CELL, CLIENT_PACKAGES, OUTER, URI, Identity, NodeClient, identity
from tests.support.interop.programs import node_modules
from tests.support.processes.cell import Cell
from tests.support.processes.page_client import TOKEN, token_file
from tests.support.processes.processes import free_port, until

MACHINE = f"{CELL}.VisionStateMachine"
REFUSING = "recipes: [{number: 1, name: combs}, {number: 2, name: large, min_area_mm2: 1000000}]\n"


class Served:
    """A daemon with OPC UA, and whom it trusts."""

    def __init__(self, folder: Path) -> None:
        node_modules(CLIENT_PACKAGES)  # before the daemon, which would work all the while
        self.port = free_port()
        self.trusted = identity(folder / "client")
        kept = folder / "state" / "opcua" / "trusted"
        kept.mkdir(parents=True)
        shutil.copy(self.trusted.certificate, kept / "client.pem")
        token_file(folder)
        more = f"opcua: {{port: {self.port}, users_file: tokens}}\n{REFUSING}"
        self.cell = Cell(folder, trigger_every_s=1.0, more=more)
        # A client that comes before is shown Initialized first.
        until(lambda: "opcua: opc.tcp" in self.log and "state Initialized -> Ready" in self.log, what="OPC UA, Ready")

    @property
    def log(self) -> str:
        return self.cell.service.text

    def client(self, shown: Identity | None = None, **more: str) -> NodeClient:
        return NodeClient(f"opc.tcp://127.0.0.1:{self.port}", shown or self.trusted, **more)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    found = Served(tmp_path_factory.mktemp("opcua"))
    try:
        yield found
    finally:
        found.cell.stop()
    assert "Traceback" not in found.log


@pytest.fixture(scope="module")
def reader(served: Served) -> Iterator[NodeClient]:
    client = served.client()
    client.watch()
    try:
        yield client
    finally:
        client.close()


def test_the_cell_is_browsed_as_the_specification_has_it(reader: NodeClient) -> None:
    found = {one["name"]: one["type"] for one in reader.ask("browse", node=CELL)}
    assert found["VisionStateMachine"] == "ns=2;i=1017"
    assert {found["RecipeManagement"], found["ResultManagement"]} == {"ns=2;i=1004", "ns=2;i=1007"}
    assert reader.ask("read", node="i=2255")[2] == "http://opcfoundation.org/UA/MachineVision"
    assert reader.ask("read", node=f"{CELL}.RecipeManagement.Recipes.2.InternalId")["id"] == "large"


def test_each_result_and_each_state_comes_in_its_order_and_once(served: Served, reader: NodeClient) -> None:
    until(lambda: len(reader.events(" accepted")) >= 3, 60, "results")
    told = [event["JobId"]["id"] for event in reader.events(" accepted")]
    first = int(told[0])
    assert told == [str(first + k) for k in range(len(told))]
    kept = {str(job["job_id"]): job for job in served.cell.settled()}
    assert all(kept[number]["outcome"] == "accepted" for number in told)
    assert reader.states(OUTER) == ["Operational"]
    states = reader.states(AUTOMATIC)
    assert not [turn for turn in itertools.pairwise(states) if set(turn) != {"Ready", "SingleExecution"}]


def test_a_result_is_found_by_its_number_and_holds_no_contour(reader: NodeClient) -> None:
    until(lambda: bool(reader.events(" accepted")), 60, "a result")
    event = reader.events(" accepted")[0]
    found = reader.ask("result", id=event["JobId"]["id"])
    handle, result, error = found["outputs"]
    assert (found["status"], handle, error) == ("Good", 0, 0)
    assert result["resultContent"] == event["ResultContent"]
    outcome, code, reason, _, area_mm2, uncertainty_mm, vertices, _ = result["resultContent"]
    assert (outcome, code, reason) == ("accepted", 0, "")
    assert area_mm2 > 1000
    assert 0 < uncertainty_mm < 2
    assert vertices > 10
    assert reader.ask("result", id="4000000000")["outputs"][2] == 1, "not there"
    assert reader.ask("result", id="x")["status"] == "BadInvalidArgument"


def test_what_would_change_the_cell_is_refused_and_logged(served: Served, reader: NodeClient) -> None:
    assert reader.ask("write", node=f"{CELL}.SystemState", value="x") == "BadUserAccessDenied"
    automatic = f"{MACHINE}.AutomaticModeStateMachine"
    orders = ((automatic, "StartSingleJob"), (automatic, "Stop"), (f"{CELL}.RecipeManagement", "PrepareRecipe"))
    for where, name in orders:
        done = reader.ask("call", object=where, method=f"{where}.{name}", cause="x")
        assert done["status"] == "BadNotExecutable"
        assert f"call of {where}.{name} refused" in served.log
    done = reader.ask("call", object=MACHINE, method=f"{MACHINE}.Halt", cause="x")
    assert done["status"] == "BadUserAccessDenied"
    assert f"write of {CELL}.SystemState refused" in served.log


def test_strangers_are_refused_and_logged_and_their_certificate_is_kept(served: Served, tmp_path: Path) -> None:
    stranger = identity(tmp_path / "stranger")
    client = served.client(stranger)
    client.close()
    assert "BadCertificateUntrusted" in (client.refusal or "")
    assert "its certificate is not trusted. To trust it: mv " in served.log
    assert len(list((served.cell.folder / "state" / "opcua" / "rejected").iterdir())) == 1


def test_a_wrong_password_is_refused_and_logged(served: Served) -> None:
    client = served.client(user="anna", password="x" * 24)
    client.close()
    assert "BadUserAccessDenied" in (client.refusal or "")
    assert "user 'anna', or the password, is not known" in served.log


async def test_without_security_nothing_is_to_be_had(served: Served) -> None:
    """A session on a channel without security can be asked for, as endpoints can; it is never let in."""
    client = Client(f"opc.tcp://127.0.0.1:{served.port}")
    await client.connect_socket()
    try:
        await client.send_hello()
        await client.open_secure_channel()
        with pytest.raises(ua.UaError, match="No matching endpoints"):  # of its own, once the session is there
            await client.create_session()
        with pytest.raises(ua.UaStatusCodeError):
            await client.get_node(CELL).read_browse_name()
        with pytest.raises(ua.UaStatusCodeError):
            await client.activate_session()
        with pytest.raises(ua.UaStatusCodeError):
            await client.get_node(CELL).read_browse_name()
    finally:
        client.disconnect_socket()
    assert "refused: it shows no certificate" in served.log


async def test_somebody_elses_certificate_does_not_let_a_stranger_in(served: Served, tmp_path: Path) -> None:
    """The certificate that a request names is public; that of the channel is proved by its key."""
    stranger, own = identity(tmp_path / "stranger"), served.cell.folder / "state" / "opcua" / "own.pem"
    trusted = x509.load_pem_x509_certificate(served.trusted.certificate.read_bytes()).public_bytes(Encoding.DER)
    client = Client(f"opc.tcp://127.0.0.1:{served.port}")
    shown = (stranger.certificate, stranger.key)
    await client.set_security(SecurityPolicyBasic256Sha256, *shown, server_certificate=own)
    asked = client.uaclient.create_session

    async def claiming(parameters: ua.CreateSessionParameters) -> ua.CreateSessionResult:
        parameters.ClientCertificate = trusted
        return await asked(parameters)

    client.uaclient.create_session = claiming
    await client.connect_socket()
    try:
        await client.send_hello()
        await client.open_secure_channel()
        await client.create_session()
        with pytest.raises(ua.UaStatusCodeError, match="BadCertificateUntrusted"):
            await client.activate_session()
    finally:
        client.disconnect_socket()


async def test_nodes_can_neither_be_added_nor_taken_away_and_who_tries_is_logged(served: Served) -> None:
    own = served.cell.folder / "state" / "opcua" / "own.pem"
    client = Client(f"opc.tcp://127.0.0.1:{served.port}")
    shown = (served.trusted.certificate, served.trusted.key)
    await client.set_security(SecurityPolicyBasic256Sha256, *shown, server_certificate=own)
    client.application_uri = URI
    async with client:
        with pytest.raises(ua.UaStatusCodeError, match="BadUserAccessDenied"):
            await client.get_node(CELL).add_variable(1, "mine", 5)
        with pytest.raises(ua.UaStatusCodeError, match="BadUserAccessDenied"):
            await client.delete_nodes([client.get_node(CELL)])
        assert len(await client.get_node(CELL).get_children()) == 4
    assert "opcua: AddNodesRequest refused" in served.log
    assert "opcua: DeleteNodesRequest refused" in served.log


def test_what_is_no_message_ends_its_connection_alone(served: Served, reader: NodeClient) -> None:
    for sent in (b"HELF" + struct.pack("<I", 2**31) + bytes(80_000), b"ABCF" + bytes(80_000)):
        with socket.create_connection(("127.0.0.1", served.port), timeout=20) as connection:
            connection.sendall(sent)
            with contextlib.suppress(ConnectionResetError):
                assert connection.recv(100) == b""
    assert reader.ask("status", node=OUTER) == "Good"


def test_a_user_halts_and_resets_and_the_journal_says_who(served: Served, reader: NodeClient) -> None:
    client = served.client(user="anna", password=TOKEN)
    assert client.refusal is None
    try:
        done = client.ask("call", object=MACHINE, method=f"{MACHINE}.Halt", cause="blade")
        assert done == {"status": "Good", "outputs": [0]}
        until(lambda: reader.states(OUTER)[-1:] == ["Halted"], what="Halted")
        assert client.ask("status", node=AUTOMATIC) == "BadStateNotActive"
        assert client.ask("call", object=MACHINE, method=f"{MACHINE}.Reset", cause="")["status"] == "Good"
        until(lambda: reader.states(OUTER)[-1:] == ["Operational"], what="Operational")
        assert client.ask("call", object=MACHINE, method=f"{MACHINE}.Reset", cause="")["status"] == "BadInvalidState"
    finally:
        client.close()
    with sqlite3.connect(served.cell.journal) as journal:
        notes = journal.execute("SELECT who, action, detail, result FROM audit ORDER BY id").fetchall()
    journal.close()
    assert notes[0] == ("anna", "halt", "blade", "Halted")
    assert notes[1][:2] == ("anna", "resume")


def test_a_refusal_is_told_with_its_reason(served: Served, reader: NodeClient) -> None:
    """Last, for the cell goes on with a recipe that refuses everything."""
    served.cell.controller.stop()
    until(lambda: bool(reader.events("-> Error")), what="the loss")
    served.cell._trigger_every = ("--trigger-every", "0.5", "--recipe", "2")
    served.cell.controller = served.cell.start_controller()
    until(lambda: len(reader.events("112 area_out_of_limits")) >= 2, 60, "a refusal and what says more of it")
    ready, more = reader.events("112 area_out_of_limits")[:2]
    assert ready["ResultContent"][:3] == ["refused", 112, "area_out_of_limits"]
    assert (ready["ResultState"], ready["Severity"]) == (1, 500)
    assert (more["EventType"], more["CausePath"]) == ("ns=2;i=1038", "area_out_of_limits")
    assert more["JobId"] == ready["JobId"]
    assert reader.events("-> Error")[0]["EventType"] == "ns=2;i=1019"
    assert reader.events("Error -> ")[0]["EventType"] == "ns=2;i=1020"
