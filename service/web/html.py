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

from service.details import russian
from service.reasons import Language, Reason
from service.web.daemon_access import DaemonAccess, DaemonSilent
from service.web.requests import Endpoint

TYPES = {"js": "text/javascript", "css": "text/css", "svg": "image/svg+xml", "json": "application/json"}
OWN = ("commission", "recipes")  # pages beside the operator's, each with its words in a file of its name
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

    def __init__(self, daemon: DaemonAccess, language: str, *, orders: bool) -> None:
        """language: of visitors who have not chosen, auto = their browser's. orders: whether any can be given."""
        self._daemon = daemon
        self._language = language
        self._orders = orders
        folder = files("service.web") / "static"
        self._files = {one.name: one.read_bytes() for one in folder.iterdir() if not one.name.endswith(".html")}
        self._tags = {name: f'"{hashlib.sha256(data).hexdigest()[:16]}"' for name, data in self._files.items()}
        self._texts: dict[str, dict[str, str]] = json.loads(self._files["texts.json"])
        shared = {
            **{name: _template(name) for name in ("head", "dialogs")},
            "symbols": self._files["symbols.svg"].decode(),
        }
        self._templates: dict[tuple[str, str], str] = {}
        for name in ("page", *OWN):
            own: dict[str, dict[str, str]] = json.loads(self._files[f"{name}.json"]) if name in OWN else {}
            for spoken in LANGUAGES:
                words = self._texts[spoken] | own.get(spoken, {})
                self._templates[name, spoken] = _worded(_filled(_template(name), shared), words)

    def routes(self) -> list[Route]:
        """The pages, and their files."""
        return [
            Route("/", self.page, methods=["GET"]),
            *(Route(f"/{name}", self._own(name), methods=["GET"]) for name in OWN),
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
        language, theme = self.reader(request)
        try:
            state: dict[str, Any] | None = await self._daemon.state()
        except DaemonSilent:
            state = None
        kiosk = ' data-view="kiosk"' if "kiosk" in request.query_params else ""
        return self._answer("page", language, theme, view=kiosk, **self._banner(state, language))

    def _own(self, name: str) -> Endpoint:
        """A page that asks for all it shows itself."""

        async def answer(request: Request) -> Response:
            return self._answer(name, *self.reader(request))

        return answer

    def _answer(self, name: str, language: str, theme: str, **more: str) -> Response:
        other = next(one for one in LANGUAGES if one != language)
        shown = {
            "theme": theme,
            "orders": "on" if self._orders else "off",
            "language": language,
            "other": other,
            "other_name": self._texts[other]["name"],
        }
        return Response(_filled(self._templates[name, language], shown | more), media_type="text/html")

    def reader(self, request: Request) -> tuple[str, str]:
        """In which language and theme somebody reads."""
        language = _one_of(request.cookies.get("language"), LANGUAGES, self._language_of(request))
        return language, _one_of(request.cookies.get("theme"), THEMES, "auto")

    def recipes(self) -> tuple[tuple[int, str], ...]:
        """Number and name of each."""
        return self._daemon.sources.recipes()

    def _language_of(self, request: Request) -> str:
        """Of somebody who has not chosen."""
        if self._language in LANGUAGES:
            return self._language
        return preferred(request.headers.get("accept-language", ""))

    def _banner(self, state: dict[str, Any] | None, language: str) -> dict[str, str]:
        texts = self._texts[language]
        shown = {
            "since": "",
            "whys": "",
            "why_hidden": " hidden",
            **_last(None, language, texts),
        }
        if state is None:
            return {**shown, "kind": "lost", "state": texts["lost"]}
        shown |= _last(state["last_job"], language, texts)
        whys = "".join(_why(fault["code"], fault["text"], language) for fault in state["faults"].values())
        if whys:
            shown |= {"whys": whys, "why_hidden": ""}
        kind, word = KINDS[state["state"]], state["state"]
        if kind == "ready" and state["link"] is not None and state["link"]["not_ready"] is not None:
            kind, word = "waiting", "waiting"
        since = _seen_as(state["reason"] or "", language)
        return {**shown, "kind": kind, "state": texts[word], "since": html.escape(since)}


def _last(job: dict[str, Any] | None, language: str, texts: dict[str, str]) -> dict[str, str]:
    """What became of the last block."""
    if job is None or job["outcome"] is None:
        return {"last_kind": "none", "last_word": texts["none"], "last_of": "", "last_why": ""}
    kind = job["outcome"]
    told = Reason(job["code"]).explained(Language(language)) if job["code"] else None
    why = f"{told.sentence} {told.next_action}" if told else ""
    of = texts["job_runs"].replace("{job}", str(job["job"]))
    return {"last_kind": kind, "last_word": texts[kind], "last_of": of, "last_why": html.escape(why)}


def _seen_as(text: str, language: str) -> str:
    return russian(text) if language == Language.RUSSIAN else text


def _why(code: int, text: str, language: str) -> str:
    words = Reason(code).explained(Language(language))
    return (
        f"<li><strong>{html.escape(words.sentence)}</strong> {html.escape(words.next_action)}"
        f"<small>{html.escape(_seen_as(text, language))}</small></li>"
    )


def _template(name: str) -> str:
    return (files("service.web") / "static" / f"{name}.html").read_text(encoding="utf-8")


def _filled(template: str, values: dict[str, str]) -> str:
    """The template with values in their places, {{name}}."""
    for name, value in values.items():
        template = template.replace(f"{{{{{name}}}}}", value)
    return template


def _worded(template: str, texts: dict[str, str]) -> str:
    """The template with its words filled in: elements of `data-t`, and labels of `data-a`."""
    filled = re.sub(r'data-t="(\w+)"[^>]*>', lambda found: f"{found[0]}{html.escape(texts[found[1]])}", template)
    return re.sub(r'data-a="(\w+)"', lambda found: f'{found[0]} aria-label="{html.escape(texts[found[1]])}"', filled)


def preferred(accept_language: str) -> str:
    """Which of the page's languages a browser asks for first; English where none of them. By RFC 9110, 12.5.4."""
    asked: list[tuple[float, str]] = []
    for part in accept_language.split(","):
        tag, _, quality = part.strip().partition(";q=")
        try:
            asked.append((float(quality or 1), tag.strip().lower().partition("-")[0]))
        except ValueError:  # no quality of that standard
            continue
    known = [(quality, language) for quality, language in asked if language in LANGUAGES and quality > 0]
    return max(known, key=lambda one: one[0], default=(1.0, LANGUAGES[0]))[1]


def _one_of(value: str | None, known: tuple[str, ...], otherwise: str) -> str:
    return value if value in known else otherwise
