"""From light to the camera's bytes: fall-off, dust, optics, noise, quantisation, compression."""

from __future__ import annotations

import math

import cv2
import numpy as np

from contour.errors import ParameterError
from contour.geometry.arrays import Bytes, Float32s
from contour.synthetic.scene import Scene, Sensor
from contour.synthetic.table import blurred, smooth_noise


def illumination(scene: Scene) -> Float32s:
    """Light that falls on each pixel's place, lens fall-off included, shape (H, W), float32."""
    camera, light = scene.camera, scene.light
    x = ((np.arange(camera.width) - (camera.width - 1) / 2.0) / camera.width).astype(np.float32)
    y = ((np.arange(camera.height) - (camera.height - 1) / 2.0) / camera.height).astype(np.float32)
    angle = math.radians(light.gradient_deg)
    slope = (
        np.float32(light.gradient * math.cos(angle)) * x[None, :]
        - np.float32(light.gradient * math.sin(angle)) * y[:, None]
    )
    corner = np.float32(2.0 * light.vignetting) * (x[None, :] ** 2 + y[:, None] ** 2)
    return np.asarray(np.float32(light.level) * np.maximum(1.0 + slope, 0.05) * (1.0 - corner), dtype=np.float32)


def dust(scene: Scene, planes: list[Float32s]) -> None:
    """Specks everywhere, bright and dark, added to each plane in place."""
    camera = scene.camera
    rng = np.random.default_rng([scene.seed, 41])
    for _ in range(scene.clutter.specks):
        x, y = rng.uniform((0.0, 0.0), (camera.width, camera.height)).tolist()
        radius, level = rng.uniform(0.4, 1.8), rng.uniform(-0.2, 0.6) * scene.material.top
        reach = math.ceil(3 * radius) + 1
        x0, x1 = max(0, int(x) - reach), min(camera.width, int(x) + reach + 1)
        y0, y1 = max(0, int(y) - reach), min(camera.height, int(y) + reach + 1)
        dx, dy = np.arange(x0, x1) - x, np.arange(y0, y1) - y
        spot = np.exp(-(((dx[None, :] ** 2 + dy[:, None] ** 2) / radius**2) ** 1.5)) * level
        for plane in planes:
            plane[y0:y1, x0:x1] += spot.astype(np.float32)


def patches(scene: Scene) -> Float32s | None:
    """Broad bright reflections on the wall tops as a factor, shape (H, W), or None."""
    if scene.light.patches <= 0.0:
        return None
    rng = np.random.default_rng([scene.seed, 42])
    shape = (scene.camera.height, scene.camera.width)
    waves = smooth_noise(rng, shape, max(shape) / 7.0)
    return np.asarray(1.0 + np.float32(scene.light.patches) * np.maximum(waves, 0.0), dtype=np.float32)


def expose(sensor: Sensor, planes: list[Float32s], seed: int) -> Bytes:
    """The camera's picture of light planes (1 = full scale): (H, W) of one, (H, W, 3) BGR of three; uint8."""
    rng = np.random.default_rng([seed, 43])
    seen = []
    for plane in planes:
        light = np.maximum(_moved(blurred(plane, sensor.blur_px), sensor.motion_px), 0.0)
        if sensor.bloom > 0.0:
            light = light + np.float32(sensor.bloom) * blurred(np.maximum(light - 1.0, 0.0), 6.0)
        if sensor.shot_noise > 0.0 or sensor.read_noise > 0.0:
            spread = np.sqrt(np.float32(sensor.shot_noise**2) * light + np.float32(sensor.read_noise**2))
            light = light + spread * rng.standard_normal(light.shape, dtype=np.float32)
        light = _read_out(sensor, light, rng)
        seen.append(np.clip(np.rint(light * np.float32(255.0)), 0.0, 255.0).astype(np.uint8))
    picture = seen[0] if len(seen) == 1 else np.ascontiguousarray(np.stack(seen, axis=-1))
    return picture if sensor.jpeg_quality <= 0 else _compressed(picture, sensor.jpeg_quality)


def _moved(light: Float32s, motion_px: tuple[float, float]) -> Float32s:
    """The light smeared along a straight way, centred."""
    length = math.hypot(*motion_px)
    if length < 0.1:
        return light
    reach = math.ceil(length / 2.0) + 1
    kernel = np.zeros((2 * reach + 1, 2 * reach + 1), dtype=np.float32)
    for share in np.linspace(-0.5, 0.5, 16 * reach):
        x, y = reach + share * motion_px[0], reach + share * motion_px[1]
        for column, part_x in ((math.floor(x), 1.0 - x % 1.0), (math.floor(x) + 1, x % 1.0)):
            for row, part_y in ((math.floor(y), 1.0 - y % 1.0), (math.floor(y) + 1, y % 1.0)):
                kernel[row, column] += part_x * part_y
    return np.asarray(cv2.filter2D(light, -1, kernel / kernel.sum()), dtype=np.float32)


def _read_out(sensor: Sensor, light: Float32s, rng: np.random.Generator) -> Float32s:
    """What a cheap sensor makes of its light: rows of their own level, pixels that are always bright, a gamma."""
    if sensor.row_noise > 0.0:
        rows = rng.standard_normal((light.shape[0], 1), dtype=np.float32)
        light = light + np.float32(sensor.row_noise) * rows
    if sensor.hot_pixels > 0.0:
        hot = rng.random(light.shape, dtype=np.float32) < sensor.hot_pixels
        light = np.where(hot, np.maximum(light, rng.uniform(0.3, 1.0, light.shape)), light).astype(np.float32)
    if sensor.gamma != 1.0:
        light = np.clip(light, 0.0, 1.0) ** np.float32(sensor.gamma)
    return light


def _compressed(picture: Bytes, quality: int) -> Bytes:
    done, data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])
    if not done:
        raise ParameterError(f"jpeg_quality {quality}: the picture could not be compressed; expected 1 to 100")
    flag = cv2.IMREAD_GRAYSCALE if picture.ndim == 2 else cv2.IMREAD_COLOR
    back = cv2.imdecode(data, flag)
    if back is None:
        raise ParameterError(f"jpeg_quality {quality}: the compressed picture could not be read back")
    return back.astype(np.uint8, copy=False)
