"""`combtrace jobs`: what the journal says of jobs, while the daemon runs or not."""

from __future__ import annotations

import argparse
import json
import sys
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from service.cli.errors import EXIT_OK, UserError
from service.cli.options.jobs import add_config_argument, add_filter_arguments, config_of, filter_of, job_number

if TYPE_CHECKING:
    from service.config.config import Config
    from service.records.job import Job

HELP = "list jobs and their ends, or show one"
DESCRIPTION = """\
List the jobs of the journal, the newest last, or show all that is known of one.
The daemon may run meanwhile; nothing is written.

Exit status: 0 done, 2 no such job, unreadable journal or wrong usage."""

LIMIT = 50
HEAD = ("job", "taken", "trigger", "recipe", "outcome", "reason", "vertices", "area_mm2", "sure_mm", "ms")
RIGHT = {"job", "recipe", "vertices", "area_mm2", "sure_mm", "ms"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which jobs, and how they are told."""
    parser.add_argument("what", nargs="?", choices=("show",), help="show N: all that is known of job N")
    parser.add_argument("number", nargs="?", type=job_number, metavar="N")
    add_config_argument(parser)
    add_filter_arguments(parser)
    parser.add_argument("--limit", type=int, default=LIMIT, metavar="N", help=f"the newest N; default {LIMIT}, 0 = all")
    parser.add_argument("--json", action="store_true", help="JSON Lines, one object a job")


def run(args: argparse.Namespace) -> int:
    """List, or show."""
    from service.records.journal_reader import JournalUnreadable, reading

    if (args.what is None) != (args.number is None):
        raise UserError("which job? `combtrace jobs show N`, or `combtrace jobs` for a list")
    if args.limit < 0:
        raise UserError(f"--limit {args.limit}: expected 0 or more")
    config = config_of(args)
    try:
        with reading(config.journal.path) as journal:
            if args.number is not None:
                job = journal.find(args.number)
                if job is None:
                    raise UserError(f"{config.journal.path}: there is no job {args.number}, or no longer")
                found = [job]
            else:
                found = journal.jobs(filter_of(args), args.limit or None)
            for text in journal.damaged:
                print(f"left out: {text}", file=sys.stderr)
    except JournalUnreadable as error:
        raise UserError(str(error)) from error
    if args.json:
        _print_json(found, config)
    elif args.number is not None:
        _print_one(found[0], config)
    else:
        _print_table(found)
    return EXIT_OK


def _print_json(jobs: list[Job], config: Config) -> None:
    from service.records.archive import files_of
    from service.records.evidence import job_fields

    for job in jobs:
        try:
            files = [str(path) for path in files_of(config.archive.path, job.job_id)]
        except OSError as error:
            raise UserError(f"{config.archive.path}: cannot be looked at: {error.strerror}") from error
        print(json.dumps({**job_fields(job), "evidence": files}, ensure_ascii=False))


def _print_table(jobs: list[Job]) -> None:
    if not jobs:
        print("no such jobs", file=sys.stderr)
        return
    rows = [HEAD, *(_row(job) for job in jobs)]
    widths = [max(len(row[column]) for row in rows) for column in range(len(HEAD))]
    for row in rows:
        cells = zip(HEAD, row, widths, strict=True)
        print("  ".join(f"{cell:>{width}}" if name in RIGHT else f"{cell:<{width}}" for name, cell, width in cells))


def _row(job: Job) -> tuple[str, ...]:
    report = job.report
    return (
        str(job.job_id),
        local(job.taken_at),
        job.trigger.kind,
        str(report_recipe(job)),
        str(job.outcome or "in flight"),
        "" if job.reason is None else f"{int(job.reason)} {job.reason.label}",
        _number(report.get("vertices"), 0),
        _number(report.get("area_mm2"), 0),
        _number(report.get("uncertainty_mm"), 2),
        _number(report.get("total_ms"), 0),
    )


def report_recipe(job: Job) -> int | str:
    """The recipe's number, where it is known."""
    if job.terms is not None:
        return int(job.terms.recipe["number"])
    return job.trigger.recipe or "default"


def local(moment: str | None) -> str:
    """A time of the journal, by this computer's zone."""
    if moment is None:
        return ""
    return datetime.fromisoformat(moment).astimezone().strftime("%Y-%m-%d %H:%M:%S")


def _number(value: Any, digits: int) -> str:
    return "" if value is None else f"{value:.{digits}f}"


def _print_one(job: Job, config: Config) -> None:
    for name, value in lines_of(job):
        print(f"{name:<14} {value}")
    for path in _evidence(job, config):
        print(f"{'evidence':<14} {path}")
    if job.reason is not None:
        print(f"\n{job.reason.explained()}")


def _evidence(job: Job, config: Config) -> list[Path | str]:
    from service.records.archive import files_of

    try:
        return [*files_of(config.archive.path, job.job_id)] or ["none is kept"]
    except OSError as error:
        return [f"{config.archive.path} cannot be looked at: {error.strerror}"]


def lines_of(job: Job) -> list[tuple[str, str]]:
    """All that the journal says of one job, as names and values."""
    trigger, report = job.trigger, job.report
    asked = f"{trigger.kind}, recipe {trigger.recipe or 'default'}"
    asked += f", thickness {trigger.thickness_um / 1000:g} mm" if trigger.thickness_um else ""
    asked += f", counter {trigger.counter} in session {trigger.session}" if trigger.counter else ""
    ended = str(job.outcome or "in flight") + (f": {int(job.reason)} {job.reason.label}" if job.reason else "")
    lines = [("job", str(job.job_id)), ("taken", local(job.taken_at)), ("trigger", asked), ("outcome", ended)]
    lines += [("detail", job.detail)] if job.detail else []
    lines += [("settled", local(job.settled_at))] if job.settled_at else []
    for name in ("frame", "method", "polarity", "pitch_px", "vertices", "area_mm2", "uncertainty_mm", "thickness_mm"):
        if report.get(name) is not None:
            lines.append((name, str(report[name])))
    times = {"frame": report.get("frame_ms"), **report.get("timings_ms", {})}
    times |= {"transfer": report.get("transfer_ms"), "all": report.get("total_ms")}
    told = ", ".join(f"{name} {value:.1f}" for name, value in times.items() if value is not None and name != "total")
    lines += [("stages, ms", told)] if told else []
    lines += [("transfer", _pairs(job.transfer))] if job.transfer else []
    if job.terms is not None:
        lines += [("recipe", _pairs(job.terms.recipe)), ("calibration", job.terms.calibration or "none")]
    return lines


def _pairs(values: dict[str, Any]) -> str:
    return ", ".join(f"{name} {json.dumps(value, ensure_ascii=False)}" for name, value in values.items())
