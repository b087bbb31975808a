"""The soak's report: a section of docs/reports/reliability.md, written whole by the run that it tells of."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from textwrap import wrap
from typing import Any

from tests.soak.promises import PROMISES

BEGIN = "<!-- campaigns: written by `make soak` -->"
END = "<!-- end of campaigns -->"

NAMES = {
    "tcp": "jobs over Modbus TCP, line faults and restarts",
    "rtu": "jobs over Modbus RTU (pseudo-terminals), line faults and restarts",
    "rtu-over-tcp": "jobs over RTU in TCP, line faults and restarts",
    "service-kills": "`kill -9` of the service's process, each followed by a start",
    "controller-kills": "`kill -9` of the controller's process, each followed by a start",
    "service-stops": "the service's process stopped (SIGSTOP) for up to 5 s",
    "controller-stops": "the controller's process stopped for up to 5 s",
    "restored-journals": "a journal put back as it was some jobs ago",
    "copied-journals": "encounters of two services with copies of one journal, one number",
    "foreign-owners": "another service's block at the controller, once or for good",
    "spare-controllers": "the controller exchanged for a spare one with the same session",
    "changed-settings": "word order, kind or addresses changed while a job is on its way",
    "torn-values": "32-bit values half written for a scan of up to 100 ms",
    "small-disks": "disks full or read-only, also at the service's start",
    "serial-answers": "`kill -9` of a service that answers on a serial line",
    "fuzz": "cases of the fuzz of reply parser and mailbox decoder",
}
WIDTH = 120
UNITS = {
    **dict.fromkeys(("service-kills", "controller-kills", "serial-answers"), "kills"),
    **dict.fromkeys(("service-stops", "controller-stops"), "stops"),
    "copied-journals": "encounters",
    "small-disks": "faults",
    "fuzz": "cases",
}


def write_report(page: Path, results: list[dict[str, Any]]) -> None:
    """Put the report between the page's markers, at its end where it has none."""
    text = page.read_text(encoding="utf-8") if page.exists() else "# Reliability\n"
    if BEGIN not in text:
        text = f"{text.rstrip()}\n\n{BEGIN}\n{END}\n"
    before, _, rest = text.partition(BEGIN)
    _, _, after = rest.partition(END)
    page.write_text(f"{before}{BEGIN}\n{report(results)}{END}{after}", encoding="utf-8")


def report(results: list[dict[str, Any]]) -> str:
    """The section, Markdown."""
    by_campaign: dict[str, list[dict[str, Any]]] = {}
    for result in results:
        by_campaign.setdefault(result["campaign"], []).append(result)
    parts = ["## Campaigns", "", *_introduction(results), "", *_table(by_campaign), ""]
    parts += ["Violations, of all campaigns together:", "", *_promises(results), ""]
    parts += [
        "How the jobs ended, of all campaigns together:",
        "",
        *_counts("outcome", "jobs", results, "outcomes"),
        "",
    ]
    parts += ["What was done to the line:", "", *_counts("fault", "times", results, "faults"), ""]
    parts += ["What else happened: kills, stops, restarts, exchanges, and values that stood half written:", ""]
    parts += [*_counts("instant", "times", results, "instants"), ""]
    found = [text for result in results for text in result["texts"]]
    if found:
        parts += ["What was found, in words:", "", *[f"- {text[:300]}" for text in found[:50]], ""]
    return "\n".join(parts)


def _introduction(results: list[dict[str, Any]]) -> list[str]:
    hours = sum(result["seconds"] for result in results) / 3600
    first = (
        f"Written by `make soak`, which ran {len(results)} pieces, {hours:.1f} h of campaigns added up, several at a "
        "time. A piece is named `campaign:seed:amount` and can be run alone (`python -m tests.soak --piece NAME`); the "
        "seed fixes what is drawn, not how two processes meet in time. Seeds count from 1 in each campaign, and with "
        "them vary risk, word order, payload (one page to many), clock or none, lost memory, and a controller that "
        "takes many scans for a page (`tests/soak/pieces.py`). Where the amount is in jobs or encounters, they are "
        "carried out by the service's own parts as wired for `combtrace run`, in one process with the simulated "
        "controller, with a measurer that makes up contours; kills, stops and faults of disks are of `combtrace run` "
        "and `combtrace simulate-controller`, with pictures from files."
    )
    second = (
        "Judged is what both sides say: the controller's log and verdict, and the journal, read as SQLite "
        "(`tests/soak/promises.py`). Contours are compared with what was measured, to the micrometre."
    )
    third = (
        "Not in these campaigns: power cuts (a killed process keeps what it wrote to files; a journal that goes back "
        "to an earlier commit is in them), a lost journal, `mode: observe`, `handshake: none`, serial lines other than "
        "pseudo-terminals. No violations here: heartbeats that come late (line faults hold them back, and so does a "
        "busy machine); what the service writes while its settings are wrong on purpose; the requests of two services "
        "at once, which the verdict hears as one; and what a controller accepted that was taken away before it could "
        "say so. A job that ends as failed (153 or 155) though it was accepted is none where the protocol excepts it: "
        "the controller lost its memory, a job with a higher number had ended by then, or there is no `valid_for`."
    )
    return [*wrap(first, WIDTH), "", *wrap(second, WIDTH), "", *wrap(third, WIDTH)]


def _table(by_campaign: dict[str, list[dict[str, Any]]]) -> list[str]:
    lines = [
        "| campaign | seeds | amount | jobs | accepted | triggers acknowledged | incidents | faults | violations |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for campaign, name in NAMES.items():
        rows = by_campaign.get(campaign, [])
        if not rows:
            continue
        done = sum(row["done"] for row in rows)
        cells = [name, f"1 to {len(rows)}", f"{done} {UNITS.get(campaign, 'jobs')}"]
        cells += [str(sum(row[key] for row in rows)) for key in ("jobs", "accepted", "acknowledged", "restarts")]
        cells += [str(sum(sum(row[key].values()) for row in rows)) for key in ("faults", "findings")]
        lines.append(f"| {' | '.join(cells)} |")
    return lines


def _promises(results: list[dict[str, Any]]) -> list[str]:
    found: Counter[str] = Counter()
    for result in results:
        found.update(result["findings"])
    return [
        "| kind | what it is | seen |",
        "|---|---|---|",
        *[f"| {kind} | {text} | {found[kind]} |" for kind, text in PROMISES.items()],
    ]


def _counts(head: str, unit: str, results: list[dict[str, Any]], key: str) -> list[str]:
    found: Counter[str] = Counter()
    for result in results:
        found.update(result[key])
    return [f"| {head} | {unit} |", "|---|---|", *[f"| {name} | {count} |" for name, count in sorted(found.items())]]
