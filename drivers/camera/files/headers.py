"""Format and size of a picture file, read from its first bytes without decoding it."""

from __future__ import annotations

import re
import struct
from collections.abc import Callable
from dataclasses import dataclass


class HeaderError(ValueError):
    """The bytes begin like a picture, but their header is cut off or contradicts itself."""


@dataclass(frozen=True)
class Header:
    """What a file says of itself.

    complete is False where its end is missing; unfit names samples that are no measured grey or colour, "" where there
    are none. end: where a JPEG's end-of-image marker stands, else 0.
    """

    kind: str
    width: int
    height: int
    complete: bool = True
    unfit: str = ""
    end: int = 0


def read_header(data: bytes) -> Header | None:
    """The header of `data`, None where it is no picture of a known format; HeaderError where it is broken.

    Pixel counts are the file's own claim: a file of a few hundred bytes may claim gigabytes.
    """
    for signature, reader in _READERS:
        if re.match(signature, data, re.DOTALL):
            try:
                return reader(data)
            except (struct.error, IndexError) as error:
                raise HeaderError("it ends within its header") from error
            except ValueError as error:
                raise HeaderError(f"its header makes no sense: {error}") from error
    return None


def _png(data: bytes) -> Header:
    """Chunks are length, type, data, CRC; IEND is the last one. OpenCV checks their CRCs when it decodes."""
    width, height = struct.unpack_from(">II", data, 16)
    at, kind = 8, b""
    while kind != b"IEND" and at + 12 <= len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        at += 12 + length
    return Header("PNG", width, height, complete=kind == b"IEND" and at <= len(data))


# Within a scan 0xFF is data where 0x00 follows, and the scan goes on after a restart marker (0xD0 to 0xD7).
_JPEG_SCAN_END = re.compile(rb"\xff[^\x00\xd0-\xd7\xff]")


def _jpeg(data: bytes) -> Header:
    """Segments up to the end-of-image marker; a thumbnail's own markers lie inside a segment and do not count."""
    at, end, width, height, components = 2, 0, 0, 0, 0
    while True:
        found = _JPEG_SCAN_END.search(data, at)
        if found is None:
            break
        marker, at = data[found.end() - 1], found.end()
        if marker == 0xD9:
            end = found.end() - 2
            break
        if at + 2 > len(data):
            break
        length = int.from_bytes(data[at : at + 2], "big")
        if 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC):
            height, width, components = struct.unpack_from(">HHB", data, at + 3)
        at += length
    if not components:
        raise HeaderError("it ends before its size is told")
    unfit = "four colour components (CMYK)" if components == 4 else ""
    return Header("JPEG", width, height, complete=end > 0, unfit=unfit, end=end)


def _bmp(data: bytes) -> Header:
    header_size = struct.unpack_from("<I", data, 14)[0]
    width, height = struct.unpack_from("<HH" if header_size == 12 else "<ii", data, 18)
    return Header("BMP", width, abs(height))


def _tiff(data: bytes) -> Header:
    """Width and height are tags 256 and 257 of the first directory, as 16- or 32-bit numbers."""
    order = "<" if data[:2] == b"II" else ">"
    if struct.unpack_from(order + "H", data, 2)[0] == 43:
        raise HeaderError("a BigTIFF; only classic TIFF files are read")
    directory = struct.unpack_from(order + "I", data, 4)[0]
    sizes = {}
    for entry in range(struct.unpack_from(order + "H", data, directory)[0]):
        at = directory + 2 + 12 * entry
        tag, kind = struct.unpack_from(order + "HH", data, at)
        if tag in (256, 257):
            sizes[tag] = struct.unpack_from(order + ("H" if kind == 3 else "I"), data, at + 8)[0]
    if len(sizes) != 2:
        raise HeaderError("its directory does not tell width and height")
    return Header("TIFF", sizes[256], sizes[257])


def _webp(data: bytes) -> Header:
    complete = len(data) >= struct.unpack_from("<I", data, 4)[0] + 8
    kind = data[12:16]
    if kind == b"VP8X":
        width = int.from_bytes(data[24:27], "little") + 1
        height = int.from_bytes(data[27:30], "little") + 1
    elif kind == b"VP8L":
        bits = struct.unpack_from("<I", data, 21)[0]
        width, height = (bits & 0x3FFF) + 1, (bits >> 14 & 0x3FFF) + 1
    else:
        width, height = (size & 0x3FFF for size in struct.unpack_from("<HH", data, 26))
    return Header("WebP", width, height, complete)


def _pnm(data: bytes) -> Header:
    """Magic, width, height, split by blanks and by comments that run from # to the line's end."""
    words = re.sub(rb"#[^\n]*\n", b"\n", data[:4096]).split(maxsplit=3)
    return Header("PNM", int(words[1]), int(words[2]))


def _pam(data: bytes) -> Header:
    width, height = (re.search(rb"\n" + name + rb"\s+(\d+)", data[:4096]) for name in (b"WIDTH", b"HEIGHT"))
    if width is None or height is None:
        raise HeaderError("WIDTH or HEIGHT is missing")
    return Header("PAM", int(width[1]), int(height[1]))


def _gif(data: bytes) -> Header:
    width, height = struct.unpack_from("<HH", data, 6)
    return Header("GIF", width, height)


def _box(name: bytes) -> Callable[[bytes, int], int]:
    """A finder of the first box called `name` in the file's first part: offset of its content."""

    def find(data: bytes, start: int) -> int:
        at = data.find(name, start, 65536)
        if at < 0:
            raise HeaderError(f"its '{name.decode()}' box is missing")
        return at + len(name)

    return find


def _jpeg2000(data: bytes) -> Header:
    height, width = struct.unpack_from(">II", data, _box(b"ihdr")(data, 0))
    return Header("JPEG 2000", width, height)


def _avif(data: bytes) -> Header:
    """The largest of the items' sizes: thumbnails and alpha planes have boxes of their own."""
    _box(b"ispe")(data, 0)
    sizes = [struct.unpack_from(">II", data, found.end() + 4) for found in re.finditer(b"ispe", data[:65536])]
    width, height = max(sizes)
    return Header("AVIF", width, height)


def _floating(kind: str) -> Callable[[bytes], Header]:
    """A reader for formats whose samples are floating-point numbers: named, never decoded."""
    return lambda _data: Header(kind, 1, 1, unfit="floating-point samples")


# Sun raster is missing on purpose: OpenCV 5.0 decodes its grey pictures to black.
_READERS: tuple[tuple[bytes, Callable[[bytes], Header]], ...] = (
    (rb"\x89PNG\r\n\x1a\n", _png),
    (rb"\xff\xd8\xff", _jpeg),
    (rb"BM", _bmp),
    (rb"II[*+]\0|MM\0[*+]", _tiff),
    (rb"RIFF....WEBP", _webp),
    (rb"P[1-6]\s", _pnm),
    (rb"P7\n", _pam),
    (rb"GIF8[79]a", _gif),
    (rb"\0\0\0\x0cjP  ", _jpeg2000),
    (rb"....ftyp(avif|avis)", _avif),
    (rb"#\?(RADIANCE|RGBE)", _floating("Radiance HDR")),
    (rb"P[Ff]\s", _floating("PFM")),
    (rb"v/1\x01", _floating("OpenEXR")),
)
