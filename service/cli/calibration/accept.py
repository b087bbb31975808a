"""`combtrace accept`: lengths of a calibrated gauge in many places against a stated limit; a certificate of it."""

from __future__ import annotations

import argparse
import shlex
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from service.cli.calibration.accept_pictures import from_camera, from_files, looked_at, tell
from service.cli.errors import EXIT_OK, EXIT_REFUSED, UserError
from service.cli.options.measuring import find_recipe, guard_of, load_config_or_default
from service.cli.options.tracing import table_of
from service.cli.pictures.given_pictures import add_pictures_argument, pictures_of
from service.cli.text_output import text_output

if TYPE_CHECKING:
    from collections.abc import Callable

    from service.certifying.certificate import Certificate, Circumstances
    from service.certifying.earlier import Earlier
    from service.certifying.gauge_file import Gauge
    from service.certifying.sight import Eye, Sight
    from service.config.config import Config
    from service.measuring.calibration_guard import CalibrationGuard

HELP = "test the cell with a calibrated gauge, and write a certificate"
DESCRIPTION = """\
Measure the lengths of a gauge that was calibrated elsewhere, laid in many places and
directions, and say whether a stated limit is shown to hold: a plate or bar with a board
on it, or a milled block whose sides were measured by caliper. Its file says what it is.

Pictures come from files or, where none is named, from the configuration's camera: it
then says what is missing, and waits for the Enter key before each picture. Stop the
daemon first: a camera serves one program. What does not serve is refused with its reason.

A length passes where its error and the test's uncertainty together stay within the limit.
No conformity to a standard is claimed.

Exit status: 0 passes, 3 does not pass or is not decided, 2 nothing is certified: bad
gauge file, gauge not found, too few positions, 1 the camera failed: its pictures so far
are kept."""

FEWEST_PLACES, MOST_PLACES = 5, 100


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The gauge, the cell, the limit, and where the certificate goes."""
    add_pictures_argument(parser, what="pictures of the gauge; none: the camera's", needed=False)
    parser.add_argument("--gauge", type=Path, required=True, metavar="FILE", help="the gauge's file, YAML or JSON")
    parser.add_argument("--config", type=Path, metavar="FILE", help="configuration with calibration, recipes, camera")
    parser.add_argument("--calibration", type=Path, metavar="FILE", help="pixels to millimetres")
    parser.add_argument("--recipe", metavar="NAME", help="recipe that a block is traced by")
    parser.add_argument(
        "--limit-mm", type=float, metavar="MM", help="stated limit; default 0.1, for a block 0.5 or its recipe's"
    )
    parser.add_argument("--limit-mm-per-m", type=float, default=0.0, metavar="MM", help="what a metre adds; default 0")
    parser.add_argument("--places", type=int, default=FEWEST_PLACES, metavar="N", help="places wanted; default 5")
    parser.add_argument("--temperature-c", type=float, metavar="T", help="the gauge's temperature, measured")
    parser.add_argument("--operator", default="", metavar="NAME", help="who tests")
    parser.add_argument("--cell", default="", metavar="NAME", help="what is tested, as the plant names it")
    parser.add_argument(
        "--study", nargs="+", default=[], metavar="OPERATOR=FOLDER", help="gauge study: each operator's pictures"
    )
    parser.add_argument("--against", type=Path, metavar="FILE", help="compare with this certificate's JSON")
    parser.add_argument(
        "--keep",
        type=Path,
        default=Path("accept-pictures"),
        metavar="FOLDER",
        help="where the camera's pictures are kept; default accept-pictures",
    )
    parser.add_argument("--output", type=Path, default=Path("certificate.html"), metavar="FILE", help="page to print")
    parser.add_argument("--json", metavar="FILE|-", help="the certificate as JSON; - is standard output")
    parser.add_argument("--language", choices=("en", "ru"), default="en", help="language of the page (default: en)")


def run(args: argparse.Namespace) -> int:
    """Look, decide, write."""
    from service.certifying.trial import NotCertified, certified, studied

    _check_files(args)
    bench = _Bench.of(args)
    earlier = _earlier(args.against)
    with text_output(args.json) as write_json:
        try:
            study = studied(bench.gauge, bench.told, _operators(args.study, bench)) if args.study else None
            sights = _sights(args, bench)
            certificate = certified(bench.eye, bench.gauge, bench.guard, bench.told, sights, study)
        except NotCertified as error:
            raise UserError(str(error)) from error
        _write(args, certificate, earlier, write_json)
    return EXIT_OK if certificate.passes else EXIT_REFUSED


@dataclass(frozen=True)
class _Bench:
    """The gauge, what looks at it, and what was told of the test."""

    config: Config
    gauge: Gauge
    guard: CalibrationGuard
    eye: Eye
    told: Circumstances

    @classmethod
    def of(cls, args: argparse.Namespace) -> _Bench:
        """By the arguments; raise UserError where they could not come to a certificate."""
        import importlib.metadata

        from contour.length_test.verdict import Limit
        from service.certifying.certificate import Circumstances
        from service.certifying.gauge_file import GaugeFileError, read_gauge
        from service.certifying.sight import Eye
        from service.certifying.trial import NotCertified, check_able, default_limit

        _check_numbers(args)
        try:
            gauge = read_gauge(args.gauge)
        except GaugeFileError as error:
            raise UserError(str(error)) from error
        config = load_config_or_default(args.config)
        guard = guard_of(config, args)
        if guard is None:
            raise UserError("lengths are in millimetres: name the calibration by --calibration or --config")
        recipe = find_recipe(config, args.recipe)
        file = args.calibration or getattr(config.calibration, "file", None)
        limit_mm, limit_by = default_limit(gauge, recipe)
        if args.limit_mm is not None:
            limit_mm, limit_by = args.limit_mm, "stated"
        limit = Limit(limit_mm, args.limit_mm_per_m)
        try:
            check_able(gauge, guard, limit, args.temperature_c)
        except NotCertified as error:
            raise UserError(str(error)) from error
        told = Circumstances(
            datetime.now().astimezone(),
            args.operator,
            args.cell,
            _command(args),
            importlib.metadata.version("combtrace"),
            "" if file is None else file.name,
            recipe.name if gauge.file.kind == "block" else "",
            limit,
            args.temperature_c,
            args.places,
            guard.limits.sentinel_tolerance_px,
            limit_by,
        )
        return cls(config, gauge, guard, Eye(gauge, guard, recipe, table_of(config)), told)


def _check_files(args: argparse.Namespace) -> None:
    """Raise UserError where the certificate would take the place of the one that it is held against."""
    if args.against is None:
        return
    for option, written in (("--output", args.output), ("--json", None if args.json == "-" else args.json)):
        if written is not None and Path(written).resolve() == args.against.resolve():
            raise UserError(f"{option} {written}: is the certificate of --against, which is to be kept. Name another")


def _check_numbers(args: argparse.Namespace) -> None:
    if args.limit_mm is not None and not 0 < args.limit_mm < 1e3:
        raise UserError(f"--limit-mm {args.limit_mm:g}: expected a number above 0, in millimetres")
    if not 0 <= args.limit_mm_per_m < 1e3:
        raise UserError(f"--limit-mm-per-m {args.limit_mm_per_m:g}: expected 0 or more, in millimetres")
    if not FEWEST_PLACES <= args.places <= MOST_PLACES:
        raise UserError(f"--places {args.places}: expected {FEWEST_PLACES} to {MOST_PLACES}")
    if args.temperature_c is not None and not 0 <= args.temperature_c <= 60:
        raise UserError(f"--temperature-c {args.temperature_c:g}: expected 0 to 60")


def _command(args: argparse.Namespace) -> str:
    """What gives the same figures again: every option that they depend on."""
    words = ["combtrace", "accept", "--gauge", args.gauge.name]
    for name in ("config", "calibration", "recipe", "limit_mm", "limit_mm_per_m", "places", "temperature_c"):
        value = getattr(args, name)
        if value is not None and (value or name != "limit_mm_per_m"):
            words += [f"--{name.replace('_', '-')}", value.name if isinstance(value, Path) else f"{value}"]
    study = ["--study", *args.study] if args.study else []
    return shlex.join([*words, *(path.name for path in args.images or [args.keep]), *study])


def _sights(args: argparse.Namespace, bench: _Bench) -> list[Sight]:
    if args.images:
        return from_files(pictures_of(args.images), bench.eye)
    return from_camera(args, bench.config, bench.eye, bench.gauge.file.height_mm)


def _operators(given: list[str], bench: _Bench) -> dict[str, list[Sight]]:
    operators: dict[str, list[Sight]] = {}
    for text in given:
        name, equals, folder = text.partition("=")
        if not (name and equals and folder) or name in operators:
            raise UserError(f"--study {text}: expected OPERATOR=FOLDER, each operator once")
        operators[name] = looked_at(pictures_of([Path(folder)]), bench.eye)
    return operators


def _write(
    args: argparse.Namespace, certificate: Certificate, earlier: Earlier | None, write_json: Callable[[str], None]
) -> None:
    from service.atomic_file import write_whole
    from service.certifying.earlier import as_text, compared
    from service.certifying.page import certificate_page
    from service.reasons import Language

    comparison = None if earlier is None else compared(certificate, earlier)
    page = certificate_page(Language(args.language), certificate, comparison)
    try:
        write_whole(args.output, page.encode())
    except OSError as error:
        raise UserError(f"--output {args.output}: cannot be written: {error.strerror}. Name another") from error
    write_json(as_text(certificate, comparison))
    worst, form = certificate.worst, certificate.worst_form
    tell(
        f"lengths   {len(certificate.lengths)} in {len(certificate.kept)} places; worst {worst.error_mm:+.3f} mm "
        f"({worst.seen.name} in {worst.picture}), limit {worst.limit_mm:g} mm, the test is sure to "
        f"{worst.budget.expanded_mm:.3f} mm"
    )
    tell(f"form      {form.form_mm:.3f} mm at most ({form.line} in {form.picture})")
    for _, text in certificate.findings:
        tell(f"besides   {text}")
    tell(f"{certificate.decision}: {args.output}, number {certificate.number}")


def _earlier(path: Path | None) -> Earlier | None:
    from service.certifying.earlier import EarlierError, read_earlier

    try:
        return None if path is None else read_earlier(path)
    except EarlierError as error:
        raise UserError(f"--against {error}") from error
