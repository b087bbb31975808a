"""What commands that look at jobs share: where journal and archive are, and which jobs."""

from __future__ import annotations

import argparse
import re
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING

from service.cli.errors import UserError
from service.link.job_numbers import LARGEST_JOB

if TYPE_CHECKING:
    from service.config.config import Config
    from service.records.journal_reader import JobFilter

AGO = re.compile(r"(\d{1,6}(?:\.\d+)?)([smhdw])")
UNITS = {"s": "seconds", "m": "minutes", "h": "hours", "d": "days", "w": "weeks"}


def add_filter_arguments(parser: argparse.ArgumentParser) -> None:
    """Since when, how they ended, why."""
    parser.add_argument("--since", type=moment, metavar="WHEN", help="2026-11-21, 2026-11-21T06:00, or 30m, 8h, 2d ago")
    parser.add_argument("--outcome", choices=("accepted", "written", "refused", "failed"))
    parser.add_argument("--reason", metavar="REASON", help="code or name, as `combtrace reasons` tells them")


def add_config_argument(parser: argparse.ArgumentParser) -> None:
    """The configuration, which names journal and archive."""
    parser.add_argument(
        "--config", type=Path, default=Path("config.yaml"), metavar="FILE", help="names journal and archive"
    )


def job_number(text: str) -> int:
    """A job's number, for argparse."""
    if not re.fullmatch(r"\d{1,10}", text, re.ASCII) or not 1 <= int(text) <= LARGEST_JOB:
        raise argparse.ArgumentTypeError(f"{text!r} is no job number, expected 1 to {LARGEST_JOB}")
    return int(text)


def config_of(args: argparse.Namespace) -> Config:
    """The configuration; raise UserError."""
    from service.config.config_file import ConfigError, load_config

    try:
        return load_config(args.config)
    except ConfigError as error:
        raise UserError(str(error)) from error


def filter_of(args: argparse.Namespace) -> JobFilter:
    """Which jobs; raise UserError."""
    from service.reasons import Outcome, Reason
    from service.records.journal_reader import JobFilter

    reason = None
    if args.reason is not None:
        known = {key: one for one in Reason for key in (str(int(one)), one.label)}
        if args.reason not in known:
            raise UserError(f"--reason {args.reason}: there is no such reason; `combtrace reasons` lists them")
        reason = known[args.reason]
    return JobFilter(args.since, None if args.outcome is None else Outcome(args.outcome), reason)


def moment(text: str) -> datetime:
    """A time, or a span before now."""
    ago = AGO.fullmatch(text)
    if ago:
        try:
            return datetime.now(UTC) - timedelta(**{UNITS[ago[2]]: float(ago[1])})
        except OverflowError:  # before all time, so all of it
            return datetime.min.replace(tzinfo=UTC)
    try:
        return datetime.fromisoformat(text).astimezone()  # without a zone it is this computer's
    except ValueError as error:
        told = f"{text!r} is no time, expected 2026-11-21, 2026-11-21T06:00, or a span such as 30m, 8h, 2d"
        raise argparse.ArgumentTypeError(told) from error
