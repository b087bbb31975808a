"""The page of all cells, and the same as JSON: looked at, never told anything."""

from __future__ import annotations

import hashlib
import html
import json
import re
from collections import Counter
from collections.abc import Callable
from datetime import UTC, datetime
from importlib.resources import files

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route
from starlette.types import ASGIApp

from service.details import russian
from service.fleet.settings import FleetPage
from service.fleet.views import CellView, FleetView, Quantity
from service.reasons import Language, Reason
from service.trends.words import lasting, number
from service.web.guard import Guard
from service.web.html import preferred
from service.web.models import Problem

TYPES = {"js": "text/javascript", "css": "text/css", "svg": "image/svg+xml"}
SHARED = ("page.css", "icon.svg")  # of a cell's own page, as are symbols and words of states
_CODES = {int(reason) for reason in Reason}


class Pages:
    """What is served of the fleet."""

    def __init__(self, settings: FleetPage, look: Callable[[], FleetView], version: str) -> None:
        self._settings, self._look, self._version = settings, look, version
        own, shared = files("service.fleet") / "static", files("service.web") / "static"
        self._files = {name: (own / name).read_bytes() for name in ("fleet.css", "fleet.js")}
        self._files |= {name: (shared / name).read_bytes() for name in SHARED}
        self._symbols = (shared / "symbols.svg").read_text(encoding="utf-8")
        words: dict[str, dict[str, str]] = json.loads((shared / "texts.json").read_text(encoding="utf-8"))
        mine: dict[str, dict[str, str]] = json.loads((own / "fleet.json").read_text(encoding="utf-8"))
        self._words = {language: words[language] | mine[language] for language in words}
        self._template = (own / "fleet.html").read_text(encoding="utf-8")

    def application(self) -> ASGIApp:
        """All of it, behind the guard that cells' own pages have."""

        async def unknown(_request: Request, _error: Exception) -> Response:
            said = Problem(error="there is nothing here. See / and /api/v1/cells").model_dump_json()
            return Response(said, 404, media_type="application/json")

        routes = [
            Route("/", self.page, methods=["GET"]),
            Route("/api/v1/cells", self.cells, methods=["GET"]),
            Route("/static/{name}", self.file, methods=["GET"]),
        ]
        served = Starlette(routes=routes, exception_handlers={404: unknown, 405: unknown})
        return Guard(served, self._settings.names)

    async def cells(self, _request: Request) -> Response:
        """All cells as JSON."""
        return Response(self._look().model_dump_json(), media_type="application/json")

    async def file(self, request: Request) -> Response:
        """One of the page's files."""
        data = self._files.get(request.path_params["name"])
        if data is None:
            return Response(status_code=404)
        tag = f'"{hashlib.sha256(data).hexdigest()[:16]}"'
        headers = {"etag": tag, "cache-control": "no-cache"}
        if request.headers.get("if-none-match") == tag:
            return Response(status_code=304, headers=headers)
        return Response(data, media_type=TYPES[request.path_params["name"].rpartition(".")[2]], headers=headers)

    async def page(self, request: Request) -> Response:
        """All cells as they are now; the page's script asks for it again each second."""
        language = self._language(request)
        words, view = self._words[language], self._look()
        other = next(one for one in self._words if one != language)
        now_ms = round(datetime.now(UTC).timestamp() * 1000)
        rows = "".join(_row(cell, Language(language), words, now_ms) for cell in view.cells)
        shown = {
            "language": language,
            "other": other,
            "other_name": self._words[other]["name"],
            "symbols": self._symbols,
            "summary": _summary(view, words),
            "rows": rows or f'<tr><td colspan="9">{html.escape(words["nobody"])}</td></tr>',
            "version": html.escape(self._version),
        }
        text = re.sub(r"\{\{t:(\w+)\}\}", lambda found: html.escape(words[found[1]]), self._template)
        return Response(re.sub(r"\{\{(\w+)\}\}", lambda found: shown[found[1]], text), media_type="text/html")

    def _language(self, request: Request) -> str:
        asked = request.query_params.get("language", self._settings.language)
        return asked if asked in self._words else preferred(request.headers.get("accept-language", ""))


def _summary(view: FleetView, words: dict[str, str]) -> str:
    """How many are well, by kind of state; in words and shapes."""
    if not view.connected:
        return f'<li data-kind="lost">{_shape("lost")} {html.escape(words["no_broker"])}</li>'
    kinds = Counter(_kind_word(cell, words) for cell in view.cells)
    return "".join(
        f'<li data-kind="{kind}">{_shape(kind)} <b>{count}</b> {html.escape(word)}</li>'
        for (kind, word), count in kinds.items()
    )


def _kind_word(cell: CellView, words: dict[str, str]) -> tuple[str, str]:
    if cell.condition != "here":
        return cell.kind, words[cell.condition]
    return cell.kind, words.get(cell.state, cell.state)


def _shape(kind: str) -> str:
    return f'<svg class="mark" viewBox="0 0 24 24" aria-hidden="true"><use href="#s-{kind}"/></svg>'


def _row(cell: CellView, language: Language, words: dict[str, str], now_ms: int) -> str:
    kind, word = _kind_word(cell, words)
    name = html.escape(cell.node)
    link = name if cell.page is None else f'<a href="{html.escape(cell.page)}" rel="noreferrer">{name}</a>'
    since = _ago(cell.state_since_ms if cell.condition == "here" else cell.heard_ms, language, now_ms)
    parts = (
        f'<th scope="row">{link}<small>{html.escape(cell.group)}</small></th>',
        f'<td data-kind="{kind}">{_shape(kind)} <b>{html.escape(word)}</b><small>{since}</small></td>',
        f"<td>{_why(cell, language)}</td>",
        f"<td>{_last(cell, language, words, now_ms)}</td>",
        f"<td>{_shift(cell, words)}</td>",
        f"<td>{_quantity(cell.uncertainty_mm, language, words)}</td>",
        f"<td>{_quantity(cell.blur_px, language, words)}</td>",
        f"<td>{_calibration(cell, language, words)}</td>",
        f"<td>{_same(cell, words)}</td>",
    )
    return f'<tr id="{html.escape(cell.group)}/{name}">{"".join(parts)}</tr>'


def _ago(at_ms: int | None, language: Language, now_ms: int) -> str:
    return "" if not at_ms else html.escape(lasting(language, max(0, now_ms - at_ms) // 1000))


def _why(cell: CellView, language: Language) -> str:
    """What a person does next, and what was seen."""
    if cell.condition != "here":
        return ""
    told = ""
    if cell.reason and cell.reason_code in _CODES:
        words = Reason(cell.reason_code).explained(language)
        told = f"<b>{html.escape(words.sentence)}</b> {html.escape(words.next_action)}"
    seen = cell.alarms or ([cell.reason] if cell.reason else [])
    return told + "".join(f"<small>{html.escape(_spoken(text, language))}</small>" for text in [*seen, *cell.warnings])


def _spoken(text: str, language: Language) -> str:
    part, colon, rest = text.partition(": ")
    return text if language is Language.ENGLISH else f"{part}{colon}{russian(rest)}" if colon else russian(text)


def _last(cell: CellView, language: Language, words: dict[str, str], now_ms: int) -> str:
    outcome = cell.last_outcome
    if cell.last_job is None or outcome not in ("accepted", "written", "refused", "failed"):
        return f"<small>{html.escape(words['none'])}</small>"
    return (
        f'<span data-kind="{outcome}">{_shape(outcome)} {html.escape(words[outcome])}</span>'
        f"<small>{cell.last_job}, {_ago(cell.last_settled_ms, language, now_ms)}</small>"
    )


def _shift(cell: CellView, words: dict[str, str]) -> str:
    counts = cell.shift
    good = counts.get("accepted", 0) + counts.get("written", 0)
    told = [(good, words["accepted"]), (counts.get("refused", 0), words["refused"])]
    told += [(counts.get("failed", 0), words["failed"]), (cell.missed_triggers or 0, words["missed"])]
    shown = [f"<b>{count}</b> {html.escape(word)}" for place, (count, word) in enumerate(told) if count or not place]
    unsent = f'<small class="flag">{cell.not_sent} {html.escape(words["not_sent"])}</small>' if cell.not_sent else ""
    return ", ".join(shown) + unsent


def _quantity(quantity: Quantity, language: Language, words: dict[str, str]) -> str:
    worse = quantity.worse_percent
    trend = "" if worse is None else f"{'+' if worse >= 0 else '−'}{number(language, abs(worse), 0)} %"
    told = _flags([f"{trend} {words['drifts']}"]) if quantity.drifts else f"<small>{trend}</small>"
    return number(language, quantity.mean) + told


def _calibration(cell: CellView, language: Language, words: dict[str, str]) -> str:
    days = cell.calibration_age_days
    age = "–" if days is None else f"{number(language, days, 0)} {words['days']}"
    flags = [words[key] for key, true in (("old", cell.calibration_old), ("shared", cell.calibration_shared)) if true]
    return f"{html.escape(age)}<small><code>{html.escape(cell.calibration[:8])}</code></small>{_flags(flags)}"


def _same(cell: CellView, words: dict[str, str]) -> str:
    """Version and recipes, and whether others have the same."""
    flags = [words["version_differs"]] if cell.version_differs else []
    flags += [words["recipes_differ"]] if cell.recipes_differ else []
    return f"{html.escape(cell.version)}<small><code>{html.escape(cell.recipes[:8])}</code></small>{_flags(flags)}"


def _flags(flags: list[str]) -> str:
    return "".join(f'<small class="flag">{html.escape(flag)}</small>' for flag in flags)
