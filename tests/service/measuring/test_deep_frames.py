from __future__ import annotations

import cv2
import numpy as np
import pytest

from contour.errors import NoBlockFound
from contour.synthetic import truth_px
from contour.tracing.trace import TraceSettings
from contour.tracing.tracing import trace
from drivers.camera.files.decode import read_picture
from tests.support.pictures.dim import dim_samples
from tests.support.scenes.metrics import agreement
from tests.support.scenes.sample_scenes import sample_scenes

SHARE = 0.008


def test_a_dim_block_that_eight_bits_lose_is_traced_from_twelve(tmp_path):
    scene = sample_scenes()[0]
    samples = dim_samples(scene, SHARE)
    cv2.imwrite(str(tmp_path / "deep.png"), samples)
    found = trace(read_picture(tmp_path / "deep.png"), TraceSettings())
    assert agreement(found.contour, truth_px(scene)).iou > 0.98
    with pytest.raises(NoBlockFound):
        trace((samples >> 8).astype(np.uint8), TraceSettings())
