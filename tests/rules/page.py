"""The table of rules in docs/reports/reliability.md: `python -m tests.rules.page` writes it."""

from __future__ import annotations

from pathlib import Path

from tests.rules.table import RULES

PAGE = Path(__file__).parents[2] / "docs" / "reports" / "reliability.md"
BEGIN, END = "<!-- rules: written by `python -m tests.rules.page` -->", "<!-- end of rules -->"


def table() -> str:
    """The table as Markdown."""
    rows = "".join(f"| {rule.said} | `{rule.code}` | `{rule.test}` |\n" for rule in RULES)
    return f"| rule of the protocol | the code that keeps it | the test that fails without it |\n|---|---|---|\n{rows}"


def fresh(page: str) -> str:
    """The page with the table as it is now."""
    before, rest = page.split(BEGIN)
    _, after = rest.split(END)
    return f"{before}{BEGIN}\n{table()}{END}{after}"


if __name__ == "__main__":
    PAGE.write_text(fresh(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
