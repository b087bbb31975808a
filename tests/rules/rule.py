"""One rule of the protocol: by which code it is kept, and which test fails without it."""

from __future__ import annotations

import ast
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
TRANSFER, LINK, EXECUTOR, CYCLE = (
    "service/link/transfer.py",
    "service/link/link.py",
    "service/jobs/executor.py",
    "service/jobs/cycle.py",
)
JOURNAL, RESTART, OWNERSHIP, CLOCK = (
    "service/records/journal.py",
    "service/records/journal_restart.py",
    "service/link/ownership.py",
    "service/link/controller_clock.py",
)
PAGE_TEXT = "drivers/controller/mailbox/page_text.py"
CONNECTION, READING, WRITING, NUMBERS, TRANSFER_TERMS = (
    f"service/link/{name}.py" for name in ("connection", "reading", "writing", "job_numbers", "transfer_terms")
)
IN_CLOCK, IN_DOUBT = "tests/service/link/test_controller_clock.py", "tests/service/link/test_transfer_in_doubt.py"
TRIGGERS, IN_ANSWERS = "service/jobs/triggers.py", "tests/service/jobs/test_serial_answers.py"
IN_RESTART = "tests/service/jobs/test_executor_after_restart.py"
IN_BESIDE = "tests/service/link/test_link_beside_another.py"
IN_TRANSFER, IN_PAGES, IN_LINK, IN_EXECUTOR, IN_CYCLE, IN_RESUMING, IN_OWNERSHIP, IN_JOURNAL, IN_RECOVERY = (
    f"tests/service/{room}/test_{name}.py"
    for room, name in (
        *(("link", "transfer"), ("link", "transfer_pages"), ("link", "link"), ("jobs", "executor"), ("jobs", "cycle")),
        *(
            ("jobs", "cycle_after_restart"),
            ("link", "ownership"),
            ("records", "journal"),
            ("records", "journal_recovery"),
        ),
    )
)


@dataclass(frozen=True)
class Rule:
    """One rule.

    said: its place in protocol.md and what it says. code: `file::Class.function` that keeps it; test: `file::function`
    that fails without it. With the line `there` of the code turned into `without`, the rule is taken out.
    """

    said: str
    code: str
    test: str
    there: str
    without: str

    def taken_out(self) -> str:
        """The text of the code's file without the rule."""
        text = (ROOT / self.code.partition("::")[0]).read_text(encoding="utf-8")
        whole = source_of(self.code)
        return text.replace(whole, whole.replace(self.there, self.without, 1))


def source_of(name: str) -> str:
    """The source of `file::Class.function`; AssertionError where it does not exist."""
    path, _, names = name.partition("::")
    text = (ROOT / path).read_text(encoding="utf-8")
    node: ast.AST = ast.parse(text)
    for part in names.split("."):
        found = [child for child in ast.iter_child_nodes(node) if getattr(child, "name", None) == part]
        assert found, f"{name} does not exist"
        node = found[-1]
    return ast.get_source_segment(text, node) or ""
