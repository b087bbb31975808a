"""What every request passes first: its Host and Origin are ours, its body is small; every answer carries our headers.

Host: a page of somebody else's whose name was made to point here (DNS rebinding) is refused. Origin and
Sec-Fetch-Site: another site's page cannot ask in a visitor's name.
"""

from __future__ import annotations

import ipaddress
from collections.abc import Iterable

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.web.models import Problem

LARGEST_BODY = 4096
READING = ("GET", "HEAD")
CONTENT_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
HEADERS = {
    "content-security-policy": CONTENT_POLICY,
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "referrer-policy": "no-referrer",
    "cross-origin-resource-policy": "same-origin",
    "cross-origin-opener-policy": "same-origin",
    "permissions-policy": "camera=(), microphone=(), geolocation=()",
}


class BodyTooLarge(Exception):
    """A request's body is beyond what is allowed."""


class Guard:
    """ASGI: refuses what is not for us before the application sees it."""

    def __init__(self, app: ASGIApp, names: Iterable[str], largest_body: int = LARGEST_BODY) -> None:
        """names: host names that are ours besides the address that was called and localhost."""
        self._app = app
        self._largest_body = largest_body
        self._names = {name.lower() for name in names}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in HEADERS.items():
                    headers.setdefault(name, value)
                headers.setdefault("cache-control", "no-store")
            await send(message)

        refused = self._refused(scope)
        if refused is not None:
            await _answer(send_with_headers, *refused)
            return
        await self._app(scope, _bounded(receive, self._largest_body), send_with_headers)

    def _refused(self, scope: Scope) -> tuple[int, str] | None:
        headers = Headers(scope=scope)
        hosts = headers.getlist("host")
        if len(hosts) != 1 or not self._ours(hosts[0], scope):
            return 421, f"Host {', '.join(hosts)!r} is not this service. Name it in page.names, or call it by address"
        origins = headers.getlist("origin")
        if origins and origins != [f"{scope['scheme']}://{hosts[0]}"]:
            return 403, "Origin is another site's"
        if headers.get("sec-fetch-site", "none") not in ("none", "same-origin") and not _navigates(scope, headers):
            return 403, "asked for by another site's page"
        return None if scope["method"] in READING else _unfit_body(headers, self._largest_body)

    def _ours(self, host: str, scope: Scope) -> bool:
        name = _without_port(host)
        called = plain_address((scope.get("server") or ("", 0))[0]).lower()
        if name in self._names or name == called:
            return True
        return name == "localhost" and _is_loopback(called)


def plain_address(address: str) -> str:
    """The address; an IPv4 one as such, also where a socket for both tells it as `::ffff:10.0.0.20`."""
    prefix, _, rest = address.lower().rpartition(":")
    return rest if prefix == "::ffff" and "." in rest else address


def _unfit_body(headers: Headers, largest: int) -> tuple[int, str] | None:
    if headers.get("content-type", "").partition(";")[0].strip().lower() != "application/json":
        return 415, "expected Content-Type: application/json; there is nothing to upload here"
    length = headers.get("content-length")
    if length is not None and not (length.isdecimal() and int(length) <= largest):
        return 413, f"a body of {length} bytes, {largest} are allowed"
    return None


def _navigates(scope: Scope, headers: Headers) -> bool:
    """True for a person who follows a link to the page from elsewhere."""
    return scope["method"] == "GET" and scope["path"] == "/" and headers.get("sec-fetch-mode") == "navigate"


def _without_port(host: str) -> str:
    if host.startswith("["):
        return host[1:].partition("]")[0].lower()
    return host.rpartition(":")[0].lower() if ":" in host else host.lower()


def _is_loopback(address: str) -> bool:
    try:
        return ipaddress.ip_address(address).is_loopback
    except ValueError:
        return False


def _bounded(receive: Receive, largest: int) -> Receive:
    """The same, up to so many bytes; raise BodyTooLarge."""
    seen = 0

    async def bounded() -> Message:
        nonlocal seen
        message = await receive()
        seen += len(message.get("body", b""))
        if seen > largest:
            raise BodyTooLarge
        return message

    return bounded


async def _answer(send: Send, status: int, text: str) -> None:
    body = Problem(error=text).model_dump_json().encode()
    headers = [(b"content-type", b"application/json"), (b"content-length", str(len(body)).encode())]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": body})
