"""A driver's buffer -> grey or BGR pixels, in one pass over it."""

from __future__ import annotations

import mmap
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from drivers.camera import FrameUnusable
from drivers.camera.depth import demosaiced, left_justified
from drivers.camera.files.decode import decode_picture


@dataclass(frozen=True)
class Layout:
    """How a pixel format lies in memory: bytes a pixel of a row, rows over the picture's height (a fraction), and
    OpenCV's conversion to BGR; None = already grey or BGR. bytes_per_pixel 0 = compressed. bits: of a sample; above 8
    it is a number of two bytes, the lower one first. pattern: of a colour sensor, as `demosaiced` takes it."""

    bytes_per_pixel: int
    rows: tuple[int, int] = (1, 1)
    conversion: int | None = None
    bits: int = 8
    pattern: str = ""


LAYOUTS = {
    "GREY": Layout(1),
    "YUYV": Layout(2, conversion=cv2.COLOR_YUV2BGR_YUYV),
    "UYVY": Layout(2, conversion=cv2.COLOR_YUV2BGR_UYVY),
    "NV12": Layout(1, (3, 2), cv2.COLOR_YUV2BGR_NV12),
    "BGR3": Layout(3),
    "RGB3": Layout(3, conversion=cv2.COLOR_RGB2BGR),
    "MJPG": Layout(0),
    "JPEG": Layout(0),
    **{f"Y{bits}": Layout(2, bits=bits) for bits in (10, 12, 14, 16)},
    # Bayer, by the kernel's codes for a first row of BG, GB, GR and RG.
    **{
        code: Layout(1 if bits == 8 else 2, bits=bits, pattern=pattern)
        for bits, codes in {
            8: ("BA81", "GBRG", "GRBG", "RGGB"),
            10: ("BG10", "GB10", "BA10", "RG10"),
            12: ("BG12", "GB12", "BA12", "RG12"),
            14: ("BG14", "GB14", "GR14", "RG14"),
            16: ("BYR2", "GB16", "GR16", "RG16"),
        }.items()
        for code, pattern in zip(codes, ("BGGR", "GBRG", "GRBG", "RGGB"), strict=True)
    },
}


@dataclass(frozen=True)
class PictureFormat:
    """The format that the device was set to. bytes_per_line: distance of two rows; 0 = compressed."""

    code: str
    width: int
    height: int
    bytes_per_line: int


def bytes_needed(layout: PictureFormat) -> int:
    """Bytes that a whole frame fills at least; 1 for a compressed one, whose decoding tells."""
    kind = LAYOUTS[layout.code]
    if kind.bytes_per_pixel == 0:
        return 1
    rows = layout.height * kind.rows[0] // kind.rows[1]
    return _stride(layout, kind) * (rows - 1) + layout.width * kind.bytes_per_pixel


def to_samples(
    memory: mmap.mmap, bytes_used: int, layout: PictureFormat, source: str
) -> NDArray[np.uint8] | NDArray[np.uint16]:
    """Samples of their own memory, (H, W) grey or (H, W, 3) BGR, uint8, or uint16 with the sensor's full scale at that
    of 16 bits; raise FrameUnusable for a damaged JPEG.

    One copy is made, the conversion itself. What follows a JPEG's end in its buffer is ignored.
    """
    kind = LAYOUTS[layout.code]
    if kind.bytes_per_pixel == 0:
        pixels = decode_picture(memory[:bytes_used], source)
        if pixels.shape[:2] != (layout.height, layout.width):
            seen = f"{source}: a JPEG of {pixels.shape[1]} x {pixels.shape[0]} pixels"
            raise FrameUnusable(f"{seen}; expected {layout.width} x {layout.height}. The next frame is tried.")
        return pixels
    rows = layout.height * kind.rows[0] // kind.rows[1]
    strides = (_stride(layout, kind), kind.bytes_per_pixel, 1)
    view: NDArray[np.uint8] = np.ndarray(
        (rows, layout.width, kind.bytes_per_pixel), np.uint8, buffer=memory, strides=strides
    )
    if kind.bytes_per_pixel == 1:
        view = view[:, :, 0]
    if kind.bits > 8:
        words: NDArray[np.uint16] = np.ndarray(
            (rows, layout.width), np.dtype("<u2"), buffer=memory, strides=strides[:2]
        )
        deep = left_justified(words, kind.bits)
        return demosaiced(deep, kind.pattern) if kind.pattern else deep
    if kind.pattern:
        return demosaiced(view, kind.pattern)
    if kind.conversion is None:
        return view.copy()
    return np.asarray(cv2.cvtColor(view, kind.conversion), dtype=np.uint8)


def _stride(layout: PictureFormat, kind: Layout) -> int:
    """Bytes from row to row: the driver's, or, where it tells none, rows without a gap."""
    return max(layout.bytes_per_line, layout.width * kind.bytes_per_pixel)
