"""`combtrace replay`: jobs done again from their archived frames, with the archived settings or others."""

from __future__ import annotations

import argparse
import difflib
import json
import shutil
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any

from service.cli.errors import EXIT_OK, EXIT_REFUSED, EXIT_UNUSABLE, UserError
from service.cli.options.jobs import add_config_argument, add_filter_arguments, config_of, filter_of, job_number
from service.cli.records.jobs import local
from service.cli.records.replay_archives import add_archive_arguments, wants_table, write_table

if TYPE_CHECKING:
    from service.config.config import Config
    from service.records.replay import Replayed, Settings

HELP = "do jobs again from the archive, with other settings if wanted"
DESCRIPTION = """\
Measure archived frames again with the archived recipe and calibration, put the
contours into pages again, and say whether they come out as they were, register
for register, or what is not. With --set: try other settings on the archive, and
list the jobs whose verdict flips. Nothing is sent and nothing is written.

Settings: recipe.KEY, recipe.parameters.KEY, calibration.file,
calibration.max_age_days, .sentinel_tolerance_px, .sentinels_required.

With --output, whole archives, also in buckets, by many processes or a Dask cluster:
a row a job as a Parquet table, a report, and conditions to fail on. What was broken
off goes on with the same command. Needs combtrace[cluster]; see the documents.

Exit status: 0 all came out as they were (with --set or --against: done), 3 something
did not, or a condition of --fail-on is met, 2 nothing to replay, a job named that
cannot be, wrong usage, or with --output jobs or workers that were left out."""

LIMITS = ("max_age_days", "sentinel_tolerance_px", "sentinels_required")
BAR = 30
SHOWN_JOBS = 5


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which jobs, and with which settings."""
    parser.add_argument("numbers", nargs="*", type=job_number, metavar="N", help="job numbers; or --since and the like")
    add_config_argument(parser)
    add_filter_arguments(parser)
    parser.add_argument("--limit", type=int, default=0, metavar="N", help="the newest N; default all")
    parser.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", dest="changes", help="e.g. recipe.tolerance_mm=0.2"
    )
    parser.add_argument("--json", action="store_true", help="JSON Lines, one object a job")
    add_archive_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Replay, tell, and say by the exit status whether all came out as it was."""
    from service.records.archived_job import load_archived
    from service.records.evidence import EvidenceError
    from service.records.replay import replay

    settings = settings_of(args.changes)
    if wants_table(args):
        return write_table(args, settings, lambda config: chosen_numbers(args, config))
    config = config_of(args)
    numbers = chosen_numbers(args, config)
    done: list[Replayed] = []
    left_out: dict[str, list[int]] = {}
    for job_id in _with_bar(numbers):
        try:
            done.append(replay(load_archived(config.archive.path, job_id), settings))
        except EvidenceError as error:
            left_out.setdefault(str(error).removeprefix(f"job {job_id}: "), []).append(job_id)
            continue
        if args.json:
            print(json.dumps(_fields(done[-1]), ensure_ascii=False), flush=True)
    if not done:
        raise UserError("; ".join(_left_out(left_out)) or "no jobs: nothing was taken then, or nothing of it ended so")
    if not args.json:
        _tell(done, settings)
    for text in _left_out(left_out):
        print(f"left out: {text}", file=sys.stderr)
    if left_out and args.numbers:
        return EXIT_UNUSABLE
    same = all(one.identical for one in done)
    return EXIT_OK if same or not settings.as_archived else EXIT_REFUSED


def _left_out(reasons: dict[str, list[int]]) -> list[str]:
    """Why jobs were left out, each reason once with the jobs it holds for."""
    told = []
    for text, numbers in reasons.items():
        jobs = ", ".join(map(str, numbers[:SHOWN_JOBS]))
        more = f" and {len(numbers) - SHOWN_JOBS} more" if len(numbers) > SHOWN_JOBS else ""
        told.append(f"job{'s' * (len(numbers) > 1)} {jobs}{more}: {text}")
    return told


def settings_of(changes: list[str]) -> Settings:
    """The settings that --set names; raise UserError."""
    import yaml

    from service.config.recipes import Recipe
    from service.config.yaml_mistakes import FileLoader
    from service.records.replay import Settings

    recipe: dict[str, Any] = {}
    limits: dict[str, Any] = {}
    calibration: Path | None = None
    for change in changes:
        key, equals, text = change.partition("=")
        part, _, name = key.partition(".")
        try:
            value = yaml.load(text, Loader=FileLoader)
        except yaml.YAMLError as error:
            raise UserError(f"--set {change}: {text!r} is no value") from error
        known = name in Recipe.model_fields or name.startswith("parameters.")
        if equals and part == "recipe" and known and name not in ("number", "name"):
            recipe[name] = value
        elif equals and part == "calibration" and name in LIMITS:
            limits[name] = value
        elif equals and key == "calibration.file" and text:
            calibration = Path(text)
        else:
            known_keys = [f"recipe.{key}" for key in Recipe.model_fields] + [f"calibration.{key}" for key in LIMITS]
            near = difflib.get_close_matches(key, known_keys, n=1)
            hint = f"did you mean {near[0]}?" if near else "see --help"
            raise UserError(f"--set {change}: expected recipe.KEY=VALUE or calibration.KEY=VALUE; {hint}")
    _check_limits(limits)
    return Settings(recipe, limits, calibration)


def _check_limits(limits: dict[str, Any]) -> None:
    """Raise UserError where the configuration could not say so either."""
    from pydantic import ValidationError

    from service.config.config import Calibration
    from service.config.mistakes import describe

    try:
        Calibration.model_validate({"file": "of the archive", **limits})
    except ValidationError as error:
        raise UserError("; ".join(f"--set calibration.{line}" for line in describe(error, Calibration))) from error


def chosen_numbers(args: argparse.Namespace, config: Config) -> list[int]:
    """Job numbers given, or those of the journal that are wanted and of which evidence is kept."""
    from service.records.archive import document_of
    from service.records.journal_reader import JournalUnreadable, reading

    if args.numbers:
        if args.since or args.outcome or args.reason:
            raise UserError("job numbers and --since, --outcome or --reason exclude each other")
        return list(args.numbers)
    if args.limit < 0:
        raise UserError(f"--limit {args.limit}: expected 0 or more")
    if not (args.since or args.outcome or args.reason or args.limit):
        raise UserError("which jobs? Give numbers, or --since, --outcome, --reason, --limit")
    try:
        with reading(config.journal.path) as journal:
            jobs = journal.jobs(filter_of(args))
    except JournalUnreadable as error:
        raise UserError(str(error)) from error
    try:
        kept = [job.job_id for job in jobs if document_of(config.archive.path, job.job_id) is not None]
    except OSError as error:
        raise UserError(
            f"{config.archive.path}: cannot be looked at: {error.strerror}. Check its permissions"
        ) from error
    return kept[-args.limit :] if args.limit > 0 else kept


def _with_bar(numbers: list[int]) -> Iterator[int]:
    """The numbers, with a bar on a terminal's standard error that says how far it is."""
    shown = sys.stderr.isatty() and len(numbers) > 1
    for done, number in enumerate(numbers):
        if shown:
            filled = BAR * done // len(numbers)
            bar = f"[{'#' * filled}{'.' * (BAR - filled)}] {done}/{len(numbers)} job {number}"
            print(f"\r{bar[: shutil.get_terminal_size().columns - 1]}\x1b[K", end="", file=sys.stderr, flush=True)
        yield number
    if shown:
        print("\r\x1b[K", end="", file=sys.stderr, flush=True)


def _tell(done: list[Replayed], settings: Settings) -> None:
    if not settings.as_archived:
        _tell_flips(done)
        return
    for one in done:
        if one.identical:
            sent = f"{one.registers} registers" if one.registers else "nothing was sent; verdict and polygon"
            print(f"job {one.job_id}: {sent}: byte for byte as they were")
            continue
        print(f"job {one.job_id}: NOT as it was")
        for change in one.changes:
            print(f"  {change.field:<20} was {change.was}, is {change.now}")


def _tell_flips(done: list[Replayed]) -> None:
    """The table of verdict flips, and what became of the rest."""
    flips = [one for one in done if one.flipped]
    rows = [("job", "taken", "was", "would be", "because")]
    rows += [
        (str(one.job_id), local(one.taken_at), _verdict(one.reasons_were), _verdict(one.reasons), _why(one))
        for one in flips
    ]
    if flips:
        widths = [max(len(row[column]) for row in rows) for column in range(4)]
        for row in rows:
            print("  ".join([*(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=False)), row[4]]).rstrip())
        print()
    toll = Counter("sent -> refused" if one.reasons else "refused -> sent" for one in flips)
    told = ", ".join(f"{count} {what}" for what, count in sorted(toll.items()))
    print(f"{len(done)} jobs, {len(flips)} verdicts flip" + (f": {told}" if told else ""))
    both = [one for one in done if not one.reasons and not one.reasons_were]
    if both:
        for name, digits in (("vertices", 0), ("area_mm2", 1), ("uncertainty_mm", 3)):
            pairs = [(one.was[name], one.now[name]) for one in both if None not in (one.was[name], one.now[name])]
            if pairs:
                was, now = (median(pair[side] for pair in pairs) for side in (0, 1))
                print(
                    f"  {name:<15} median of {len(pairs)} sent before and after: {was:.{digits}f} -> {now:.{digits}f}"
                )


def _verdict(reasons: tuple[Any, ...]) -> str:
    return f"{int(reasons[0])} {reasons[0].label}" if reasons else "sent"


def _why(one: Replayed) -> str:
    return one.texts[0] if one.texts else ""


def _fields(one: Replayed) -> dict[str, Any]:
    return {
        "job_id": one.job_id,
        "identical": one.identical,
        "flipped": one.flipped,
        "reasons_were": [int(reason) for reason in one.reasons_were],
        "reasons": [int(reason) for reason in one.reasons],
        "changes": [{"field": change.field, "was": change.was, "now": change.now} for change in one.changes],
        "was": one.was,
        "now": one.now,
    }
