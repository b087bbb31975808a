"""The report's texts in its reader's language."""

from __future__ import annotations

import json
from functools import cache
from importlib.resources import files

from service.reasons import Language


@cache
def _texts() -> dict[str, dict[str, str]]:
    return dict(json.loads((files("service.replays.report") / "static" / "texts.json").read_text(encoding="utf-8")))


def words(language: Language, key: str, **values: object) -> str:
    """A text, with its values put in."""
    return _texts()[language][key].format(**values)
