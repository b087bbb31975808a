"""How wide walls between neighbouring cells look, and how far they stand out, read across each of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contour.geometry.arrays import Bytes, Float64s
from contour.image.pixel_sampling import sample_at

_REACH, _PEAK_WITHIN = 0.32, 0.1
"""Of the step from cell to cell: how far on both sides is looked, and how far from halfway the wall lies at most."""

_ALONG = (-0.14, -0.07, 0.0, 0.07, 0.14)
"""Of the step: places along the wall, half of its length, that profiles are taken at."""

_SPACING_PX = 0.25


@dataclass(frozen=True, eq=False)
class WallProfiles:
    """Of each wall, shape (N,): its width at half height, the length over which a flank as steep as there would fall
    off, both pixels, and how far it stands out, grey levels; nan where none stands out at all places along it.
    """

    width: Float64s
    flank: Float64s
    height: Float64s


def wall_profiles(light: Bytes, middle: Float64s, across: Float64s, *, step_px: float, bright: bool) -> WallProfiles:
    """Profiles of walls through `middle` (N, 2), pixels, along the unit vector `across`; step_px: from cell to cell."""
    half = int(np.ceil(_REACH * step_px / _SPACING_PX))
    offset = np.arange(-half, half + 1) * _SPACING_PX
    along = np.array([-across[1], across[0]])
    x, y = (middle[:, None, :] + np.array(_ALONG)[:, None] * step_px * along).transpose(2, 0, 1)
    profile = sample_at(light, x[:, :, None] + across[0] * offset, y[:, :, None] + across[1] * offset)
    profile *= 1.0 if bright else -1.0
    return _read(profile, max(2, round(_PEAK_WITHIN * step_px / _SPACING_PX)))


def _read(profiles: Float64s, within: int) -> WallProfiles:
    """Widths and heights of profiles (N, places along, offsets across) that peak within so many of the middle."""
    profile, rows = profiles.mean(axis=1), np.arange(len(profiles))
    last = profile.shape[1] - 1
    middle = slice(last // 2 - within, last // 2 + within + 1)
    peak_at = middle.start + np.argmax(profile[:, middle], axis=1)
    peak = profile[rows, peak_at]
    place = np.arange(last + 1)
    left, right = place < peak_at[:, None], place > peak_at[:, None]
    floor = np.maximum(
        np.where(left, profile, np.inf).min(axis=1),
        np.where(right, profile, np.inf).min(axis=1),
    )
    level = 0.5 * (peak + floor)
    below = profile < level[:, None]
    # Where three walls meet, or one runs along the step, as cells that were pulled to rectangles have it between their
    # second neighbours, no wall lies beside the middle one's peak.
    beside = np.clip(peak_at[:, None] + np.arange(-within // 3, within // 3 + 1), 0, last)
    everywhere = (profiles[rows[:, None], :, beside].max(axis=1) > level[:, None]).all(axis=1)
    seen = (
        everywhere
        & (peak_at > middle.start)
        & (peak_at < middle.stop - 1)
        & (below & left).any(axis=1)
        & (below & right).any(axis=1)
    )
    # The last place below the level before the peak, and the first one behind it; between it and the next the level.
    start = np.minimum(last - np.argmax((below & left)[:, ::-1], axis=1), last - 1)
    end = np.maximum(np.argmax(below & right, axis=1), 1)
    rising = np.maximum(profile[rows, start + 1] - profile[rows, start], 1e-9)
    falling = np.maximum(profile[rows, end - 1] - profile[rows, end], 1e-9)
    begin = start + (level - profile[rows, start]) / rising
    stop = end - (level - profile[rows, end]) / falling
    flank = 2.0 * (peak - floor) / (rising + falling) * _SPACING_PX
    width = (stop - begin) * _SPACING_PX
    return WallProfiles(*(np.where(seen, values, np.nan) for values in (width, flank, peak - floor)))
