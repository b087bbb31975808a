from __future__ import annotations

import numpy as np
import pytest

from drivers.camera import FrameUnusable
from drivers.camera.simulated import SimulatedCamera


def test_pictures_are_made_by_their_sequence_number():
    camera = SimulatedCamera(lambda sequence: np.full((4, 4), sequence, np.uint8))
    camera.open()
    frames = [camera.grab(0.0, 1.0) for _ in range(3)]
    assert [int(frame.pixels[0, 0]) for frame in frames] == [1, 2, 3]
    assert [frame.sequence for frame in frames] == [1, 2, 3]
    assert all(frame.simulated for frame in frames)


def test_what_the_function_raises_comes_through_and_costs_no_number():
    faults = [FrameUnusable("torn frame")]

    def make(sequence):
        if faults:
            raise faults.pop()
        return np.full((4, 4), sequence, np.uint8)

    camera = SimulatedCamera(make)
    camera.open()
    with pytest.raises(FrameUnusable, match="torn frame"):
        camera.grab(0.0, 1.0)
    assert camera.grab(0.0, 1.0).sequence == 1
