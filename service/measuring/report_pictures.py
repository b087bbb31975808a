"""Pictures of reports, as SVG: residual arrows, coverage, maps in millimetres, the work frame."""

from __future__ import annotations

import base64
import html
from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from contour.calibration.calibration import CameraCalibration
from contour.camera_calibration.coverage_zones import COLUMNS, ROWS, Zones
from contour.geometry.arrays import Float64s

WIDTH = 640
"""Width of a picture in the report's own units; its height follows the camera's."""

EMBEDDED_WIDTH = 1280

ARROW_SHARE = 0.05
"""The longest typical residual (99 %) is drawn as this share of the picture's width."""


def residual_arrows(pixels: Sequence[Float64s], misses: Sequence[Float64s], size: tuple[int, int]) -> str:
    """Every corner's residual as an arrow, enlarged; the scale is written below."""
    places, rest = np.concatenate(pixels), np.concatenate(misses)
    usual = float(np.percentile(np.hypot(*rest.T), 99))
    grow = ARROW_SHARE * size[0] / max(usual, 1e-9)
    k = WIDTH / size[0]
    lines = []
    for (x, y), (dx, dy) in zip(places * k, rest * grow * k, strict=True):
        lines.append(f'<path d="M{x:.1f} {y:.1f}l{dx:.1f} {dy:.1f}"/><circle cx="{x:.1f}" cy="{y:.1f}" r="1.2"/>')
    body = f'<g class="arrow">{"".join(lines)}</g>'
    return _svg(
        size, body, f"Residuals: an arrow of {ARROW_SHARE * WIDTH:.0f} units is {usual:.3f} px ({grow:.0f} times)"
    )


def coverage(zones: Zones, size: tuple[int, int]) -> str:
    """Zones by the corners seen in them; those never seen are hatched."""
    height = WIDTH * size[1] / size[0]
    wide, high = WIDTH / COLUMNS, height / ROWS
    most = max(int(zones.counts.max()), 1)
    cells = []
    for (row, column), count in np.ndenumerate(zones.counts):
        place = f'x="{column * wide:.1f}" y="{row * high:.1f}" width="{wide:.1f}" height="{high:.1f}"'
        if count == 0:
            cells.append(f'<rect {place} class="never"/>')
        else:
            cells.append(f'<rect {place} fill="{_blue(0.15 + 0.75 * count / most)}"/>')
            cells.append(
                _text((column + 0.5) * wide, (row + 0.5) * high + 4, str(int(count)), dark=bool(count / most > 0.5))
            )
    ring = " ".join(f"{x * WIDTH / size[0]:.1f},{y * WIDTH / size[0]:.1f}" for x, y in zones.hull_px)
    body = f'{"".join(cells)}<polygon points="{ring}" class="hull"/>'
    never = int((zones.counts == 0).sum())
    return _svg(size, body, f"Corners seen in each zone; hatched: none ({never} of {zones.counts.size} zones)")


def millimetre_map(values: Float64s, zones: Zones, size: tuple[int, int], title: str) -> str:
    """A map over the picture, shape (rows, columns), mm, every second value written; the covered part is outlined."""
    height = WIDTH * size[1] / size[0]
    rows, columns = values.shape
    wide, high = WIDTH / (columns - 1), height / (rows - 1)
    top = max(float(values.max()), 1e-9)
    cells = []
    for (row, column), value in np.ndenumerate(values):
        x, y = (column - 0.5) * wide, (row - 0.5) * high
        cells.append(
            f'<rect x="{x:.1f}" y="{y:.1f}" width="{wide + 0.5:.1f}" height="{high + 0.5:.1f}" '
            f'fill="{_blue(0.05 + 0.85 * value / top)}"/>'
        )
    for (row, column), value in np.ndenumerate(values):
        if row % 2 and column % 2:
            cells.append(_text(column * wide, row * high + 4, f"{value:.3f}", dark=bool(value / top > 0.5)))
    ring = " ".join(f"{x * WIDTH / size[0]:.1f},{y * WIDTH / size[0]:.1f}" for x, y in zones.hull_px)
    return _svg(size, f'{"".join(cells)}<polygon points="{ring}" class="hull"/>', title)


def work_frame(
    picture: NDArray[np.uint8], calibration: CameraCalibration, reach_mm: float, corners_px: Float64s
) -> str:
    """The plane view with the work frame's axes drawn into it, and the corners that were found."""
    height, width = picture.shape[:2]
    k = WIDTH / width
    ends = np.array([[0.0, 0.0], [reach_mm, 0.0], [0.0, reach_mm]])
    (ox, oy), (ax, ay), (bx, by) = (_drawn(calibration, ends) * k).tolist()
    marks = "".join(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2"/>' for x, y in corners_px * k)
    body = (
        f'<image href="{embedded(picture)}" width="{WIDTH}" height="{WIDTH * height / width:.1f}"/>'
        f'<g class="seen">{marks}</g>'
        f'<path class="x" d="M{ox:.1f} {oy:.1f}L{ax:.1f} {ay:.1f}"/>'
        f'<path class="y" d="M{ox:.1f} {oy:.1f}L{bx:.1f} {by:.1f}"/>'
        f'<circle class="origin" cx="{ox:.1f}" cy="{oy:.1f}" r="5"/>'
        f"{_label(ax, ay, 'x')}{_label(bx, by, 'y')}{_label(ox, oy + 18, '0')}"
    )
    return _svg((width, height), body, "The plane view: origin, x and y axis of the work frame, and the corners found")


def embedded(picture: NDArray[np.uint8]) -> str:
    """The picture as a data URL of a JPEG, at most EMBEDDED_WIDTH wide: a report is one file."""
    factor = min(1.0, EMBEDDED_WIDTH / picture.shape[1])
    small = cv2.resize(picture, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)
    _, data = cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, 80])
    return f"data:image/jpeg;base64,{base64.b64encode(data.tobytes()).decode()}"


def _drawn(calibration: CameraCalibration, work_mm: Float64s) -> Float64s:
    return calibration.to_pixels(calibration.to_machine(work_mm), 0.0)


def _svg(size: tuple[int, int], body: str, title: str) -> str:
    height = WIDTH * size[1] / size[0]
    return (
        f'<figure><svg viewBox="0 0 {WIDTH} {height:.0f}" role="img" aria-label="{html.escape(title)}">'
        f'<rect class="frame" width="{WIDTH}" height="{height:.0f}"/>{body}</svg>'
        f"<figcaption>{html.escape(title)}</figcaption></figure>"
    )


def _blue(share: float) -> str:
    """From nearly white to dark blue, for 0 to 1."""
    low, high = np.array([240, 246, 252]), np.array([8, 48, 107])
    red, green, blue = (low + (high - low) * np.clip(share, 0, 1)).astype(int).tolist()
    return f"rgb({red},{green},{blue})"


def _text(x: float, y: float, text: str, *, dark: bool) -> str:
    colour = "#fff" if dark else "#222"
    return f'<text x="{x:.1f}" y="{y:.1f}" fill="{colour}" class="value">{text}</text>'


def _label(x: float, y: float, text: str) -> str:
    return f'<text x="{x + 8:.1f}" y="{y - 6:.1f}" class="axis">{text}</text>'
