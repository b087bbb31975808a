"""`combtrace repeat`: how much the outline of a still scene scatters from frame to frame, in millimetres."""

from __future__ import annotations

import argparse
import sys
import time
from datetime import UTC, datetime
from typing import TYPE_CHECKING

from service.cli.errors import EXIT_OK, EXIT_REFUSED, UserError
from service.cli.options.measuring import Measuring, add_measuring_arguments, note_check

if TYPE_CHECKING:
    from contour.geometry.rings import Contour
    from drivers.camera import Camera

HELP = "measure the repeatability of a still scene in mm"
DESCRIPTION = """\
Grab frames of a still scene from the configured camera, trace each, and tell how much
the outline scatters, at places a millimetre apart. Part of the weekly check: what grows
here is light, focus, vibration or a warm camera, not the calibration.

Stop the daemon first: a camera serves one program.

Exit status: 0 pass (the worst place scatters by no more than --tolerance-mm, two
standard deviations), 3 fail or refused, 2 unusable input."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """How often, and what all measuring commands take."""
    parser.add_argument("--count", type=int, default=25, metavar="N", help="frames; default 25")
    add_measuring_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Measure, print, and tell by the exit status."""
    import numpy as np

    from contour.errors import ParameterError
    from contour.geometry.comparison import scatter_mm
    from service.measuring.trend_file import TrendLine
    from service.wiring.devices import make_camera
    from service.wiring.errors import WiringError

    if args.config is None:
        raise UserError("--config FILE is needed: it names the camera")
    if not 3 <= args.count <= 10_000:
        raise UserError(f"--count {args.count}: expected 3 to 10000")
    measuring = Measuring.of(args)
    try:
        camera = make_camera(measuring.config)
    except WiringError as error:
        raise UserError(str(error)) from error
    outlines, refused = _outlines(camera, measuring, args.count)
    if refused:
        print(f"refused   {len(refused)} of {args.count} frames; the first: {refused[0]}")
        return EXIT_REFUSED
    try:
        spread = 2 * scatter_mm(outlines)
    except ParameterError as error:
        raise UserError(str(error), EXIT_REFUSED) from error
    worst = float(spread.max())
    passed = worst <= args.tolerance_mm
    mean, p95 = float(spread.mean()), float(np.percentile(spread, 95))
    print(f"frames    {len(outlines)} of a still scene, {len(spread)} places along the outline")
    print(f"scatter   two standard deviations: mean {mean:.3f}, 95 % of places {p95:.3f}, worst {worst:.3f} mm")
    line = TrendLine(
        datetime.now(UTC),
        "repeat",
        measuring.calibration_hash,
        len(outlines),
        mean,
        p95,
        worst,
        args.tolerance_mm,
        "pass" if passed else "fail",
    )
    note_check(args, measuring.config, line)
    print(f"{'pass' if passed else 'FAIL'}      worst {worst:.3f} mm, {args.tolerance_mm:g} mm are allowed")
    return EXIT_OK if passed else EXIT_REFUSED


def _outlines(camera: Camera, measuring: Measuring, count: int) -> tuple[list[Contour], list[str]]:
    """The outlines of `count` frames, and what spoke against the frames that gave none; raise UserError."""
    from contour.errors import ContourError
    from drivers.camera import CameraError

    outlines: list[Contour] = []
    refused: list[str] = []
    try:
        camera.open()
        for number in range(1, count + 1):
            frame = camera.grab(time.monotonic(), 5.0)
            seen = measuring.measurer.measure(frame.pixels, measuring.recipe, measuring.thickness_mm, frame.camera)
            if seen.findings or seen.millimetres is None:
                refused.append(f"frame {number}: {'; '.join(seen.texts)}")
            else:
                outlines.append(seen.millimetres)
            if number % 5 == 0:
                print(f"  frame {number} of {count}", file=sys.stderr, flush=True)
    except (CameraError, ContourError) as error:
        raise UserError(str(error)) from error
    finally:
        camera.close()
    return outlines, refused
