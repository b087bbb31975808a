"""Areas of things as shares of pixels."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from contour.geometry.arrays import Float32s
from contour.geometry.rings import Contour
from contour.synthetic.coverage import area_coverage
from contour.synthetic.scene import Scene


def share_of(scene: Scene, area: Contour, z_mm: float) -> Float32s:
    """Share of each pixel that the area covers at this height, shape (H, W), float32."""
    camera = scene.camera
    rings = camera.project_contour(area, z_mm, 8.0 * px_mm(scene)).rings
    return area_coverage(rings, camera.width, camera.height)


def share_of_any(scene: Scene, areas: Sequence[Contour], z_mm: float) -> Float32s:
    """Share of each pixel that one of the areas covers at this height, shape (H, W), float32."""
    share = np.zeros((scene.camera.height, scene.camera.width), dtype=np.float32)
    for area in areas:
        np.maximum(share, share_of(scene, area, z_mm), out=share)
    return share


def px_mm(scene: Scene) -> float:
    """Millimetres per pixel at the block's top."""
    x, y = scene.outline.exterior.mean(axis=0).tolist()
    return scene.camera.mm_per_px((x, y), scene.thickness_mm)


def pixel_of(scene: Scene, place: tuple[float, float]) -> tuple[float, float]:
    """Where a place at the block's top is seen."""
    x, y = scene.camera.project(np.array([place]), scene.thickness_mm)[0].tolist()
    return (x, y)


def image_angle(scene: Scene, place: Sequence[float], angle_deg: float) -> float:
    """The direction in the picture, radians, of one in the work frame at a place of the block's top."""
    angle = np.radians(angle_deg)
    ends = np.array([place, (place[0] + np.cos(angle), place[1] + np.sin(angle))])
    (ax, ay), (bx, by) = scene.camera.project(ends, scene.thickness_mm)
    return float(np.arctan2(by - ay, bx - ax))


def depth_in(share: Float32s) -> Float32s:
    """Distance of each pixel to the rim of an area, 0 outside, pixels, float32."""
    return np.asarray(cv2.distanceTransform((share > 0.5).astype(np.uint8), cv2.DIST_L2, 5), dtype=np.float32)
