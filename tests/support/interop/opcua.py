"""node-opcua's client as a program, its certificate, and a cell that serves it."""

from __future__ import annotations

import json
import os
import subprocess
import threading
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from asyncua.crypto.cert_gen import (
    dump_private_key_as_pem,
    generate_private_key,
    generate_self_signed_app_certificate,
)
from cryptography import x509
from cryptography.hazmat.primitives.serialization import Encoding
from cryptography.x509.oid import ExtendedKeyUsageOID

from tests.support.interop.programs import HERE, NODE_INSTALL, node_modules
from tests.support.processes.processes import until
from tests.support.real_parts import need_program

CLIENT_PACKAGES = ("node-opcua-client@2",)
URI = "urn:combtrace:test-client"
CELL = "ns=1;s=cell"
OUTER = f"{CELL}.VisionStateMachine.CurrentState"
AUTOMATIC = f"{CELL}.VisionStateMachine.AutomaticModeStateMachine.CurrentState"
SERVER_OBJECT = "i=2253"


@dataclass(frozen=True)
class Identity:
    """A client's certificate and key, PEM files."""

    certificate: Path
    key: Path


def identity(folder: Path, days: int = 2) -> Identity:
    """A new one in the folder. days: for which it is valid; negative = it has ended already."""
    folder.mkdir(parents=True)
    key = generate_private_key()
    names: list[x509.GeneralName] = [x509.UniformResourceIdentifier(URI), x509.DNSName("localhost")]
    made = generate_self_signed_app_certificate(key, "client", {}, names, [ExtendedKeyUsageOID.CLIENT_AUTH], days)
    found = Identity(folder / "certificate.pem", folder / "key.pem")
    found.certificate.write_bytes(made.public_bytes(Encoding.PEM))
    found.key.write_bytes(dump_private_key_as_pem(key))
    return found


@dataclass
class NodeClient:
    """The client, connected, or refused with `refusal`; what it was notified of is in `told`."""

    url: str
    shown: Identity
    user: str = ""
    password: str = ""
    told: list[dict[str, Any]] = field(default_factory=list)
    refusal: str | None = None

    def __post_init__(self) -> None:
        node = need_program("node", NODE_INSTALL)
        given = {
            "url": self.url,
            "uri": URI,
            "certificate": str(self.shown.certificate),
            "key": str(self.shown.key),
            "pki": str(self.shown.key.parent / "pki"),
            "user": self.user,
            "password": self.password,
        }
        environment = {**os.environ, "NODE_PATH": str(node_modules(CLIENT_PACKAGES))}
        command = [node, str(HERE / "opcua_client.js"), json.dumps(given)]
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(
            command, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL, text=True, env=environment
        )
        self._answers: list[dict[str, Any]] = []
        self._reader = threading.Thread(target=self._read)
        self._reader.start()
        first = self._answer()
        self.refusal = first.get("refused")
        if self.refusal is not None:
            self.close()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            if not line.startswith("{"):
                continue  # the library's own words
            said = json.loads(line)
            (self.told if "at" in said else self._answers).append(said)

    def _answer(self) -> dict[str, Any]:
        until(lambda: bool(self._answers) or self._process.poll() is not None, what="node-opcua's answer")
        until(lambda: bool(self._answers), 5, "node-opcua's answer before its end")
        return self._answers.pop(0)

    def ask(self, do: str, **what: Any) -> Any:
        """What the client answers; raise RuntimeError with why it cannot."""
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps({"do": do, **what}) + "\n")
        self._process.stdin.flush()
        answer = self._answer()
        if "failed" in answer:
            raise RuntimeError(answer["failed"])
        return answer["answer"]

    def watch(self, interval_ms: int = 50) -> None:
        """Subscribe to both state machines and to all events of the server."""
        self.ask("subscribe", interval=interval_ms, nodes=[OUTER, AUTOMATIC], events=SERVER_OBJECT)

    def events(self, message: str) -> list[dict[str, Any]]:
        """Events of which the message holds this."""
        return [one["event"] for one in list(self.told) if message in one.get("event", {}).get("Message", "")]

    def states(self, node: str) -> list[str]:
        """What a node showed, in order of the server's times.

        What comes while an item is being made node-opcua holds back, and tells after what came later.
        """
        shown = [one for one in list(self.told) if one.get("node") == node]
        return [one["value"] for one in sorted(shown, key=lambda one: float(one["since"]))]

    def close(self) -> None:
        """End it."""
        if self._process.poll() is None and self.refusal is None:
            self.ask("bye")
        assert self._process.stdin is not None
        self._process.stdin.close()
        try:
            self._process.wait(20)
        finally:
            self._process.kill()
            self._process.wait()
            self._reader.join()
            assert self._process.stdout is not None
            self._process.stdout.close()
