"""Video4Linux2 as the kernel lays it out: ioctl numbers and structures of <linux/videodev2.h>, for 64-bit Linux.

Sizes and offsets are those of the LP64 machines (x86-64, AArch64), whose ioctl encoding is the same; a test compiles
the kernel's own header for both and compares. Names are the header's without their prefix.
"""

from __future__ import annotations

import ctypes
from ctypes import Structure, Union, c_char, c_int32, c_int64, c_long, c_uint8, c_uint16, c_uint32, c_ulong

WRITE, READ = 1, 2


def _request(direction: int, number: int, size: int) -> int:
    """The ioctl number: direction, size of its argument, type 'V', number; asm-generic/ioctl.h."""
    return direction << 30 | size << 16 | ord("V") << 8 | number


class Capability(Structure):
    """What the device is: struct v4l2_capability."""

    _fields_ = [
        ("driver", c_char * 16),
        ("card", c_char * 32),
        ("bus_info", c_char * 32),
        ("version", c_uint32),
        ("capabilities", c_uint32),
        ("device_caps", c_uint32),
        ("reserved", c_uint32 * 3),
    ]


class FormatDescription(Structure):
    """One pixel format that the device offers: struct v4l2_fmtdesc."""

    _fields_ = [
        ("index", c_uint32),
        ("type", c_uint32),
        ("flags", c_uint32),
        ("description", c_char * 32),
        ("pixelformat", c_uint32),
        ("mbus_code", c_uint32),
        ("reserved", c_uint32 * 3),
    ]


class PixFormat(Structure):
    """Size and layout of a picture in one plane: struct v4l2_pix_format."""

    _fields_ = [
        ("width", c_uint32),
        ("height", c_uint32),
        ("pixelformat", c_uint32),
        ("field", c_uint32),
        ("bytesperline", c_uint32),
        ("sizeimage", c_uint32),
        ("colorspace", c_uint32),
        ("priv", c_uint32),
        ("flags", c_uint32),
        ("ycbcr_enc", c_uint32),
        ("quantization", c_uint32),
        ("xfer_func", c_uint32),
    ]


class _FormatUnion(Union):
    # v4l2_window holds pointers, so the kernel's union is aligned as a long.
    _fields_ = [("pix", PixFormat), ("raw_data", c_uint8 * 200), ("align", c_ulong)]


class Format(Structure):
    """struct v4l2_format."""

    _fields_ = [("type", c_uint32), ("fmt", _FormatUnion)]


class Fraction(Structure):
    """struct v4l2_fract."""

    _fields_ = [("numerator", c_uint32), ("denominator", c_uint32)]


class CaptureParameters(Structure):
    """struct v4l2_captureparm."""

    _fields_ = [
        ("capability", c_uint32),
        ("capturemode", c_uint32),
        ("timeperframe", Fraction),
        ("extendedmode", c_uint32),
        ("readbuffers", c_uint32),
        ("reserved", c_uint32 * 4),
    ]


class _ParametersUnion(Union):
    _fields_ = [("capture", CaptureParameters), ("raw_data", c_uint8 * 200)]


class StreamParameters(Structure):
    """struct v4l2_streamparm."""

    _fields_ = [("type", c_uint32), ("parm", _ParametersUnion)]


class RequestBuffers(Structure):
    """struct v4l2_requestbuffers."""

    _fields_ = [
        ("count", c_uint32),
        ("type", c_uint32),
        ("memory", c_uint32),
        ("capabilities", c_uint32),
        ("flags", c_uint8),
        ("reserved", c_uint8 * 3),
    ]


class TimeVal(Structure):
    """struct timeval."""

    _fields_ = [("tv_sec", c_long), ("tv_usec", c_long)]


class TimeCode(Structure):
    """struct v4l2_timecode."""

    _fields_ = [
        ("type", c_uint32),
        ("flags", c_uint32),
        ("frames", c_uint8),
        ("seconds", c_uint8),
        ("minutes", c_uint8),
        ("hours", c_uint8),
        ("userbits", c_uint8 * 4),
    ]


class _MemoryUnion(Union):
    _fields_ = [("offset", c_uint32), ("userptr", c_ulong), ("planes", c_ulong), ("fd", c_int32)]


class Buffer(Structure):
    """One buffer of a stream: struct v4l2_buffer."""

    _fields_ = [
        ("index", c_uint32),
        ("type", c_uint32),
        ("bytesused", c_uint32),
        ("flags", c_uint32),
        ("field", c_uint32),
        ("timestamp", TimeVal),
        ("timecode", TimeCode),
        ("sequence", c_uint32),
        ("memory", c_uint32),
        ("m", _MemoryUnion),
        ("length", c_uint32),
        ("reserved2", c_uint32),
        ("request_fd", c_int32),
    ]


class Control(Structure):
    """struct v4l2_control."""

    _fields_ = [("id", c_uint32), ("value", c_int32)]


class QueryExtControl(Structure):
    """A control's name, kind and range: struct v4l2_query_ext_ctrl."""

    _fields_ = [
        ("id", c_uint32),
        ("type", c_uint32),
        ("name", c_char * 32),
        ("minimum", c_int64),
        ("maximum", c_int64),
        ("step", ctypes.c_uint64),
        ("default_value", c_int64),
        ("flags", c_uint32),
        ("elem_size", c_uint32),
        ("elems", c_uint32),
        ("nr_of_dims", c_uint32),
        ("dims", c_uint32 * 4),
        ("reserved", c_uint32 * 32),
    ]


class _MenuUnion(Union):
    _pack_ = 1
    _fields_ = [("name", c_uint8 * 32), ("value", c_int64)]


class QueryMenu(Structure):
    """One entry of a menu control: struct v4l2_querymenu."""

    _pack_ = 1
    _fields_ = [("id", c_uint32), ("index", c_uint32), ("u", _MenuUnion), ("reserved", c_uint32)]


class _SizeDiscrete(Structure):
    _fields_ = [("width", c_uint32), ("height", c_uint32)]


class _SizeStepwise(Structure):
    _fields_ = [
        ("min_width", c_uint32),
        ("max_width", c_uint32),
        ("step_width", c_uint32),
        ("min_height", c_uint32),
        ("max_height", c_uint32),
        ("step_height", c_uint32),
    ]


class _SizeUnion(Union):
    _fields_ = [("discrete", _SizeDiscrete), ("stepwise", _SizeStepwise)]


class FrameSize(Structure):
    """One size, or range of sizes, of a pixel format: struct v4l2_frmsizeenum."""

    _fields_ = [
        ("index", c_uint32),
        ("pixel_format", c_uint32),
        ("type", c_uint32),
        ("u", _SizeUnion),
        ("reserved", c_uint32 * 2),
    ]


class _IntervalStepwise(Structure):
    _fields_ = [("min", Fraction), ("max", Fraction), ("step", Fraction)]


class _IntervalUnion(Union):
    _fields_ = [("discrete", Fraction), ("stepwise", _IntervalStepwise)]


class FrameInterval(Structure):
    """One frame interval, or range of them: struct v4l2_frmivalenum."""

    _fields_ = [
        ("index", c_uint32),
        ("pixel_format", c_uint32),
        ("width", c_uint32),
        ("height", c_uint32),
        ("type", c_uint32),
        ("u", _IntervalUnion),
        ("reserved", c_uint32 * 2),
    ]


class Input(Structure):
    """One of the device's inputs: struct v4l2_input."""

    _fields_ = [
        ("index", c_uint32),
        ("name", c_uint8 * 32),
        ("type", c_uint32),
        ("audioset", c_uint32),
        ("tuner", c_uint32),
        ("std", ctypes.c_uint64),
        ("status", c_uint32),
        ("capabilities", c_uint32),
        ("reserved", c_uint32 * 3),
    ]


class DvTimings(Structure):
    """Timings of a digital video signal, handed back as they were read: struct v4l2_dv_timings."""

    _pack_ = 1
    _fields_ = [("type", c_uint32), ("raw", c_uint16 * 64)]


QUERYCAP = _request(READ, 0, ctypes.sizeof(Capability))
ENUM_FMT = _request(READ | WRITE, 2, ctypes.sizeof(FormatDescription))
G_FMT = _request(READ | WRITE, 4, ctypes.sizeof(Format))
S_FMT = _request(READ | WRITE, 5, ctypes.sizeof(Format))
REQBUFS = _request(READ | WRITE, 8, ctypes.sizeof(RequestBuffers))
QUERYBUF = _request(READ | WRITE, 9, ctypes.sizeof(Buffer))
QBUF = _request(READ | WRITE, 15, ctypes.sizeof(Buffer))
DQBUF = _request(READ | WRITE, 17, ctypes.sizeof(Buffer))
STREAMON = _request(WRITE, 18, 4)
STREAMOFF = _request(WRITE, 19, 4)
G_PARM = _request(READ | WRITE, 21, ctypes.sizeof(StreamParameters))
S_PARM = _request(READ | WRITE, 22, ctypes.sizeof(StreamParameters))
ENUMINPUT = _request(READ | WRITE, 26, ctypes.sizeof(Input))
G_CTRL = _request(READ | WRITE, 27, ctypes.sizeof(Control))
S_CTRL = _request(READ | WRITE, 28, ctypes.sizeof(Control))
QUERYMENU = _request(READ | WRITE, 37, ctypes.sizeof(QueryMenu))
G_INPUT = _request(READ, 38, 4)
S_INPUT = _request(READ | WRITE, 39, 4)
ENUM_FRAMESIZES = _request(READ | WRITE, 74, ctypes.sizeof(FrameSize))
ENUM_FRAMEINTERVALS = _request(READ | WRITE, 75, ctypes.sizeof(FrameInterval))
S_DV_TIMINGS = _request(READ | WRITE, 87, ctypes.sizeof(DvTimings))
QUERY_DV_TIMINGS = _request(READ, 99, ctypes.sizeof(DvTimings))
QUERY_EXT_CTRL = _request(READ | WRITE, 103, ctypes.sizeof(QueryExtControl))

BUF_TYPE_VIDEO_CAPTURE = 1
MEMORY_MMAP = 1
FIELD_NONE = 1
CAP_VIDEO_CAPTURE = 0x0000_0001
CAP_STREAMING = 0x0400_0000
CAP_DEVICE_CAPS = 0x8000_0000
CAP_TIMEPERFRAME = 0x1000
INPUT_CAPABILITY_DV_TIMINGS = 0x2
SIZE_DISCRETE = 1
INTERVAL_DISCRETE = 1

BUFFER_ERROR = 0x0040
TIMESTAMP_MASK = 0xE000
TIMESTAMP_MONOTONIC = 0x2000
TIMESTAMP_SOURCE_MASK = 0x7_0000
TIMESTAMP_START_OF_EXPOSURE = 0x1_0000

CONTROL_INTEGER, CONTROL_BOOLEAN, CONTROL_MENU, CONTROL_BUTTON, CONTROL_INTEGER64 = 1, 2, 3, 4, 5
CONTROL_CLASS, CONTROL_STRING, CONTROL_BITMASK, CONTROL_INTEGER_MENU = 6, 7, 8, 9
FLAG_DISABLED, FLAG_READ_ONLY, FLAG_INACTIVE, FLAG_WRITE_ONLY = 0x1, 0x4, 0x10, 0x40
FLAG_VOLATILE, FLAG_HAS_PAYLOAD = 0x80, 0x100
FLAG_NEXT_CONTROL = 0x8000_0000
CID_EXPOSURE_ABSOLUTE = 0x009A_0902  # in units of 100 µs


def fourcc(code: str) -> int:
    """The number of a four-character code; shorter ones are filled with blanks, as the kernel's are."""
    return int.from_bytes(code.encode("ascii").ljust(4), "little")


def fourcc_text(number: int) -> str:
    """The four-character code of a number, without the blanks that fill it; "-BE" marks a big-endian one."""
    text = (number & 0x7FFF_FFFF).to_bytes(4, "little").decode("ascii", "replace").rstrip()
    return text + ("-BE" if number & 0x8000_0000 else "")
