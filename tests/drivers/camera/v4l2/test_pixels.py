from __future__ import annotations

import mmap

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.camera import FrameUnusable
from drivers.camera.v4l2.exposure import FrameTiming
from drivers.camera.v4l2.pixels import LAYOUTS, PictureFormat, bytes_needed, to_samples

WIDTH, HEIGHT = 64, 48
PADDING = 32
ROWS = {"NV12": HEIGHT * 3 // 2}
NOISE = np.random.default_rng(5)


def in_memory(content):
    """The bytes in shared memory, as a driver lends it."""
    memory = mmap.mmap(-1, len(content))
    memory[:] = content
    return memory


def raw_picture(code, padding):
    """A noisy buffer of a format with `padding` bytes behind each row: its memory, format, and rows without padding."""
    row_bytes = WIDTH * LAYOUTS[code].bytes_per_pixel
    rows = NOISE.integers(0, 256, (ROWS.get(code, HEIGHT), row_bytes + padding), np.uint8)
    layout = PictureFormat(code, WIDTH, HEIGHT, row_bytes + padding)
    return in_memory(rows.tobytes()), layout, np.ascontiguousarray(rows[:, :row_bytes])


CONVERSIONS = {
    "YUYV": cv2.COLOR_YUV2BGR_YUYV,
    "UYVY": cv2.COLOR_YUV2BGR_UYVY,
    "NV12": cv2.COLOR_YUV2BGR_NV12,
    "RGB3": cv2.COLOR_RGB2BGR,
}


@pytest.mark.parametrize("padding", [0, PADDING])
@pytest.mark.parametrize("code", ["GREY", "BGR3", *CONVERSIONS])
def test_pixels_are_those_of_the_rows_without_what_pads_them(code, padding):
    memory, layout, rows = raw_picture(code, padding)
    pixels = to_samples(memory, len(memory), layout, "camera")
    packed = rows if code in ("GREY", "NV12") else rows.reshape(HEIGHT, WIDTH, -1)
    expected = cv2.cvtColor(packed, CONVERSIONS[code]) if code in CONVERSIONS else packed
    np.testing.assert_array_equal(pixels, expected)
    assert pixels.flags.c_contiguous
    assert pixels.flags.writeable


@pytest.mark.parametrize("padding", [0, PADDING])
@pytest.mark.parametrize("code", ["Y10", "Y12", "Y14", "Y16"])
def test_deep_samples_are_kept_to_their_last_bit(code, padding):
    bits = int(code[1:])
    words = NOISE.integers(0, 1 << bits, (HEIGHT, WIDTH + padding // 2)).astype("<u2")
    layout = PictureFormat(code, WIDTH, HEIGHT, 2 * WIDTH + padding)
    samples = to_samples(in_memory(words.tobytes()), words.nbytes, layout, "camera")
    np.testing.assert_array_equal(samples >> (16 - bits), words[:, :WIDTH])


@pytest.mark.parametrize(("code", "bits"), [("RGGB", 8), ("RG10", 10), ("RG12", 12), ("RG16", 16)])
def test_a_mosaic_becomes_its_colours(code, bits):
    cell = np.array([[200, 90], [90, 40]], np.uint16) << np.uint16(bits - 8)
    mosaic = np.tile(cell, (HEIGHT // 2, WIDTH // 2)).astype(np.uint8 if bits == 8 else "<u2")
    layout = PictureFormat(code, WIDTH, HEIGHT, mosaic.strides[0])
    samples = to_samples(in_memory(mosaic.tobytes()), mosaic.nbytes, layout, "camera")
    assert tuple(samples[20, 20] >> (0 if bits == 8 else 8)) == (40, 90, 200)


@pytest.mark.parametrize("code", ["GREY", "BGR3", *CONVERSIONS])
def test_pixels_stay_when_the_driver_fills_its_buffer_again(code):
    memory, layout, _ = raw_picture(code, PADDING)
    pixels = to_samples(memory, len(memory), layout, "camera")
    before = pixels.copy()
    memory[:] = bytes(len(memory))
    np.testing.assert_array_equal(pixels, before)
    memory.close()  # would raise if an array still looked into it


def test_a_whole_frame_needs_all_its_rows_but_not_the_last_ones_padding():
    _, layout, _ = raw_picture("NV12", PADDING)
    assert bytes_needed(layout) == (WIDTH + PADDING) * (HEIGHT * 3 // 2) - PADDING


def jpeg_frame(padding, size=(WIDTH, HEIGHT)):
    smooth = cv2.resize(NOISE.integers(0, 256, (6, 8, 3), np.uint8), size, interpolation=cv2.INTER_CUBIC)
    data = cv2.imencode(".jpg", smooth)[1].tobytes()
    return data, in_memory(data + bytes(padding)), PictureFormat("MJPG", WIDTH, HEIGHT, 0)


@pytest.mark.parametrize("padding", [0, 1, 4096])
def test_a_jpeg_frame_is_read_whatever_pads_its_buffer(padding):
    data, memory, layout = jpeg_frame(padding)
    expected = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    np.testing.assert_array_equal(to_samples(memory, len(memory), layout, "camera"), expected)


def test_a_jpeg_frame_that_was_cut_or_has_another_size_is_unusable():
    data, memory, layout = jpeg_frame(0)
    with pytest.raises(FrameUnusable, match="camera: truncated JPEG"):
        to_samples(memory, len(data) * 2 // 3, layout, "camera")
    _, memory, layout = jpeg_frame(0, (WIDTH, HEIGHT // 2))
    with pytest.raises(FrameUnusable, match=r"a JPEG of 64 x 24 pixels; expected 64 x 48"):
        to_samples(memory, len(memory), layout, "camera")


@given(
    began=st.floats(0, 1e6),
    exposure=st.floats(0, 0.1),
    readout=st.floats(0, 1),
    period=st.floats(0.001, 0.5),
    known=st.booleans(),
    latency=st.floats(0, 2),
)
def test_a_frame_never_counts_as_begun_later_than_it_did(began, exposure, readout, period, known, latency):
    """A free-running sensor exposes for at most a period and reads out in at most a period."""
    exposure = min(exposure, period)
    stamp_s = began + exposure + readout * period + latency
    timing = FrameTiming(period, exposure if known else None, latency)
    assert timing.earliest_start_s(stamp_s, at_start_of_exposure=False) <= began + 1e-9
    assert timing.earliest_start_s(began, at_start_of_exposure=True) == began
