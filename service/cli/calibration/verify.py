"""`combtrace verify`: a master part's outline against what is seen of it, in millimetres: pass or fail."""

from __future__ import annotations

import argparse
from datetime import UTC, datetime
from pathlib import Path

from service.cli.errors import EXIT_OK, EXIT_REFUSED, UserError
from service.cli.options.measuring import Measuring, add_measuring_arguments, note_check
from service.cli.pictures.given_pictures import add_pictures_argument, pictures_of

HELP = "measure a master part: deviation in mm, pass or fail"
DESCRIPTION = """\
Trace pictures of a master part whose outline is known and compare: the weekly check
that camera, lens, light and calibration still measure right. The seen outline is laid
onto the master by the best turn and shift, which are told; with --fixed it is not, for
a part in a fixture whose place in the machine frame counts too.

FILE of --outline is what `combtrace trace --json` writes, or {"exterior": [[x, y], …],
"holes": […]} in millimetres.

Exit status: 0 pass (every picture's worst deviation within --tolerance-mm), 3 fail or
refused, 2 unusable input."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Pictures, the master, and what all measuring commands take."""
    add_pictures_argument(parser, what="pictures of the master part")
    parser.add_argument("--outline", type=Path, required=True, metavar="FILE", help="the master's outline, JSON")
    parser.add_argument("--fixed", action="store_true", help="compare in place: the part lies in a fixture")
    add_measuring_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Measure all pictures, print, and tell by the exit status."""
    from contour.errors import ContourError
    from contour.geometry.comparison import Deviation, compare
    from drivers.camera import CameraError
    from drivers.camera.files.decode import read_picture
    from service.measuring.master_file import MasterFileError, read_master
    from service.measuring.trend_file import TrendLine

    measuring = Measuring.of(args)
    try:
        master = read_master(args.outline)
    except MasterFileError as error:
        raise UserError(f"--outline {error}") from error
    found: list[Deviation] = []
    failed = False
    for image in pictures_of(args.images):
        try:
            seen = measuring.measurer.measure(read_picture(image), measuring.recipe, measuring.thickness_mm)
            if seen.findings or seen.millimetres is None:
                print(f"{image}: refused: {'; '.join(seen.texts)}")
                failed = True
                continue
            deviation = compare(seen.millimetres, master, fit=not args.fixed)
        except (CameraError, ContourError) as error:
            raise UserError(f"{image}: {str(error).removeprefix(f'{image}: ')}") from error
        found.append(deviation)
        print(f"{image}: {_told(deviation, fixed=args.fixed)}")
    worst = max((one.worst_mm for one in found), default=float("nan"))
    passed = not failed and bool(found) and worst <= args.tolerance_mm
    if found:
        line = TrendLine(
            datetime.now(UTC),
            "verify",
            measuring.calibration_hash,
            len(found),
            sum(one.mean_mm for one in found) / len(found),
            max(one.p95_mm for one in found),
            worst,
            args.tolerance_mm,
            "pass" if passed else "fail",
        )
        note_check(args, measuring.config, line)
        verdict = "pass" if passed else "FAIL"
        print(f"{verdict}      worst deviation {worst:.3f} mm, {args.tolerance_mm:g} mm are allowed")
    return EXIT_OK if passed else EXIT_REFUSED


def _told(deviation: object, *, fixed: bool) -> str:
    from contour.geometry.comparison import Deviation

    assert isinstance(deviation, Deviation)
    text = (
        f"mean {deviation.mean_mm:.3f}, 95 % {deviation.p95_mm:.3f}, worst {deviation.worst_mm:.3f} mm, "
        f"bias {deviation.bias_mm:+.3f} mm"
    )
    if fixed:
        return text
    x, y = deviation.shift_mm
    return f"{text} (laid on the master by {x:+.2f}, {y:+.2f} mm and {deviation.turn_deg:+.3f} degrees)"
