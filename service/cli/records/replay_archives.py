"""`combtrace replay --output`: archives done again by many processes or a cluster; a table, a report, conditions."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from service.cli.errors import EXIT_OK, EXIT_REFUSED, EXIT_UNUSABLE, UserError
from service.cli.options.jobs import config_of
from service.cli.records.replay_progress import ProgressTold

if TYPE_CHECKING:
    from service.config.config import Config
    from service.records.replay import Settings
    from service.replays.places import Place
    from service.replays.report.conditions import Condition
    from service.replays.report.page import RunTold
    from service.replays.report.summary import Summary
    from service.replays.rows import Row
    from service.replays.run import Progress
    from service.replays.run_files import RunFiles, Terms
    from service.replays.work import JobName, Work
    from service.replays.workers import Workers

MOST_WORKERS = 256
NEEDS_OUTPUT = ("archive", "workers", "scheduler", "report", "against", "fail_on")

Choose = Callable[["Config"], list[int]]


def add_archive_arguments(parser: argparse.ArgumentParser) -> None:
    """Which archives, who does it, where to, and on what it fails."""
    group = parser.add_argument_group("whole archives, with --output")
    group.add_argument("--output", type=Path, metavar="FILE.parquet", help="a row a job; the same command goes on")
    group.add_argument(
        "--archive",
        action="append",
        metavar="[CELL=]PLACE",
        help="folder or s3://bucket/path; else the configuration's",
    )
    group.add_argument("--workers", type=_count, metavar="N", help="processes of this machine; default 1")
    group.add_argument("--scheduler", metavar="URL", help="a Dask cluster instead, e.g. tcp://host:8786")
    group.add_argument("--against", type=Path, metavar="PATH", help="before = what this wheel or environment says")
    group.add_argument("--report", type=Path, metavar="FILE.html", help="flips, shifts and the worst, with pictures")
    group.add_argument("--language", choices=("en", "ru"), default="en", help="of the report (default: en)")
    group.add_argument(
        "--fail-on", action="append", metavar="CONDITION", help="exit status 3, e.g. 'flips>0', 'p99_shift_mm>0.1'"
    )


def _count(text: str) -> int:
    if not text.isascii() or not text.isdigit() or not 1 <= int(text) <= MOST_WORKERS:
        raise argparse.ArgumentTypeError(f"{text!r} is no number of processes, expected 1 to {MOST_WORKERS}")
    return int(text)


def wants_table(args: argparse.Namespace) -> bool:
    """Whether a table is to be written; raise UserError where only what belongs to one is given."""
    if args.output is not None:
        return True
    for name in NEEDS_OUTPUT:
        if getattr(args, name) is not None:
            raise UserError(f"--{name.replace('_', '-')} needs --output FILE.parquet: that is where the rows go")
    return False


def write_table(args: argparse.Namespace, settings: Settings, choose: Choose) -> int:
    """Carry the run out, or on; tell of it; and say by the exit status what came of it. choose: jobs of a journal."""
    from service.replays.errors import ReplayError
    from service.replays.report.conditions import condition

    _check(args)
    try:
        conditions = [condition(text) for text in args.fail_on or ()]
        return _written(args, settings, choose, conditions)
    except ReplayError as error:
        raise UserError(str(error)) from error
    except KeyboardInterrupt:
        print("broken off: the rows so far are kept, the same command goes on", file=sys.stderr)
        raise


def _check(args: argparse.Namespace) -> None:
    """Raise UserError for what does not go together."""
    if args.json:
        raise UserError("--json and --output exclude each other: the table has it all")
    if args.workers is not None and args.scheduler is not None:
        raise UserError("--workers and --scheduler exclude each other: a cluster has workers of its own")
    if args.output.suffix != ".parquet" or args.output.is_dir():
        raise UserError(f"--output {args.output}: expected a file that ends in .parquet")
    if args.limit < 0:
        raise UserError(f"--limit {args.limit}: expected 0 or more")
    if args.archive and (args.since or args.reason):
        raise UserError("--archive and --since or --reason exclude each other: those are for a journal; see --outcome")


def _written(args: argparse.Namespace, settings: Settings, choose: Choose, conditions: Sequence[Condition]) -> int:
    from service.replays.against import OtherVersion
    from service.replays.report.summary import Summary
    from service.replays.run_files import RunFiles
    from service.replays.work import Work

    config = None if args.archive else config_of(args)
    against = None if args.against is None else args.against.resolve()
    work = Work(_places(args, config), settings, against)
    terms = _terms(args, work)
    if against is not None:
        with OtherVersion(against) as other:
            terms["against_versions"] = asdict(other.versions)
    progress: Progress | None = None
    with RunFiles(args.output, terms) as files:
        if files.complete:
            print(f"{args.output}: is whole, and told as it is. To have all done again, delete it", file=sys.stderr)
        else:
            files.open([] if files.begun else _names(args, work, config, choose))
            progress = _carry_out(args, work, files)
        summary = Summary.of(args.output)
        workers_left_out = files.workers_left_out()
    if args.report is not None:
        _write_report(args, work, summary, _told(args, terms, conditions, progress, workers_left_out))
    _tell(summary, conditions, workers_left_out)
    as_archived = settings.as_archived and against is None and not conditions
    failed = any(one.met(summary.figures()) for one in conditions) or (as_archived and summary.whole.changed)
    if summary.whole.left_out or workers_left_out:
        return EXIT_UNUSABLE
    return EXIT_REFUSED if failed else EXIT_OK


def _places(args: argparse.Namespace, config: Config | None) -> tuple[Place, ...]:
    """The archives by their cells' names; raise UserError."""
    from service.replays.places import Place

    found: dict[str, Place] = {}
    for given in args.archive or [str(config.archive.path) if config else ""]:
        cell, equals, address = given.partition("=")
        if not equals or "/" in cell:
            cell, address = "", given
        if "@" in address.partition("://")[2].partition("/")[0]:  # it would stand in table and report
            raise UserError(
                "--archive: an address with a user or password. Give those by the environment, as AWS's tools"
            )
        address = address.rstrip("/") if "://" in address else str(Path(address).resolve())
        cell = cell or address.rpartition("/")[2]
        if cell in found:
            raise UserError(f"--archive {given}: there is a cell {cell!r} already. Name it otherwise: CELL={address}")
        found[cell] = Place(cell, address)
    return tuple(found[cell] for cell in sorted(found))


def _terms(args: argparse.Namespace, work: Work) -> Terms:
    """What must be the same for a run to go on. --since counts from now, and so is only named."""
    return {
        "archives": {place.cell: place.address for place in work.places},
        "set": sorted(args.changes),
        "against": None if work.against is None else str(work.against),
        "jobs": [*args.numbers, args.outcome, args.reason, args.limit, args.since is not None],
        "versions": asdict(work.versions),
    }


def _names(args: argparse.Namespace, work: Work, config: Config | None, choose: Choose) -> list[JobName]:
    """The jobs that are wanted, by cell and number; raise UserError, ReplayError."""
    from service.replays.places import UNKNOWN
    from service.replays.work import JobName

    wanted: set[int] | None = set(args.numbers) or None
    if config is not None and (args.since or args.outcome or args.reason or args.limit):
        wanted = set(choose(config))
    names = []
    for number, place in enumerate(work.places):
        there = dict(place.jobs())
        jobs = sorted(there if wanted is None else wanted)
        if args.archive and args.outcome:
            jobs = [job for job in jobs if there.get(job) == args.outcome]
        if args.archive and args.limit:
            jobs = jobs[-args.limit :]
        names += [JobName(number, job, there.get(job, UNKNOWN)) for job in jobs]
    if not names:
        raise UserError("no jobs: the archives hold none, or none that ended so")
    return names


def _carry_out(args: argparse.Namespace, work: Work, files: RunFiles) -> Progress:
    """Do what is missing, and make the table whole."""
    from service.replays.run import Run

    workers = _workers(args, work)
    with ProgressTold(sys.stderr) as told, workers:
        run = Run(work, files, workers, told)
        if run.progress.before:
            print(f"goes on: {run.progress.before} of {run.progress.jobs} jobs were done before", file=sys.stderr)
        run.carry_out()
        left_out = workers.left_out
    files.join(left_out)
    return run.progress


def _workers(args: argparse.Namespace, work: Work) -> Workers:
    if args.scheduler is not None:
        from service.replays.cluster import Cluster

        return Cluster(work, args.scheduler)
    from service.replays.workers import Processes

    return Processes(work, args.workers or 1)


def _told(
    args: argparse.Namespace,
    terms: Terms,
    conditions: Sequence[Condition],
    progress: Progress | None,
    workers_left_out: dict[str, str],
) -> RunTold:
    from service.replays.report.page import RunTold

    return RunTold(
        None if args.against is None else f"combtrace {terms['against_versions']['combtrace']} ({args.against.name})",
        dict(change.split("=", 1) for change in args.changes),
        terms["archives"],
        conditions,
        {} if progress is None else progress.workers,
        workers_left_out,
    )


def _write_report(args: argparse.Namespace, work: Work, summary: Summary, told: RunTold) -> None:
    """Draw it, in a process of its own that may end without ending this one; raise UserError."""
    from service.atomic_file import write_whole
    from service.reasons import Language
    from service.replays.report.page import report
    from service.replays.thumbnails import Thumbnails
    from service.replays.work import JobName
    from service.worker import Worker, WorkerEnded

    places = {place.cell: number for number, place in enumerate(work.places)}
    worker = Worker(work.drawn, gives_way=True)

    def draw(row: Row) -> Thumbnails | None:
        nonlocal worker
        try:
            drawn: Thumbnails | None = worker.answer(
                JobName(places[row["cell"]], row["job_id"], row["archived_as"] or "")
            )
        except WorkerEnded:
            worker.end()
            worker, drawn = Worker(work.drawn, gives_way=True), None
        return drawn

    try:
        write_whole(args.report, report(Language(args.language), summary, told, draw).encode())
    except OSError as error:
        raise UserError(f"--report {args.report}: cannot be written: {error.strerror}. Name another") from error
    finally:
        worker.end()
    print(args.report)


def _tell(summary: Summary, conditions: Sequence[Condition], workers_left_out: dict[str, str]) -> None:
    """In a few lines what came of it."""
    whole, figures = summary.whole, summary.figures()
    print(
        f"{whole.jobs} jobs, {whole.changed} not as before, {whole.flips} verdicts flip: "
        f"{whole.sent_to_refused} sent -> refused, {whole.refused_to_sent} refused -> sent"
    )
    if whole.shifts_mm:
        shifts = [f"{name} {whole.shift_mm(percent):.4f}" for name, percent in (("median", 50), ("99 %", 99))]
        print(f"outlines moved by, mm: {', '.join(shifts)}, largest {whole.shift_mm(100):.4f}")
    for kind, count in summary.left_out.most_common():
        row = summary.left_out_rows[kind][0]
        told = f"e.g. {row['cell']} {row['job_id']}: {row['left_out_text']}"
        print(f"left out: {count} {kind}, {told}", file=sys.stderr)
    for worker, why in workers_left_out.items():
        print(f"left out: worker {worker} {why}", file=sys.stderr)
    for one in conditions:
        value = figures[one.name]
        seen = "cannot be told" if value is None else f"is {value:g}"
        print(f"{'FAILS' if one.met(figures) else 'passes'} {one}: {one.name} {seen}", file=sys.stderr)
