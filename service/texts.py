"""Texts of a room in its reader's language: static/texts.json beside its code, a text by language and key."""

from __future__ import annotations

import json
from functools import cached_property
from importlib.resources import files

from service.reasons import Language


class Texts:
    """A room's texts, read when the first is asked for."""

    def __init__(self, room: str) -> None:
        """room: its package, such as `service.trends`."""
        self._room = room

    def static(self, name: str) -> str:
        """A file of what the room's pages are made of."""
        return (files(self._room) / "static" / name).read_text(encoding="utf-8")

    @cached_property
    def _known(self) -> dict[str, dict[str, str]]:
        return dict(json.loads(self.static("texts.json")))

    def words(self, language: Language, key: str, **values: object) -> str:
        """A text, with its values put in."""
        return self._known[language][key].format(**values)
