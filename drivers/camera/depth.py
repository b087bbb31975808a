"""Samples of 9 to 16 bits and the eight of them that are looked at."""

from __future__ import annotations

from typing import TypeVar, cast

import cv2
import numpy as np
from numpy.typing import NDArray

Samples = TypeVar("Samples", NDArray[np.uint8], NDArray[np.uint16])

# Glints and hot pixels, which are brighter than all else, may be cut off: a thousandth of the picture.
_CUT_OFF = 1000
_EVERY = 3


def eight_bits(deep: NDArray[np.uint16]) -> NDArray[np.uint8]:
    """The eight uppermost bits that the picture uses, of the same shape; what is brighter is 255.

    Sensors store 10, 12 or 14 bits with free bits above or below them, and a dim block uses few of them: the upper byte
    of 16 would hold a handful of grey levels. Steps are powers of two, so that pictures of one scene keep their levels;
    the same samples give the same bytes on any machine.
    """
    sample = deep[::_EVERY, ::_EVERY]
    allowed = sample.size // _CUT_OFF
    shift = next(
        (bits for bits in range(8) if int(np.count_nonzero(sample >= np.uint16(256 << bits))) <= allowed),
        8,
    )
    return np.asarray(np.minimum(deep >> shift, 255), np.uint8)


def looked_at(samples: NDArray[np.generic]) -> tuple[NDArray[np.uint8], NDArray[np.uint16] | None]:
    """A frame's pixels and its deep samples, None where the samples, uint8 or uint16, are the pixels."""
    if samples.dtype == np.uint8:
        return np.asarray(samples, np.uint8), None
    deep = np.asarray(samples, np.uint16)
    return eight_bits(deep), deep


def left_justified(samples: NDArray[np.uint16], bits: int) -> NDArray[np.uint16]:
    """Samples of `bits` bits, moved so that the sensor's full scale is that of 16."""
    return np.left_shift(samples, 16 - bits)


def demosaiced(mosaic: Samples, pattern: str) -> Samples:
    """A colour sensor's samples, (H, W) -> (H, W, 3) BGR of the same type. pattern: colours of its first two rows'
    first two pixels, RGGB, GRBG, GBRG or BGGR."""
    code = {
        "RGGB": cv2.COLOR_BayerRGGB2BGR,
        "GRBG": cv2.COLOR_BayerGRBG2BGR,
        "GBRG": cv2.COLOR_BayerGBRG2BGR,
        "BGGR": cv2.COLOR_BayerBGGR2BGR,
    }[pattern]
    return cast(Samples, cv2.cvtColor(mosaic, code))
