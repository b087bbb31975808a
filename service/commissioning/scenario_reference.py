"""The tables of docs/reference/simulated-controller.md, made from the scenario's models, so that they say what is so.

`python -m service.commissioning.scenario_reference docs/reference/simulated-controller.md` writes them between its
markers.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drivers.controller.simulated.faults import FAULT_KINDS, TARGETS
from drivers.controller.simulated.scenario import EVENT_KINDS
from drivers.controller.simulated.verdict import KINDS
from service.commissioning import scenario_file
from service.config.reference import rows
from service.config.values import Model

BEGIN = "<!-- made from the models -->\n"
END = "<!-- end of what is made -->\n"
SECTIONS: tuple[tuple[str, type[Model], dict[str, Mapping[Any, str]]], ...] = (
    ("`machine`: how the controller's program runs", scenario_file.Machine, {}),
    ("`events`: a list of what the machine does of its own accord", scenario_file.Event, {"do": EVENT_KINDS}),
    (
        "`faults`: a list of what befalls requests; the first that strikes a request counts",
        scenario_file.Fault,
        {"fault": FAULT_KINDS, "request": TARGETS},
    ),
)


def tables() -> str:
    """The sections, Markdown."""
    text = "\n`seed` (a whole number, default 0) fixes all that is random.\n"
    for title, model, words in SECTIONS:
        text += f"\n### {title}\n\n| key | value | default | meaning |\n|---|---|---|---|\n"
        text += "".join(row for row in rows(model) if row.split("`")[1] not in words)
        for key, meanings in words.items():
            text += f"\n| `{key}` | meaning |\n|---|---|\n"
            text += "".join(f"| {word} | {meaning} |\n" for word, meaning in meanings.items())
    text += "\n### Kinds of violation in the verdict\n\n| kind | rule that was broken |\n|---|---|\n"
    return text + "".join(f"| {kind} | {rule} |\n" for kind, rule in KINDS.items()) + "\n"


def with_tables(page: str) -> str:
    """The page with its tables fresh."""
    before, _, rest = page.partition(BEGIN)
    return before + BEGIN + tables() + END + rest.partition(END)[2]


if __name__ == "__main__":
    path = Path(sys.argv[1])
    path.write_text(with_tables(path.read_text(encoding="utf-8")), encoding="utf-8")
