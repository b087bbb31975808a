"""Options that hold a calibration against lengths measured by hand, and what is told of the comparison."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from service.cli.errors import EXIT_REFUSED, UserError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from contour.calibration.calibration import Calibration
    from contour.camera_calibration.length_check import KnownLength, LengthCheck

_LARGEST_PERCENT = 1000.0


def add_length_arguments(parser: argparse._ArgumentGroup | argparse.ArgumentParser) -> None:
    """A known length in the picture, and how far apart lengths may be."""
    parser.add_argument("--known-length-mm", type=float, metavar="L", help="length on the plane, to compare")
    parser.add_argument(
        "--between", nargs=2, type=pixel_pair, metavar="X,Y", help="pixels of the known length's two ends"
    )
    parser.add_argument(
        "--accept-apart-percent",
        type=float,
        default=8.0,
        metavar="P",
        help="from here on, measured and calibrated lengths contradict; default 8",
    )


def pixel_pair(text: str) -> tuple[float, float]:
    """Two numbers of `100,1100`."""
    try:
        x, y = (float(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}: expected two numbers such as 100,1100") from None
    return x, y


def accept_share(args: argparse.Namespace) -> float:
    """The share from which on lengths contradict; raise UserError."""
    percent = float(args.accept_apart_percent)
    if not 0 < percent <= _LARGEST_PERCENT:
        raise UserError(f"--accept-apart-percent {percent:g}: expected a number above 0, to {_LARGEST_PERCENT:g}")
    return percent / 100


def known_length(args: argparse.Namespace) -> KnownLength | None:
    """The known length where one is given; raise UserError where half of it is."""
    import numpy as np

    from contour.camera_calibration.length_check import KnownLength

    if args.known_length_mm is None and args.between is None:
        return None
    if args.known_length_mm is None or args.between is None:
        raise UserError("--known-length-mm L and --between X1,Y1 X2,Y2 belong together; give both or neither")
    if not 0 < args.known_length_mm < 1e5:
        raise UserError(f"--known-length-mm {args.known_length_mm:g}: expected a number above 0")
    return KnownLength(args.known_length_mm, np.array(args.between, dtype=np.float64))


def tell_lengths(lengths: Sequence[LengthCheck], share: float) -> None:
    """Each comparison in a line; that there was none, too: then nothing speaks for the size."""
    for check in lengths:
        warning = check.warning(share)
        print(f"lengths   {check}" if warning is None else f"WARNING   {warning}")
    if not lengths:
        print("lengths   none measured by hand: sizes are taken as they were told")


def compare_span(args: argparse.Namespace, calibration: Calibration, cause: str) -> tuple[LengthCheck, ...]:
    """The known length by a calibration of one plane, told; raise UserError where it contradicts.

    `cause` is a sentence in which {factor} stands for what the told sizes would have to be multiplied by.
    """
    from contour.camera_calibration.length_check import LengthCheck, span_mm
    from contour.errors import CalibrationError, CalibrationFailed

    known = known_length(args)
    share = accept_share(args)
    if known is None:
        tell_lengths((), share)
        return ()
    try:
        known.check(args.size)
        solved_mm = span_mm(calibration, known, args.plane_height_mm)
    except (CalibrationError, CalibrationFailed) as error:
        raise UserError(str(error)) from error
    factor = known.length_mm / solved_mm
    check = LengthCheck("known length", solved_mm, known.length_mm, cause.format(factor=f"{factor:.4g}"))
    tell_lengths([check], share)
    fault = check.fault(share)
    if fault is not None:
        raise UserError(
            f"{fault}. To take it nevertheless: --accept-apart-percent {check.needed_percent:g}", EXIT_REFUSED
        )
    return (check,)
