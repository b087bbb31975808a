"""A buffer's bytes -> samples, by the names of GenICam's Pixel Format Naming Convention."""

from __future__ import annotations

import re
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from drivers.camera import CameraRefused
from drivers.camera.depth import demosaiced, left_justified

_PATTERNS = {"RG": "RGGB", "GR": "GRBG", "GB": "GBRG", "BG": "BGGR"}
_SHAPE = re.compile(r"(Mono|Bayer(?P<first>RG|GR|GB|BG))(?P<bits>8|10|12|14|16)(?P<packing>p|Packed)?")
READ = "Mono8, Mono10, Mono12, Mono14, Mono16, BayerRG8 to BayerRG16 (GR, GB, BG), 10 and 12 bits packed, RGB8 and BGR8"


@dataclass(frozen=True)
class PixelFormat:
    """What the bytes of a format are. packing: "" = 1 or 2 bytes a sample, "p" = bit by bit, "Packed" = GigE Vision's.

    pattern: of a colour sensor, as `demosaiced` takes it; "" = none. swapped: red and blue; None = one channel.
    """

    name: str
    bits: int
    packing: str = ""
    pattern: str = ""
    swapped: bool | None = None

    def size(self, width: int, height: int) -> int:
        """Bytes of a whole frame."""
        if self.swapped is not None:
            return 3 * width * height
        in_12_bits = self.packing == "Packed"
        bits = (12 if in_12_bits else self.bits) if self.packing else (8 if self.bits == 8 else 16)
        return (width * height * bits + 7) // 8

    def samples(self, data: bytes, width: int, height: int) -> NDArray[np.uint8] | NDArray[np.uint16]:
        """(H, W) grey or (H, W, 3) BGR of their own memory: uint8, or uint16 with the full scale of the sensor at the
        full scale of 16 bits."""
        raw = np.frombuffer(data, np.uint8, self.size(width, height))
        if self.swapped is not None:
            colour = raw.reshape(height, width, 3)
            return np.asarray(cv2.cvtColor(colour, cv2.COLOR_RGB2BGR), np.uint8) if self.swapped else colour.copy()
        if self.bits == 8:
            light = raw.reshape(height, width)
            return demosaiced(light, self.pattern) if self.pattern else light.copy()
        deep = left_justified(self._unpacked(raw, width * height), self.bits).reshape(height, width)
        return demosaiced(deep, self.pattern) if self.pattern else deep

    def _unpacked(self, raw: NDArray[np.uint8], count: int) -> NDArray[np.uint16]:
        if not self.packing:
            return raw.view("<u2").astype(np.uint16)
        if self.packing == "Packed" or self.bits == 12:
            return self._pairs(raw, count)
        # 10p: four samples in five bytes, the lowest bits first.
        groups = _padded(raw, 5)
        values = sum(groups[:, byte].astype(np.uint64) << np.uint64(8 * byte) for byte in range(5))
        samples = [np.asarray(values >> np.uint64(10 * place), np.uint64) & np.uint64(0x3FF) for place in range(4)]
        return np.stack(samples, axis=1).reshape(-1)[:count].astype(np.uint16)

    def _pairs(self, raw: NDArray[np.uint8], count: int) -> NDArray[np.uint16]:
        """Two samples in three bytes."""
        first, shared, second = (column.astype(np.uint16) for column in _padded(raw, 3).T)
        low, high = shared & 0xF, shared >> 4
        if self.packing == "p":
            pair = first | low << 8, high | second << 4
        else:
            spare = self.bits - 8
            mask = np.uint16((1 << spare) - 1)
            pair = first << spare | low & mask, second << spare | high & mask
        return np.stack(pair, axis=1).reshape(-1)[:count].astype(np.uint16)


def pixel_format(name: str) -> PixelFormat:
    """What is known of a format; raise CameraRefused for one that cannot be read here."""
    if name in ("RGB8", "RGB8Packed", "BGR8", "BGR8Packed"):
        return PixelFormat(name, 8, swapped=name.startswith("RGB"))
    found = _SHAPE.fullmatch(name)
    if found is None or (found["packing"] and found["bits"] not in ("10", "12")):
        raise CameraRefused(
            f"pixel format {name} cannot be read here; expected one of {READ}. Correct camera.pixel_format."
        )
    pattern = _PATTERNS[found["first"]] if found["first"] else ""
    return PixelFormat(name, int(found["bits"]), found["packing"] or "", pattern)


def _padded(raw: NDArray[np.uint8], group: int) -> NDArray[np.uint8]:
    """Rows of `group` bytes; the last one filled up."""
    return np.concatenate([raw, np.zeros(-len(raw) % group, np.uint8)]).reshape(-1, group)
