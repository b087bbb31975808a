"""Whether an array is a picture at all."""

from __future__ import annotations

import numpy as np

from contour.errors import PictureError
from contour.geometry.arrays import Bytes


def check_picture(picture: Bytes) -> None:
    """Raise PictureError unless the array is a grey (H, W) or BGR (H, W, 3) picture, uint8, with pixels in it."""
    kind = f"{picture.dtype} of shape {picture.shape}"
    if picture.dtype != np.uint8:
        raise PictureError(f"The picture is {kind}: expected 8 bits a channel (uint8). Convert it first.")
    if picture.ndim != 2 and not (picture.ndim == 3 and picture.shape[2] == 3):
        raise PictureError(f"The picture is {kind}: expected (H, W) grey or (H, W, 3) BGR. Convert it first.")
    if picture.size == 0:
        raise PictureError(f"The picture is {kind}: it has no pixels. Check the camera or the file.")
