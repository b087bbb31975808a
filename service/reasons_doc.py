"""The page of all reasons, made from their one table: `python -m service.reasons_doc docs/reference/reasons.md`."""

from __future__ import annotations

import sys
from pathlib import Path

from service.reasons import Language, Reason

HEAD = """\
# Why a job was not accepted

Made from the table in `service/reasons.py`; a test keeps it fresh. `combtrace reasons` prints the same. The code stands
in `reject_reason` of the service block, in the journal, in the log, and in the `FAIL` and `NAK` lines of the serial
trigger. Each refusal also says what was measured, the limit, and what to do.

*Refused*: the block or the picture was not good enough. *Failed*: something did not work.
"""
TITLES = {Language.ENGLISH: "English", Language.RUSSIAN: "Русский"}
COLUMNS = {
    Language.ENGLISH: "| code | name | outcome | meaning | next action |",
    Language.RUSSIAN: "| код | имя | исход | что случилось | что делать |",
}


def page() -> str:
    """The whole page."""
    return HEAD + "".join(_section(language) for language in Language)


def _section(language: Language) -> str:
    rows = [COLUMNS[language], "|--:|---|---|---|---|"]
    for reason in Reason:
        told = reason.explained(language)
        rows.append(f"| {int(reason)} | {reason.label} | {reason.outcome} | {told.sentence} | {told.next_action} |")
    return f"\n## {TITLES[language]}\n\n" + "\n".join(rows) + "\n"


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(page(), encoding="utf-8")
