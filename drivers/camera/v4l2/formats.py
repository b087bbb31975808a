"""Picture formats and frame rates: what the device offers, and the one asked for or none."""

from __future__ import annotations

from dataclasses import dataclass

from drivers.camera import CameraRefused
from drivers.camera.v4l2 import kernel_interface as v4l2
from drivers.camera.v4l2.device import Device, enumerated
from drivers.camera.v4l2.pixels import LAYOUTS, PictureFormat

RATE_TOLERANCE = 0.01  # drivers round 29.97 to 30


@dataclass(frozen=True)
class SizeInfo:
    """A size, or a range of sizes, that a format comes in, px, and its frame rates (highest first) where listed."""

    width: int
    height: int
    largest: tuple[int, int] | None
    rates: tuple[float, ...]

    def text(self) -> str:
        """As people write it: "1280 x 720", or "16 x 16 to 3840 x 2160"."""
        size = f"{self.width} x {self.height}"
        return size if self.largest is None else f"{size} to {self.largest[0]} x {self.largest[1]}"


@dataclass(frozen=True)
class FormatInfo:
    """A pixel format that the device offers; usable: this driver can read it."""

    code: str
    description: str
    sizes: tuple[SizeInfo, ...]

    @property
    def usable(self) -> bool:
        """True where frames of this format can be turned into pixels here."""
        return self.code in LAYOUTS


def list_formats(device: Device) -> list[FormatInfo]:
    """The pixel formats that the device offers on its present input."""

    def describe(index: int) -> v4l2.FormatDescription:
        return v4l2.FormatDescription(index=index, type=v4l2.BUF_TYPE_VIDEO_CAPTURE)

    return [
        FormatInfo(
            v4l2.fourcc_text(entry.pixelformat),
            entry.description.decode("utf-8", "replace"),
            tuple(_sizes(device, entry.pixelformat)),
        )
        for entry in enumerated(device, v4l2.ENUM_FMT, describe)
    ]


def set_format(device: Device, width: int, height: int, code: str) -> PictureFormat:
    """The format, set as asked; raise CameraRefused, listing what there is, where the driver would change it."""
    if code not in LAYOUTS:
        known = ", ".join(LAYOUTS)
        raise CameraRefused(f"{device.path}: pixel format {code} cannot be read here; expected one of {known}.")
    request = v4l2.Format(type=v4l2.BUF_TYPE_VIDEO_CAPTURE)
    pix = request.fmt.pix
    pix.width, pix.height, pix.pixelformat, pix.field = width, height, v4l2.fourcc(code), v4l2.FIELD_NONE
    device.call(v4l2.S_FMT, request, f"set {width} x {height} {code}")
    given = (pix.width, pix.height, v4l2.fourcc_text(pix.pixelformat))
    if given != (width, height, code):
        raise CameraRefused(
            f"{device.path}: asked for {width} x {height} {code}, the driver gives {given[0]} x {given[1]} {given[2]}; "
            f"expected what was asked. There is: {offered(device, code)}. Correct camera.width, height, pixel_format."
        )
    if pix.field != v4l2.FIELD_NONE:
        raise CameraRefused(
            f"{device.path}: {width} x {height} {code} comes interlaced (field order {pix.field}); expected whole "
            "frames, as half frames of two instants tear edges. Choose another size or rate."
        )
    return PictureFormat(code, width, height, pix.bytesperline)


def set_frame_rate(device: Device, frame_rate: float | None, code: str) -> float | None:
    """The frame period, seconds, None where the driver does not tell; raise CameraRefused for a rate it changes."""
    request = v4l2.StreamParameters(type=v4l2.BUF_TYPE_VIDEO_CAPTURE)
    known = device.answers(v4l2.G_PARM, request)
    capture = request.parm.capture
    if frame_rate is not None:
        if not known or not capture.capability & v4l2.CAP_TIMEPERFRAME:
            raise CameraRefused(f"{device.path}: its frame rate cannot be set. Take out camera.frame_rate.")
        capture.timeperframe = v4l2.Fraction(1000, round(frame_rate * 1000))
        device.call(v4l2.S_PARM, request, f"set {frame_rate:g} frames a second")
    period = capture.timeperframe
    if not known or not period.numerator or not period.denominator:
        return None
    period_s = float(period.numerator) / float(period.denominator)
    if frame_rate is not None and abs(period_s * frame_rate - 1) > RATE_TOLERANCE:
        raise CameraRefused(
            f"{device.path}: asked for {frame_rate:g} frames a second, the driver gives {1 / period_s:.4g}; expected "
            f"what was asked. There is: {offered(device, code)}. Correct camera.frame_rate."
        )
    return period_s


def offered(device: Device, code: str) -> str:
    """What the device offers, in one line for an error: the sizes and rates of a format, or which formats there are."""
    usable = {entry.code: entry for entry in list_formats(device) if entry.usable}
    if code in usable:
        return f"{code} in " + ", ".join(_size_text(size) for size in usable[code].sizes)
    return ", ".join(usable) or "no format that can be read here"


def _size_text(size: SizeInfo) -> str:
    rates = "/".join(f"{rate:.4g}" for rate in size.rates)
    return size.text() + (f" at {rates}" if rates else "")


def _sizes(device: Device, pixel_format: int) -> list[SizeInfo]:
    found = []

    def size(index: int) -> v4l2.FrameSize:
        return v4l2.FrameSize(index=index, pixel_format=pixel_format)

    for entry in enumerated(device, v4l2.ENUM_FRAMESIZES, size):
        if entry.type == v4l2.SIZE_DISCRETE:
            width, height = entry.u.discrete.width, entry.u.discrete.height
            found.append(SizeInfo(width, height, None, _rates(device, pixel_format, width, height)))
        else:
            range_ = entry.u.stepwise
            largest = (range_.max_width, range_.max_height)
            rates = _rates(device, pixel_format, *largest)
            found.append(SizeInfo(range_.min_width, range_.min_height, largest, rates))
            break  # a range is one entry; some drivers repeat it for ever
    return found


def _rates(device: Device, pixel_format: int, width: int, height: int) -> tuple[float, ...]:
    rates: list[float] = []

    def interval(index: int) -> v4l2.FrameInterval:
        return v4l2.FrameInterval(index=index, pixel_format=pixel_format, width=width, height=height)

    for entry in enumerated(device, v4l2.ENUM_FRAMEINTERVALS, interval):
        if entry.type == v4l2.INTERVAL_DISCRETE:
            rates.append(_rate(entry.u.discrete))
        else:
            rates += [_rate(entry.u.stepwise.min), _rate(entry.u.stepwise.max)]
            break
    return tuple(sorted({rate for rate in rates if rate > 0}, reverse=True))


def _rate(interval: v4l2.Fraction) -> float:
    return float(interval.denominator) / float(interval.numerator) if interval.numerator else 0.0
