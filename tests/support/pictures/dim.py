"""A block in little light, as a sensor of 12 bits stores it: what deep samples are worth is measured on it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contour.synthetic import Scene, Sensor, render

FULL, SHOT, READ = 4095, 0.006, 0.0006  # shares of full scale; of an industrial sensor of 12 bits
DARK = Sensor(shot_noise=0.0, read_noise=0.0)


def dim_samples(scene: Scene, share: float) -> np.ndarray:
    """The scene in `share` of the light that fills the sensor: (H, W), uint16, 12 bits in the upper ones of 16."""
    light = render(replace(scene, sensor=DARK)).picture.astype(np.float64) / 255 * share
    rng = np.random.default_rng([scene.seed, 12])
    light += np.sqrt(SHOT**2 * light + READ**2) * rng.standard_normal(light.shape)
    return np.clip(np.rint(light * FULL), 0, FULL).astype(np.uint16) << np.uint16(4)
