"""A browser's place in tests of the page: HTTP by hand, so that any header can be sent, also a wrong one."""

from __future__ import annotations

import http.client
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from service.web.people.pins import line_of
from tests.support.processes.processes import BOUND_S

TOKEN = "anna-has-this-token-0123"
OTHER_TOKEN = "oleg-has-this-token-4567"
THIRD_TOKEN = "nina-has-this-token-8901"


@dataclass(frozen=True)
class Reply:
    """What was answered."""

    status: int
    headers: dict[str, str]
    body: bytes

    @property
    def json(self) -> Any:
        return json.loads(self.body)


@dataclass(frozen=True)
class Client:
    """Asks the page at a port of this machine."""

    port: int
    source: str = "127.0.0.1"  # another address of loopback counts as another computer

    @property
    def url(self) -> str:
        """Where a browser finds the page."""
        return f"http://127.0.0.1:{self.port}/"

    def ask(self, method: str, path: str, *, body: bytes | None = None, **headers: str) -> Reply:
        """Header names with _ for -; each request by a connection of its own."""
        connection = http.client.HTTPConnection(
            "127.0.0.1", self.port, timeout=BOUND_S, source_address=(self.source, 0)
        )
        try:
            sent = {name.replace("_", "-"): value for name, value in headers.items()}
            connection.request(method, path, body, sent)
            answer = connection.getresponse()
            return Reply(answer.status, {name.lower(): value for name, value in answer.getheaders()}, answer.read())
        finally:
            connection.close()

    def get(self, path: str, **headers: str) -> Reply:
        return self.ask("GET", path, **headers)

    def order(self, path: str, token: str | None = TOKEN, content: Any = None, **headers: str) -> Reply:
        """POST as the page does."""
        if token is not None:
            headers.setdefault("Authorization", f"Bearer {token}")
        headers.setdefault("Content_Type", "application/json")
        return self.ask("POST", path, body=json.dumps(content or {}).encode(), **headers)


def token_file(folder: Path) -> Path:
    """A file with three people's tokens."""
    path = folder / "tokens"
    path.write_text(f"# who may give orders\nanna {TOKEN}\noleg {OTHER_TOKEN}\nnina {THIRD_TOKEN}\n")
    path.chmod(0o600)
    return path


def people_file(folder: Path, pins: dict[str, str]) -> bool:
    """A file with each person's line, by name and PIN; False where there is nobody, and no file."""
    if pins:
        path = folder / "people"
        path.touch(0o600)
        path.write_text("".join(f"{line_of(name, pin)}\n" for name, pin in pins.items()))
    return bool(pins)
