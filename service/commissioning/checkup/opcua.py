"""Whether OPC UA can be served as it is configured, by which certificate, and whom it lets in."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

from service.check_result import CheckResult, fault, ok, warning
from service.config.config import Opcua

SOON = timedelta(days=30)


def check_opcua(settings: Opcua, state_dir: Path) -> Iterator[CheckResult]:
    """Its package, users, certificate, and clients that are trusted; makes nothing."""
    try:
        from service.opcua.server import users_of
        from service.opcua.trust import OpcuaError, Trust, read_own
    except ModuleNotFoundError as error:
        yield fault("opcua", f"{error.name} is not installed", "Install combtrace[opcua], or remove opcua")
        return
    folder = state_dir / "opcua"
    certificate, key = settings.certificate or folder / "own.pem", settings.key or folder / "own.key"
    try:
        users = users_of(settings)
        if settings.certificate is not None or certificate.exists():
            ends = read_own(certificate, key).ends
            if ends < datetime.now(UTC) + SOON:
                yield warning(
                    "opcua", f"its certificate ends on {ends:%Y-%m-%d}", "Make a new one: docs/how-to/opcua.md"
                )
    except OpcuaError as error:
        yield fault("opcua", str(error))
        return
    trust = Trust(folder)
    count = len(trust.certificates())
    if not count:
        yield warning(
            "opcua", f"no client is trusted: {trust.trusted} holds no certificate", "Lay clients' certificates there"
        )
    who = "none who may halt" if users is None else f"halted and reset by {', '.join(name for name, _ in users.read())}"
    yield ok("opcua", f"{settings.host}:{settings.port}, {count} clients trusted, {who}")
