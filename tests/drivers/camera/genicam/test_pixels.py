from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.camera import CameraRefused
from drivers.camera.depth import demosaiced, eight_bits
from drivers.camera.genicam.pixels import pixel_format


def packed(values, bits, packing):
    """Samples as the standard packs them, written from its pictures bit by bit."""
    if packing == "":
        return np.asarray(values, "<u2").tobytes()
    if packing == "p":  # one stream of bits, the lowest first
        stream = "".join(f"{value:0{bits}b}"[::-1] for value in values)
        stream += "0" * (-len(stream) % 8)
        return bytes(int(stream[at : at + 8][::-1], 2) for at in range(0, len(stream), 8))
    out = b""  # GigE Vision: upper bytes of two samples around a byte that holds the rest of both
    for first, second in zip(values[::2], [*values[1::2], 0][: len(values[::2])], strict=True):
        spare = bits - 8
        low = (1 << spare) - 1
        out += bytes([first >> spare, (first & low) | (second & low) << 4, second >> spare])
    return out


@pytest.mark.parametrize(
    ("name", "bits", "packing"),
    [
        ("Mono10", 10, ""),
        ("Mono12", 12, ""),
        ("Mono14", 14, ""),
        ("Mono16", 16, ""),
        ("Mono10Packed", 10, "Packed"),
        ("Mono12Packed", 12, "Packed"),
        ("Mono10p", 10, "p"),
        ("Mono12p", 12, "p"),
    ],
)
@given(seed=st.integers(0, 2**32 - 1), width=st.integers(1, 9), height=st.integers(1, 5))
def test_every_sample_of_a_packed_frame_is_kept_to_its_last_bit(name, bits, packing, seed, width, height):
    values = np.random.default_rng(seed).integers(0, 1 << bits, (height, width))
    kind = pixel_format(name)
    data = packed([int(value) for value in values.ravel()], bits, packing)
    deep = kind.samples(data + bytes(3), width, height)
    assert kind.size(width, height) <= len(data)
    assert deep.dtype == np.uint16
    np.testing.assert_array_equal(deep >> (16 - bits), values)
    assert not np.any(deep & ((1 << (16 - bits)) - 1))


@pytest.mark.parametrize("first", ["RG", "GR", "GB", "BG"])
@pytest.mark.parametrize("depth", ["8", "12"])
def test_a_colour_sensor_s_mosaic_becomes_its_colours(first, depth):
    bgr = (40, 90, 200)
    red, green, blue = (np.uint16(level) << np.uint16(4 * (depth == "12")) for level in reversed(bgr))
    corner = {"R": red, "G": green, "B": blue}
    second = {"RG": "GB", "GR": "BG", "GB": "RG", "BG": "GR"}[first]
    cell = np.array([[corner[letter] for letter in first], [corner[letter] for letter in second]], np.uint16)
    mosaic = np.tile(cell, (6, 6))
    data = mosaic.astype("<u2").tobytes() if depth == "12" else mosaic.astype(np.uint8).tobytes()
    colours = pixel_format(f"Bayer{first}{depth}").samples(data, 12, 12)
    assert colours.dtype == (np.uint16 if depth == "12" else np.uint8)
    assert tuple(colours[6, 6] >> (8 if depth == "12" else 0)) == bgr


def test_red_and_blue_come_in_the_order_of_opencv():
    data = bytes([10, 20, 30] * 4)
    assert tuple(pixel_format("RGB8").samples(data, 2, 2)[0, 0]) == (30, 20, 10)
    assert tuple(pixel_format("BGR8").samples(data, 2, 2)[0, 0]) == (10, 20, 30)


@pytest.mark.parametrize("name", ["YUV422_8", "Mono1p", "Mono16p", "mono8", "BayerXY8", "Mono8 "])
def test_a_format_that_cannot_be_read_is_refused_by_name(name):
    with pytest.raises(CameraRefused, match="expected one of Mono8"):
        pixel_format(name)


@given(shift=st.integers(0, 8), seed=st.integers(0, 1000))
def test_of_deep_samples_the_eight_bits_that_they_use_are_looked_at(shift, seed):
    light = np.random.default_rng(seed).integers(0, 256, (60, 80)).astype(np.uint16)
    light[::3, ::3] |= 0x80  # the upper bit is in use
    np.testing.assert_array_equal(eight_bits(light << np.uint16(shift)), light)


def test_a_few_glints_do_not_push_a_dim_picture_into_the_dark():
    dim = np.full((300, 300), 900, np.uint16)
    dim[150, 147:153] = 65535
    assert eight_bits(dim)[0, 0] == 900 >> 2
    assert eight_bits(dim)[150, 150] == 255
    dim[:100] = 65535
    assert eight_bits(dim)[299, 0] == 900 >> 8


def test_demosaicing_keeps_the_type_and_full_depth():
    mosaic = np.full((8, 8), 4095 << 4, np.uint16)
    assert demosaiced(mosaic, "RGGB").max() == 4095 << 4
    assert cv2.cvtColor(demosaiced(mosaic, "RGGB"), cv2.COLOR_BGR2GRAY).dtype == np.uint16
