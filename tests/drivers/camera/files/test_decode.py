from __future__ import annotations

import os
import struct
import zlib

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.camera import FrameUnusable
from drivers.camera.files.decode import MAX_PIXELS, decode_picture, decode_samples, read_picture
from drivers.camera.files.headers import HeaderError, read_header

HEIGHT, WIDTH = 97, 131


def grey_picture():
    """A smooth picture with every grey level, so that a cut or a shift of it shows."""
    noise = np.random.default_rng(7).random((HEIGHT, WIDTH))
    smooth = cv2.GaussianBlur(noise, (0, 0), 3)
    return cv2.normalize(smooth, None, 0, 255, cv2.NORM_MINMAX).astype(np.uint8)


GREY = grey_picture()
BGR = cv2.merge([GREY, 255 - GREY, GREY // 2])


def encoded(extension, picture, *options):
    done, data = cv2.imencode(extension, picture, list(options))
    assert done
    return data.tobytes()


def png_chunk(kind, content):
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))


def png(width, height, bits, colour, rows, *extra):
    """A PNG written by hand: for headers that no encoder would write."""
    header = png_chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, bits, colour, 0, 0, 0))
    body = b"".join(png_chunk(*chunk) for chunk in extra) + png_chunk(b"IDAT", zlib.compress(rows))
    return b"\x89PNG\r\n\x1a\n" + header + body + png_chunk(b"IEND", b"")


LOSSLESS = [".png", ".bmp", ".tif", ".pgm", ".pam", ".jp2"]
LOSSY = [".jpg", ".webp", ".avif", ".gif"]


@pytest.mark.parametrize("extension", LOSSLESS)
@pytest.mark.parametrize("picture", [GREY, BGR], ids=["grey", "colour"])
def test_a_lossless_picture_is_read_as_it_was_written(extension, picture):
    extension = ".ppm" if extension == ".pgm" and picture.ndim == 3 else extension
    options = (cv2.IMWRITE_JPEG2000_COMPRESSION_X1000, 1000) if extension == ".jp2" else ()
    pixels = decode_picture(encoded(extension, picture, *options), "picture")
    assert pixels.dtype == np.uint8
    assert pixels.flags.owndata
    assert pixels.flags.writeable
    np.testing.assert_array_equal(pixels, picture)


@pytest.mark.parametrize("extension", LOSSY)
def test_a_lossy_picture_is_read_close_to_what_was_written(extension):
    pixels = decode_picture(encoded(extension, BGR), "picture")
    assert pixels.shape == BGR.shape
    assert np.abs(pixels.astype(int) - BGR).mean() < 20


@pytest.mark.parametrize("extension", [*LOSSLESS, *LOSSY])
@pytest.mark.parametrize("share", [0.0005, 0.02, 0.1, 0.5, 0.9, 0.99])
def test_a_truncated_picture_is_an_error_that_names_the_file(extension, share):
    picture = BGR if extension in (".webp", ".gif") else GREY
    data = encoded(extension, picture)
    with pytest.raises(FrameUnusable, match=r"^cut: .*expected"):
        decode_picture(data[: max(1, int(len(data) * share))], "cut")


@pytest.mark.parametrize("extension", [".png", ".jpg", ".webp"])
def test_a_picture_without_its_last_byte_is_truncated(extension):
    with pytest.raises(FrameUnusable, match="truncated"):
        decode_picture(encoded(extension, BGR)[:-1], "cut")


@given(st.integers(0, 255), st.integers(1, 100_000))
def test_a_jpeg_cut_anywhere_is_refused_whatever_fills_the_gap(filler, cut):
    data = encoded(".jpg", GREY)
    cut = 2 + cut % (len(data) - 4)
    with pytest.raises(FrameUnusable):
        decode_picture(data[:cut] + bytes([min(filler, 0xFE)]) * 500, "cut")


@pytest.mark.parametrize("picture", [GREY, BGR], ids=["grey", "colour"])
@pytest.mark.parametrize("kept", [0.3, 0.6, 0.9])
def test_a_jpeg_that_lost_data_before_its_end_marker_is_refused(picture, kept):
    data = encoded(".jpg", picture)
    with pytest.raises(FrameUnusable, match="end before the picture is full"):
        decode_picture(data[: int(len(data) * kept)] + b"\xff\xd9", "lost")


def test_a_jpeg_that_lost_a_packet_in_its_middle_is_refused_as_its_data_run_out():
    data = encoded(".jpg", GREY)
    with pytest.raises(FrameUnusable, match="end before the picture is full"):
        decode_picture(data[:2000] + data[2700:], "lost")


def test_an_honest_jpeg_that_ends_in_mid_grey_is_read():
    pixels = decode_picture(encoded(".jpg", np.full((64, 64), 128, np.uint8)), "flat")
    assert (pixels == 128).all()


def test_a_jpeg_with_padding_behind_its_end_is_read():
    data = encoded(".jpg", GREY)
    np.testing.assert_array_equal(decode_picture(data + bytes(4000), "padded"), decode_picture(data, "plain"))


def test_a_thumbnails_end_marker_does_not_hide_that_the_picture_is_cut():
    data = encoded(".jpg", GREY)
    thumbnail = encoded(".jpg", GREY[:16, :16])
    with_thumbnail = data[:2] + b"\xff\xe1" + struct.pack(">H", len(thumbnail) + 2) + thumbnail + data[2:]
    assert decode_picture(with_thumbnail, "whole").shape == GREY.shape
    with pytest.raises(FrameUnusable, match="truncated JPEG"):
        decode_picture(with_thumbnail[:-3], "cut")


@pytest.mark.parametrize("options", [(cv2.IMWRITE_JPEG_PROGRESSIVE, 1), (cv2.IMWRITE_JPEG_RST_INTERVAL, 2)])
def test_other_jpeg_codings_are_read_and_refused_when_cut(options):
    data = encoded(".jpg", GREY, *options)
    assert decode_picture(data, "whole").shape == GREY.shape
    with pytest.raises(FrameUnusable, match="truncated"):
        decode_picture(data[: len(data) * 3 // 4], "cut")


@given(st.integers(8, 10_000), st.integers(1, 255))
def test_a_png_with_a_damaged_byte_is_refused(at, change):
    data = bytearray(encoded(".png", GREY))
    data[8 + at % (len(data) - 8)] ^= change
    with pytest.raises(FrameUnusable):
        decode_picture(bytes(data), "damaged")


@pytest.mark.parametrize(
    ("data", "seen"),
    [
        (b"", "empty"),
        (b"recipe: 1\nname: default\n", "no picture"),
        (b"\x89PNG\r\n\x1a\n", "ends within its header"),
        (b"\xff\xd8\xff\xe0", "ends before its size is told"),
        (b"BM", "ends within its header"),
        (b"II*\0", "ends within its header"),
        (b"P5\nwide 3\n255\n", "its header makes no sense"),
        (b"%PDF-1.7", "no picture, it begins with"),
        (bytes(1000), "no picture"),
        (b"\x59\xa6\x6a\x95" + struct.pack(">7I", 8, 8, 8, 64, 1, 0, 0) + bytes(64), "no picture"),
    ],
)
def test_bytes_that_are_no_picture_are_told_as_such(data, seen):
    with pytest.raises(FrameUnusable, match=seen):
        decode_picture(data, "file")


@pytest.mark.parametrize(
    "data",
    [
        png(60_000, 60_000, 8, 0, b""),
        png(0, 100, 8, 0, b""),
        b"P5\n60000 60000\n255\n",
        b"P7\nWIDTH 60000\nHEIGHT 60000\nDEPTH 1\nMAXVAL 255\nENDHDR\n",
        b"GIF89a" + struct.pack("<HH", 60_000, 60_000) + bytes(20),
        b"BM" + bytes(12) + struct.pack("<Iii", 40, 60_000, -60_000) + bytes(40),
        b"MM\0*" + struct.pack(">IH", 8, 2) + struct.pack(">HHIIHHII", 256, 4, 1, 60_000, 257, 4, 1, 60_000),
        b"RIFF" + struct.pack("<I", 22) + b"WEBPVP8X" + bytes(8) + b"\x5f\xea\0\x5f\xea\0",
    ],
)
def test_a_header_that_claims_a_huge_or_empty_picture_is_refused_before_decoding(data, monkeypatch):
    monkeypatch.setattr(cv2, "imdecode", None)
    with pytest.raises(FrameUnusable, match=f"claims .* expected 1 to {MAX_PIXELS} pixels"):
        decode_picture(data, "huge")


@pytest.mark.parametrize("extension", [".png", ".jpg", ".bmp", ".tif", ".webp", ".pam", ".jp2", ".gif", ".avif"])
@pytest.mark.parametrize(("height", "width"), [(97, 131), (300, 64), (40, 500)])
def test_the_header_tells_the_size_that_decoding_gives(extension, height, width):
    picture = cv2.resize(BGR, (width, height))
    header = read_header(encoded(extension, picture))
    assert (header.width, header.height, header.complete) == (width, height, True)


@given(st.binary(max_size=200), st.sampled_from([".png", ".jpg", ".bmp", ".tif", ".webp", ".ppm", ".jp2", ".avif"]))
def test_a_header_of_noise_never_raises_anything_else(noise, extension):
    beginning = encoded(extension, BGR)[: 4 + len(noise) // 4]
    try:
        read_header(beginning + noise)
    except HeaderError:
        return


def test_a_cmyk_jpeg_is_refused():
    data = encoded(".jpg", BGR)
    frame = data.index(b"\xff\xc0")
    length = int.from_bytes(data[frame + 2 : frame + 4], "big")
    segment = bytearray(data[frame : frame + 2 + length] + b"\x04\x11\x01")
    segment[2:4], segment[9] = (length + 3).to_bytes(2, "big"), 4
    with pytest.raises(FrameUnusable, match="CMYK"):
        decode_picture(data[:frame] + bytes(segment) + data[frame + 2 + length :], "print.jpg")


def test_16_bit_samples_give_their_upper_byte():
    deep = GREY.astype(np.uint16) * 257
    np.testing.assert_array_equal(decode_picture(encoded(".png", deep), "deep"), GREY)
    np.testing.assert_array_equal(decode_picture(encoded(".tif", cv2.merge([deep] * 3)), "deep")[:, :, 1], GREY)


@pytest.mark.parametrize("bits", [10, 12, 14])
def test_unshifted_sensor_samples_in_16_bits_are_read_by_the_bits_they_use(bits):
    deep = GREY.astype(np.uint16) << (bits - 8)
    np.testing.assert_array_equal(decode_picture(encoded(".png", deep), "deep"), GREY)


@pytest.mark.parametrize("extension", [".png", ".tif"])
def test_deep_samples_are_kept_to_their_last_bit(extension):
    deep = np.random.default_rng(3).integers(0, 1 << 16, (40, 50)).astype(np.uint16)
    np.testing.assert_array_equal(decode_samples(encoded(extension, deep), "deep"), deep)


@pytest.mark.parametrize("dtype", [np.float32, np.int16, np.float64])
def test_samples_of_other_types_are_refused(dtype):
    with pytest.raises(FrameUnusable, match=f"samples of type {np.dtype(dtype)}"):
        decode_picture(encoded(".tif", GREY.astype(dtype)), "odd")


@pytest.mark.parametrize("extension", [".hdr", ".pfm"])
def test_floating_point_formats_are_refused_by_name(extension):
    with pytest.raises(FrameUnusable, match="floating-point samples"):
        decode_picture(encoded(extension, BGR.astype(np.float32)), "odd")


def test_an_opaque_alpha_channel_is_dropped():
    alpha = np.full_like(GREY, 255)
    np.testing.assert_array_equal(decode_picture(encoded(".png", np.dstack([BGR, alpha])), "a"), BGR)
    deep = np.dstack([BGR, alpha]).astype(np.uint16) * 257
    np.testing.assert_array_equal(decode_picture(encoded(".png", deep), "a"), BGR)


def test_see_through_pixels_are_refused():
    alpha = np.full_like(GREY, 255)
    alpha[40, 40] = 254
    with pytest.raises(FrameUnusable, match=r"see-through pixels \(alpha\)"):
        decode_picture(encoded(".png", np.dstack([BGR, alpha])), "a")


def test_a_palette_becomes_its_colours_and_one_bit_becomes_black_and_white():
    palette = (b"PLTE", bytes([10, 20, 30, 200, 100, 50]))
    pixels = decode_picture(png(2, 1, 8, 3, bytes([0, 0, 1]), palette), "palette")
    assert pixels.tolist() == [[[30, 20, 10], [50, 100, 200]]]
    assert decode_picture(png(8, 1, 1, 0, bytes([0, 0b10100000])), "bits").tolist() == [[255, 0, 255, 0, 0, 0, 0, 0]]


def oriented(data, orientation):
    """The JPEG with an EXIF segment that asks viewers to turn it."""
    tiff = b"MM\0*\0\0\0\x08" + struct.pack(">H", 1) + struct.pack(">HHIHH", 0x0112, 3, 1, orientation, 0) + bytes(4)
    exif = b"Exif\0\0" + tiff
    return data[:2] + b"\xff\xe1" + struct.pack(">H", len(exif) + 2) + exif + data[2:]


def test_an_exif_orientation_is_ignored_as_the_calibration_holds_for_the_sensors_rows():
    plain = encoded(".jpg", GREY)
    turned = oriented(plain, 6)
    assert cv2.imdecode(np.frombuffer(turned, np.uint8), cv2.IMREAD_COLOR).shape[:2] == (WIDTH, HEIGHT)
    np.testing.assert_array_equal(decode_picture(turned, "turned"), decode_picture(plain, "plain"))


def test_a_missing_file_a_folder_and_a_pipe_are_refused_by_name(tmp_path):
    with pytest.raises(FrameUnusable, match=r"gone\.png: cannot be read \(No such file"):
        read_picture(tmp_path / "gone.png")
    with pytest.raises(FrameUnusable, match="a folder"):
        read_picture(tmp_path)
    os.mkfifo(tmp_path / "pipe.png")
    with pytest.raises(FrameUnusable, match="no regular file"):
        read_picture(tmp_path / "pipe.png")
    with pytest.raises(FrameUnusable, match="cannot be read"):
        read_picture("nul\0byte.png")


def test_a_file_beyond_any_pictures_size_is_not_read(tmp_path):
    with open(tmp_path / "sparse.png", "wb") as file:
        file.truncate(2_000_000_000)
    with pytest.raises(FrameUnusable, match="2000000000 bytes"):
        read_picture(tmp_path / "sparse.png")


def test_a_damaged_file_leaves_nothing_of_opencvs_log_on_standard_error(tmp_path, capfd):
    (tmp_path / "cut.bmp").write_bytes(encoded(".bmp", GREY)[:3000])
    with pytest.raises(FrameUnusable, match=r"cut\.bmp"):
        read_picture(tmp_path / "cut.bmp")
    assert capfd.readouterr().err == ""
