"""Our structures against the kernel's own header, compiled here and, without being run, for 64-bit Arm."""

from __future__ import annotations

import ctypes
import subprocess

import pytest

from drivers.camera.v4l2 import kernel_interface as v4l2
from tests.support.real_parts import missing, need_program

STRUCTURES = {
    v4l2.Capability: "v4l2_capability",
    v4l2.FormatDescription: "v4l2_fmtdesc",
    v4l2.PixFormat: "v4l2_pix_format",
    v4l2.Format: "v4l2_format",
    v4l2.Fraction: "v4l2_fract",
    v4l2.CaptureParameters: "v4l2_captureparm",
    v4l2.StreamParameters: "v4l2_streamparm",
    v4l2.RequestBuffers: "v4l2_requestbuffers",
    v4l2.Buffer: "v4l2_buffer",
    v4l2.Control: "v4l2_control",
    v4l2.QueryExtControl: "v4l2_query_ext_ctrl",
    v4l2.QueryMenu: "v4l2_querymenu",
    v4l2.FrameSize: "v4l2_frmsizeenum",
    v4l2.FrameInterval: "v4l2_frmivalenum",
    v4l2.Input: "v4l2_input",
    v4l2.DvTimings: "v4l2_dv_timings",
}
# Members that have no name in the header, or lie in its unnamed unions.
UNNAMED = {"raw", "u", "raw_data", "align"}
REQUESTS = {
    name: f"VIDIOC_{name}"
    for name in (
        *("QUERYCAP", "ENUM_FMT", "G_FMT", "S_FMT", "REQBUFS", "QUERYBUF", "QBUF", "DQBUF", "STREAMON", "STREAMOFF"),
        *("G_PARM", "S_PARM", "ENUMINPUT", "G_CTRL", "S_CTRL", "QUERYMENU", "G_INPUT", "S_INPUT", "ENUM_FRAMESIZES"),
        *("ENUM_FRAMEINTERVALS", "S_DV_TIMINGS", "QUERY_DV_TIMINGS", "QUERY_EXT_CTRL"),
    )
}
CONSTANTS = {
    "BUFFER_ERROR": "V4L2_BUF_FLAG_ERROR",
    "TIMESTAMP_MASK": "V4L2_BUF_FLAG_TIMESTAMP_MASK",
    "TIMESTAMP_MONOTONIC": "V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC",
    "TIMESTAMP_SOURCE_MASK": "V4L2_BUF_FLAG_TSTAMP_SRC_MASK",
    "TIMESTAMP_START_OF_EXPOSURE": "V4L2_BUF_FLAG_TSTAMP_SRC_SOE",
    "CAP_VIDEO_CAPTURE": "V4L2_CAP_VIDEO_CAPTURE",
    "CAP_STREAMING": "V4L2_CAP_STREAMING",
    "CAP_DEVICE_CAPS": "V4L2_CAP_DEVICE_CAPS",
    "CAP_TIMEPERFRAME": "V4L2_CAP_TIMEPERFRAME",
    "INPUT_CAPABILITY_DV_TIMINGS": "V4L2_IN_CAP_DV_TIMINGS",
    "CID_EXPOSURE_ABSOLUTE": "V4L2_CID_EXPOSURE_ABSOLUTE",
    "FLAG_NEXT_CONTROL": "V4L2_CTRL_FLAG_NEXT_CTRL",
    "FLAG_INACTIVE": "V4L2_CTRL_FLAG_INACTIVE",
    "FLAG_READ_ONLY": "V4L2_CTRL_FLAG_READ_ONLY",
    "FLAG_WRITE_ONLY": "V4L2_CTRL_FLAG_WRITE_ONLY",
    "FLAG_VOLATILE": "V4L2_CTRL_FLAG_VOLATILE",
    "FLAG_DISABLED": "V4L2_CTRL_FLAG_DISABLED",
    "FLAG_HAS_PAYLOAD": "V4L2_CTRL_FLAG_HAS_PAYLOAD",
    "CONTROL_INTEGER_MENU": "V4L2_CTRL_TYPE_INTEGER_MENU",
    "CONTROL_BITMASK": "V4L2_CTRL_TYPE_BITMASK",
}


def assertions():
    """A C file that compiles only where the header agrees with our numbers."""
    lines = ["#include <stddef.h>", "#include <linux/videodev2.h>"]

    def same(expression, value):
        lines.append(f'_Static_assert({expression} == {value}UL, "{expression}");')

    for structure, name in STRUCTURES.items():
        same(f"sizeof(struct {name})", ctypes.sizeof(structure))
        for field in structure._fields_:
            if field[0] not in UNNAMED:
                same(f"offsetof(struct {name}, {field[0]})", getattr(structure, field[0]).offset)
    same("offsetof(struct v4l2_format, fmt)", v4l2.Format.fmt.offset)
    same("offsetof(struct v4l2_streamparm, parm)", v4l2.StreamParameters.parm.offset)
    same("offsetof(struct v4l2_querymenu, name)", v4l2.QueryMenu.u.offset)
    same("offsetof(struct v4l2_frmsizeenum, discrete)", v4l2.FrameSize.u.offset)
    same("offsetof(struct v4l2_frmivalenum, discrete)", v4l2.FrameInterval.u.offset)
    same("offsetof(struct v4l2_buffer, m.offset)", v4l2.Buffer.m.offset)
    for ours, theirs in (REQUESTS | CONSTANTS).items():
        same(theirs, getattr(v4l2, ours))
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(
    ("compiler", "install"),
    [
        ("gcc", "apt-get install gcc libc6-dev linux-libc-dev"),
        ("aarch64-linux-gnu-gcc", "apt-get install gcc-aarch64-linux-gnu libc6-dev-arm64-cross"),
    ],
)
def test_structures_and_numbers_are_those_of_the_kernels_header(compiler, install, tmp_path):
    compiler = need_program(compiler, install)
    source = tmp_path / "layout.c"
    source.write_text(assertions())
    done = subprocess.run([compiler, "-fsyntax-only", str(source)], capture_output=True, text=True, check=False)
    if "videodev2.h: No such file" in done.stderr:
        missing(f"the kernel's headers are not here. Install them: {install}")
    assert done.returncode == 0, done.stderr


def test_a_wrong_number_would_not_compile(tmp_path):
    compiler = need_program("gcc", "apt-get install gcc libc6-dev linux-libc-dev")
    source = tmp_path / "layout.c"
    source.write_text(assertions().replace("sizeof(struct v4l2_buffer) == 88UL", "sizeof(struct v4l2_buffer) == 84UL"))
    done = subprocess.run([compiler, "-fsyntax-only", str(source)], capture_output=True, text=True, check=False)
    assert "static assertion failed" in done.stderr


@pytest.mark.parametrize("code", ["YUYV", "GREY", "Y16", "NV12"])
def test_a_four_character_code_survives_its_number(code):
    assert v4l2.fourcc_text(v4l2.fourcc(code)) == code
