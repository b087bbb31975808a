"""The page of trends, the shift's report, and the figures of both.

One thread of low priority adds up, one request after the other: whoever asks for years costs a job nothing but what
the system's scheduler gives the thread. No names of people: these need a token (`/audit`), and a link carries none.
"""

from __future__ import annotations

import asyncio
import base64
import hashlib
import html
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime, timedelta
from pathlib import Path
from urllib.parse import urlencode

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from service.low_priority import go_last
from service.reasons import Language
from service.records.journal_reader import reading
from service.trends.documents import STYLE, shift_report, trends_page
from service.trends.history import History, Span, history
from service.trends.words import words
from service.web.api import with_problems
from service.web.commands import RequestRefused
from service.web.html import Pages
from service.web.openapi import PREFIX
from service.web.requests import whole_number
from service.web.trends.answer import answer

MOST_WAITING = 4
AGAIN_S = 5.0
LARGEST_RECIPE = 65_535
MOST_HOURS = 10 * 365 * 24
USUAL_HOURS = 7 * 24
PAGE_SPANS_H = (24, 7 * 24, 30 * 24, 365 * 24)
REPORT_SPANS_H = (8, 12, 24)
STYLE_DIGEST = base64.b64encode(hashlib.sha256(STYLE.encode()).digest()).decode()
REPORT_POLICY = (
    f"default-src 'none'; style-src 'sha256-{STYLE_DIGEST}'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'"
)
"""A report is one file, with its style in it: that one and nothing else may apply."""


class TrendEndpoints:
    """The endpoints."""

    def __init__(self, journal: Path, pages: Pages) -> None:
        self._journal = journal
        self._pages = pages
        self._thread = ThreadPoolExecutor(1, "trends", initializer=go_last)
        self._waiting = 0

    def close(self) -> None:
        """Let go of the thread; what it adds up comes to its end."""
        self._thread.shutdown(wait=False, cancel_futures=True)

    def routes(self) -> list[Route]:
        """All of them."""
        endpoints = {
            f"{PREFIX}/trends": self.figures,
            "/trends": self.page,
            "/trends/report": self.report,
            "/trends/style.css": self.style,
        }
        return [Route(path, with_problems(endpoint), methods=["GET"]) for path, endpoint in endpoints.items()]

    async def figures(self, request: Request) -> Response:
        """The figures."""
        text = await self._made(request, lambda found: answer(found).model_dump_json())
        return Response(text, media_type="application/json")

    async def page(self, request: Request) -> Response:
        """The page of trends."""
        language, theme = self._pages.reader(request)
        links = self._links(Language(language), request)
        text = await self._made(request, lambda found: trends_page(Language(language), theme, found, links))
        return Response(text, media_type="text/html")

    async def report(self, request: Request) -> Response:
        """The shift's report."""
        language, _theme = self._pages.reader(request)
        text = await self._made(request, lambda found: shift_report(Language(language), found))
        return Response(text, media_type="text/html", headers={"content-security-policy": REPORT_POLICY})

    async def style(self, _request: Request) -> Response:
        """How the page looks."""
        return Response(STYLE, media_type="text/css")

    async def _made(self, request: Request, make: Callable[[History], str]) -> str:
        """What is made of the history that is asked for, both in the thread."""
        span, recipe = span_of(request), whole_number(request, "recipe", LARGEST_RECIPE, None)
        if self._waiting >= MOST_WAITING:
            raise RequestRefused(503, f"{MOST_WAITING} are being answered already", again_s=AGAIN_S)

        def made() -> str:
            with reading(self._journal) as journal:
                return make(history(journal, span, recipe))

        self._waiting += 1
        try:
            return await asyncio.get_running_loop().run_in_executor(self._thread, made)
        finally:
            self._waiting -= 1

    def _links(self, language: Language, request: Request) -> str:
        hours = whole_number(request, "hours", MOST_HOURS, USUAL_HOURS)
        recipe = whole_number(request, "recipe", LARGEST_RECIPE, None)
        told = [_link("/", words(language, "back"))]
        for span in PAGE_SPANS_H:
            text = words(language, "last_h" if span <= 24 else "last_d", n=span if span <= 24 else span // 24)
            told.append(_link("/trends", text, span == hours, hours=span, recipe=recipe))
        told.append(f"<span>{words(language, 'recipe')}</span>")
        told.append(_link("/trends", words(language, "all"), recipe is None, hours=hours))
        for number, name in self._pages.recipes():
            told.append(_link("/trends", f"{number} {name}", recipe == number, hours=hours, recipe=number))
        for span in REPORT_SPANS_H:
            told.append(_link("/trends/report", words(language, "report_of", n=span), hours=span))
        return f'<nav aria-label="{words(language, "span")}">{"".join(told)}</nav>'


def _link(path: str, text: str, current: bool = False, **parameters: int | None) -> str:
    asked = urlencode({name: value for name, value in parameters.items() if value is not None})
    mark = ' aria-current="true"' if current else ""
    return f'<a href="{path}{"?" if asked else ""}{html.escape(asked)}"{mark}>{html.escape(text)}</a>'


def span_of(request: Request) -> Span:
    """From `from` to `to`, or the last `hours`; raise RequestRefused."""
    end = _moment(request, "to") or datetime.now(UTC)
    hours = whole_number(request, "hours", MOST_HOURS, USUAL_HOURS) or USUAL_HOURS
    begin = _moment(request, "from") or end - timedelta(hours=hours)
    try:
        return Span(begin, end)
    except (ValueError, OverflowError) as error:
        raise RequestRefused(400, str(error)) from error


def _moment(request: Request, name: str) -> datetime | None:
    text = request.query_params.get(name)
    if text is None:
        return None
    try:
        return datetime.fromisoformat(text.replace(" ", "+")).astimezone(UTC)  # a + of a query that was not escaped
    except (ValueError, OverflowError) as error:
        told = f"{name} is {text[:40]!r}, expected a time such as 2026-11-21T06:00 or 2026-11-21T06:00Z"
        raise RequestRefused(400, told) from error
