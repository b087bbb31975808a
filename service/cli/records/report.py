"""`combtrace report`: how a shift was, as a page to print."""

from __future__ import annotations

import argparse
from datetime import UTC, datetime, timedelta
from pathlib import Path

from service.cli.errors import EXIT_OK, UserError
from service.cli.options.jobs import add_config_argument, config_of, moment

HELP = "write a shift's report, a page to print"
DESCRIPTION = """\
Write what the journal says of a time as one HTML file to print or to keep: jobs by their
end, reasons with what to do, missed triggers, figures against their limits, recipes and
calibrations, checks, and who gave orders from the page. The daemon may run meanwhile.

Exit status: 0 written, 2 unreadable journal or wrong usage."""

SHIFT = timedelta(hours=8)
MOST_ORDERS = 10_000


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which time, in what language, and where to."""
    add_config_argument(parser)
    parser.add_argument(
        "--from", dest="begin", type=moment, metavar="WHEN", help="2026-11-21T06:00, or 8h, 2d ago; default 8h"
    )
    parser.add_argument("--to", dest="end", type=moment, metavar="WHEN", help="until then; default now")
    parser.add_argument("--recipe", type=int, metavar="N", help="jobs of this recipe only; default all")
    parser.add_argument("--language", choices=("en", "ru"), default="en", help="language of the texts (default: en)")
    parser.add_argument("--output", type=Path, default=Path("shift.html"), metavar="FILE", help="default shift.html")


def run(args: argparse.Namespace) -> int:
    """Write it."""
    from service.atomic_file import write_whole
    from service.reasons import Language
    from service.records.journal_reader import JournalUnreadable, reading
    from service.trends.documents import shift_report
    from service.trends.history import Span, history

    end = args.end or datetime.now(UTC)
    try:
        span = Span(args.begin or end - SHIFT, end)
    except ValueError as error:
        raise UserError(f"--from, --to: {error}") from error
    try:
        with reading(config_of(args).journal.path) as journal:
            found = history(journal, span, args.recipe)
            orders = [
                note for note in journal.notes(MOST_ORDERS) if span.begin <= datetime.fromisoformat(note.at) < span.end
            ]
    except JournalUnreadable as error:
        raise UserError(str(error)) from error
    try:
        write_whole(args.output, shift_report(Language(args.language), found, orders).encode())
    except OSError as error:
        raise UserError(f"--output {args.output}: cannot be written: {error.strerror}. Name another") from error
    jobs = sum(found.whole.outcomes.values())
    print(f"{args.output}: {jobs} jobs, {found.accepted} accepted, {sum(found.missed.values())} triggers missed")
    return EXIT_OK
