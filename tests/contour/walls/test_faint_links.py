"""Strands of wall that hang on a block by a faint wall."""

from __future__ import annotations

import numpy as np

from contour.walls.faint_links import with_faint_links

PITCH, SMALL_PITCH = 24.0, 13.0


def block() -> np.ndarray:
    mask = np.zeros((120, 160), np.uint8)
    mask[40:100, 30:120] = 255
    return mask


def test_a_strand_that_hangs_by_a_faint_wall_is_joined_by_that_wall() -> None:
    mask = block()
    mask[24:28, 60:90] = 255
    faint = mask.copy()
    faint[28:40, 70:72] = 255
    joined = with_faint_links(mask, lambda: faint, PITCH)
    assert (joined[28:40, 70:72] == 255).all()
    assert (joined[mask > 0] == 255).all()


def test_a_chip_without_a_wall_to_the_block_stays_apart_and_so_does_one_too_far_off() -> None:
    mask = block()
    mask[24:28, 60:90] = 255
    assert (with_faint_links(mask, lambda: mask, PITCH) == mask).all()
    faint = mask.copy()
    faint[28:40, 70:72] = 255
    assert (with_faint_links(mask, lambda: faint, SMALL_PITCH) == mask).all()


def test_faint_shades_that_lead_nowhere_are_left_out() -> None:
    mask = block()
    mask[24:28, 60:90] = 255
    faint = mask.copy()
    faint[30:40, 100:102] = 255
    assert (with_faint_links(mask, lambda: faint, PITCH) == mask).all()
