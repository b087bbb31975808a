"""The page's HTML: made here in the visitor's language with the state in it, so that it says something at once.

From then on `static/page.js` keeps it up to date by the REST interface.
"""

from __future__ import annotations

import hashlib
import html
import json
import re
from importlib.resources import files
from typing import Any, Literal

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from service.reasons import Language, Reason
from service.web.daemon_access import DaemonAccess, DaemonSilent

TYPES = {"js": "text/javascript", "css": "text/css", "svg": "image/svg+xml", "json": "application/json"}
PAGE = "page.html"
LANGUAGES: tuple[Literal["en"], Literal["ru"]] = ("en", "ru")
THEMES = ("auto", "dark", "light")
KINDS = {
    "Preoperational": "starting",
    "Initialized": "starting",
    "Ready": "ready",
    "SingleExecution": "busy",
    "ContinuousExecution": "busy",
    "Halted": "halted",
    "Error": "fault",
}
"""What shape and colour tell of each state; `static/now.js` has the same."""


class Pages:
    """The page and what it is made of, all in memory: a request names none of the file system's paths."""

    def __init__(self, daemon: DaemonAccess, language: str) -> None:
        """language: of visitors who have not chosen."""
        self._daemon = daemon
        self._language = language
        folder = files("service.web") / "static"
        self._files = {entry.name: entry.read_bytes() for entry in folder.iterdir() if entry.name != PAGE}
        self._tags = {name: f'"{hashlib.sha256(data).hexdigest()[:16]}"' for name, data in self._files.items()}
        self._texts: dict[str, dict[str, str]] = json.loads(self._files["texts.json"])
        template = (folder / PAGE).read_text(encoding="utf-8")
        template = template.replace("{{symbols}}", self._files["symbols.svg"].decode())
        self._templates: dict[str, str] = {language: _worded(template, self._texts[language]) for language in LANGUAGES}

    def routes(self) -> list[Route]:
        """The page, and its files."""
        return [
            Route("/", self.page, methods=["GET"]),
            Route("/static/{name}", self.file, methods=["GET"]),
        ]

    async def file(self, request: Request) -> Response:
        """One of the page's files."""
        name = request.path_params["name"]
        data = self._files.get(name)
        if data is None:
            return Response(status_code=404)
        headers = {"etag": self._tags[name], "cache-control": "no-cache"}
        if request.headers.get("if-none-match") == self._tags[name]:
            return Response(status_code=304, headers=headers)
        return Response(data, media_type=TYPES[name.rpartition(".")[2]], headers=headers)

    async def page(self, request: Request) -> Response:
        """The page as things are now."""
        language = _one_of(request.cookies.get("language"), LANGUAGES, self._language)
        theme = _one_of(request.cookies.get("theme"), THEMES, "auto")
        try:
            state: dict[str, Any] | None = await self._daemon.state()
        except DaemonSilent:
            state = None
        text = self._templates[language]
        for name, value in {"theme": theme, **self._banner(state, language)}.items():
            text = text.replace(f"{{{{{name}}}}}", value)
        return Response(text, media_type="text/html")

    def _banner(self, state: dict[str, Any] | None, language: str) -> dict[str, str]:
        texts = self._texts[language]
        other = next(one for one in LANGUAGES if one != language)
        shown = {
            "language": language,
            "other": other,
            "other_name": self._texts[other]["name"],
            "since": "",
            "whys": "",
            "why_hidden": " hidden",
        }
        if state is None:
            return {**shown, "kind": "lost", "state": texts["lost"]}
        whys = "".join(_why(fault["code"], fault["text"], language) for fault in state["faults"].values())
        if whys:
            shown |= {"whys": whys, "why_hidden": ""}
        kind, word = KINDS[state["state"]], state["state"]
        if kind == "ready" and state["link"] is not None and state["link"]["not_ready"] is not None:
            kind, word = "waiting", "waiting"
        return {**shown, "kind": kind, "state": texts[word], "since": html.escape(state["reason"] or "")}


def _why(code: int, text: str, language: str) -> str:
    words = Reason(code).explained(Language(language))
    return (
        f"<li><strong>{html.escape(words.sentence)}</strong> {html.escape(words.next_action)}"
        f"<small>{html.escape(text)}</small></li>"
    )


def _worded(template: str, texts: dict[str, str]) -> str:
    """The template with its words filled in: elements of `data-t`, and labels of `data-a`."""
    filled = re.sub(r'data-t="(\w+)">', lambda found: f"{found[0]}{html.escape(texts[found[1]])}", template)
    return re.sub(r'data-a="(\w+)"', lambda found: f'{found[0]} aria-label="{html.escape(texts[found[1]])}"', filled)


def _one_of(value: str | None, known: tuple[str, ...], otherwise: str) -> str:
    return value if value in known else otherwise
