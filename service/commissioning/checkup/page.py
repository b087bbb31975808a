"""Whether the operator's page can be served as it is configured, and safely."""

from __future__ import annotations

import ipaddress
from collections.abc import Iterator

from service.check_result import CheckResult, fault, ok, warning
from service.config.config import Page


def check_page(settings: Page) -> Iterator[CheckResult]:
    """What it is made of, its tokens, its certificate, and who could listen on the line."""
    try:
        from service.web.people.tokens import TokenFileError
        from service.web.server import PageError, check_certificate, known_of
    except ModuleNotFoundError as error:
        yield fault("page", f"{error.name} is not installed", "Install combtrace[page], or remove page")
        return
    who = "it can only be looked at"
    try:
        known = known_of(settings)
        holders = [] if known.tokens is None else [name for name, _ in known.tokens.read()]
        holders += [] if known.people is None else [f"{person.name} (PIN)" for person in known.people.read()]
        if holders:
            who = f"orders by {', '.join(holders)}"
        check_certificate(settings)
    except (TokenFileError, PageError) as error:
        yield fault("page", str(error))
        return
    if settings.certificate is None and not is_loopback(settings.host):
        yield warning(
            "page",
            f"{settings.host}:{settings.port} is open to the network without TLS: tokens, PINs can be read on the line",
            "Give page.certificate and page.key, or host 127.0.0.1: docs/reference/security.md",
        )
    yield ok("page", f"{settings.host}:{settings.port}, {who}")


def is_loopback(host: str) -> bool:
    """True for an address that only this computer reaches."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
