"""Bytes of a picture file -> pixels one can measure on, or an error that says why not.

A contour is only as honest as its picture, so nothing is repaired here: a file that ends early, a half-decoded one, one
whose grey values would be guessed (CMYK without its profile, floating point, see-through pixels) is refused.
"""

from __future__ import annotations

import stat
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from drivers.camera import FrameUnusable
from drivers.camera.depth import looked_at
from drivers.camera.files.folder import shown
from drivers.camera.files.headers import Header, HeaderError, read_header

# The largest industrial sensors have 151 million pixels. In colour this many are 600 MB.
MAX_PIXELS = 200_000_000
# An uncompressed picture of MAX_PIXELS in 16-bit colour takes 1.2 GB.
MAX_BYTES = 1_300_000_000

EXPECTED = "a whole 8- or 16-bit grey or colour picture (PNG, JPEG, BMP, TIFF, WebP, PNM, PAM, GIF, JPEG 2000, AVIF)"

# What OpenCV logs of a broken file is said by the error that follows; on standard error it would only be noise.
cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)


def read_picture(path: str | Path) -> NDArray[np.uint8]:
    """The picture in a file: (H, W) grey or (H, W, 3) BGR, uint8; raise FrameUnusable, naming the file."""
    return looked_at(read_samples(path))[0]


def read_samples(path: str | Path) -> NDArray[np.uint8] | NDArray[np.uint16]:
    """All that the picture in a file holds, as `decode_samples` has it; raise FrameUnusable, naming the file."""
    return decode_samples(_read_bytes(Path(path)), shown(path))


def decode_picture(data: bytes, source: str) -> NDArray[np.uint8]:
    """The picture in `data`, as `decode_samples` has it; of 16-bit samples the eight bits that it uses, uint8."""
    return looked_at(decode_samples(data, source))[0]


def decode_samples(data: bytes, source: str) -> NDArray[np.uint8] | NDArray[np.uint16]:
    """The picture in `data`, (H, W) grey or (H, W, 3) BGR, uint8 or uint16, its own memory; raise FrameUnusable, naming
    `source`.

    Rows and columns are the file's own: an orientation noted beside the pixels (EXIF) is left alone, as a calibration
    holds for the sensor's rows and columns. Of several pictures in one file the first counts. A JPEG damaged in its
    middle cannot be told from a good one where its length still fits.
    """
    header = _checked_header(data, source)
    pixels = _decoded(data, source, header)
    if pixels.shape[:2] != (header.height, header.width):
        seen = (
            f"decoded to {pixels.shape[1]} × {pixels.shape[0]} pixels, its header says {header.width} × {header.height}"
        )
        raise _unusable(source, seen, "Make the picture anew.")
    if header.kind == "JPEG" and _ends_early(data, header, pixels):
        raise _unusable(source, "JPEG data that end before the picture is full", "Copy or record it anew.")
    opaque = _opaque(pixels, source)
    if opaque.dtype == np.uint8:
        return np.asarray(opaque, np.uint8)
    if opaque.dtype != np.uint16:
        raise _unusable(source, f"samples of type {opaque.dtype}", "Export it as 8-bit grey or RGB.")
    return np.asarray(opaque, np.uint16)


def _unusable(source: str, seen: str, advice: str, expected: str = EXPECTED) -> FrameUnusable:
    return FrameUnusable(f"{source}: {seen}; expected {expected}. {advice}")


def _read_bytes(path: Path) -> bytes:
    """The file's content, refused before it is read where it is no regular file or beyond any picture's size."""
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):
            kind = "a folder" if stat.S_ISDIR(status.st_mode) else "no regular file"
            raise _unusable(shown(path), kind, "Name a picture file.")
        if status.st_size > MAX_BYTES:
            raise _unusable(shown(path), f"{status.st_size} bytes", f"At most {MAX_BYTES} bytes are read.")
        return path.read_bytes()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise _unusable(shown(path), f"cannot be read ({reason})", "Check path and permissions.") from error


def _checked_header(data: bytes, source: str) -> Header:
    if not data:
        raise _unusable(source, "empty", "Copy or record it anew.")
    try:
        header = read_header(data)
    except HeaderError as error:
        raise _unusable(source, f"broken ({error})", "Copy or record it anew.") from error
    if header is None:
        raise _unusable(source, f"no picture, it begins with {data[:8]!r}", "Name a picture file.")
    if header.unfit:
        raise _unusable(source, f"{header.kind} with {header.unfit}", "Export it as 8-bit grey or RGB.")
    if header.width <= 0 or header.height <= 0 or header.width * header.height > MAX_PIXELS:
        seen = f"{header.kind} that claims {header.width} × {header.height} pixels"
        raise _unusable(source, seen, "Crop or reduce it.", f"1 to {MAX_PIXELS} pixels")
    if not header.complete:
        raise _unusable(
            source, f"truncated {header.kind}, {len(data)} bytes without its end", "Copy or record it anew."
        )
    return header


def _decoded(data: bytes, source: str, header: Header) -> NDArray[np.generic]:
    """What OpenCV makes of the bytes, unchanged: any depth, alpha kept, orientation ignored."""
    try:
        pixels = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error as error:
        raise _unusable(
            source, f"{header.kind} that cannot be decoded ({error.err})", "Make the picture anew."
        ) from error
    if pixels is None:
        seen = f"truncated or damaged {header.kind} of {len(data)} bytes"
        raise _unusable(source, seen, "Copy or record it anew.")
    return pixels


def _ends_early(data: bytes, header: Header, pixels: NDArray[np.generic]) -> bool:
    """True where a JPEG's data ran out before its last block, although its end marker is there.

    That is what lost packets of a video stream leave behind. libjpeg fills what is missing with blocks of exactly 128,
    so only pictures that end in such a corner are suspects. Their data are lengthened before the end marker: that
    cannot change a picture that was full, and goes into the blocks of one that was not.
    """
    height, width = pixels.shape[:2]
    corner = pixels[max(height - 4, (height - 1) // 8 * 8) :, max(width - 4, (width - 1) // 8 * 8) :]
    if not np.array_equal(corner, np.full_like(corner, 128)):
        return False
    lengthened = data[: header.end] + bytes(range(1, 251)) * 2 + b"\xff\xd9"
    return not np.array_equal(pixels, _decoded(lengthened, "", header))


def _opaque(pixels: NDArray[np.generic], source: str) -> NDArray[np.generic]:
    """Grey or BGR without the alpha channel, which must not hide anything: no camera knows what lies behind a pixel."""
    if pixels.ndim == 2 or pixels.shape[2] == 3:
        return pixels
    if pixels.shape[2] != 4:
        raise _unusable(source, f"{pixels.shape[2]} channels", "Export it as grey or RGB.")
    full = {"uint8": 0xFF, "uint16": 0xFFFF}.get(pixels.dtype.name)
    if np.any(pixels[:, :, 3] != full):
        raise _unusable(source, "see-through pixels (alpha)", "Export it without transparency.", "an opaque picture")
    return np.ascontiguousarray(pixels[:, :, :3])
