"""Fixed marks beside the table, as a calibration file keeps them."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from service.cli.errors import UserError
from service.cli.options.board import board_of

if TYPE_CHECKING:
    from contour.calibration.fixed_marks import Sentinels
    from service.measuring.board_pictures import Gathered


def fixed_marks(args: argparse.Namespace, gathered: Gathered | None) -> Sentinels | None:
    """The fixed marks in view, where they were asked for; raise UserError where there are none."""
    from contour.calibration.fixed_marks import see_sentinels
    from contour.errors import ContourError
    from drivers.camera import CameraError
    from drivers.camera.files.decode import read_picture

    if args.sentinels is None:
        return None
    if args.sentinel_image is None and gathered is None:
        raise UserError("--sentinels needs --sentinel-image, a picture of the marks")
    own = range(0)
    if gathered is not None and args.sentinels == (args.dictionary or "DICT_5X5_250"):
        own = range(board_of(args).marker_count)
    try:
        if args.sentinel_image is not None:
            picture = read_picture(args.sentinel_image)
        else:
            assert gathered is not None
            picture = gathered.plane_picture
        size = gathered.size if gathered is not None else args.size
        if (picture.shape[1], picture.shape[0]) != size:
            raise UserError(
                f"--sentinel-image {args.sentinel_image}: {picture.shape[1]} x {picture.shape[0]} px, the calibration "
                f"is for {size[0]} x {size[1]}. Take it with the same camera at the same size"
            )
        found = see_sentinels(picture, args.sentinels, without=own)
    except (CameraError, ContourError) as error:
        raise UserError(f"--sentinels: {error}") from error
    if found is None:
        raise UserError(
            f"--sentinels {args.sentinels}: no such mark is seen. Check name and light, or leave --sentinels out"
        )
    print(f"sentinels {', '.join(str(mark.id) for mark in found.marks)}")
    return found
