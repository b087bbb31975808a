"""The paper's two algorithms read literally, pixel by pixel in plain Python: what the vectorised ones must equal."""

from __future__ import annotations

Rows = list[list[int]]
Points = list[tuple[int, int]]


def direct_scan(picture: Rows, max_gap_px: int, min_width_px: int) -> Points:
    """Left points from top to bottom, then right points from bottom to top, as (x, y)."""
    lefts: Points = []
    rights: Points = []
    for y, row in enumerate(picture):
        pair = _first_pair(row, max_gap_px, min_width_px)
        if pair is not None:
            lefts.append((pair[0], y))
            rights.append((pair[1], y))
    return lefts + rights[::-1]


def _first_pair(row: list[int], max_gap_px: int, min_width_px: int) -> tuple[int, int] | None:
    left: int | None = None
    last_white = 0
    blacks = 0
    for x, value in enumerate(row):
        if value != 0:
            if left is None:
                left = x
            last_white = x
            blacks = 0
            continue
        blacks += 1
        if left is not None and blacks > max_gap_px:
            if last_white - left >= min_width_px:
                return left, last_white
            left = None
    # The row ends inside a run: its last white pixel is the right point.
    if left is not None and last_white - left >= min_width_px:
        return left, last_white
    return None


def sliding_matrix(picture: Rows, core: int, step: int, threshold: float) -> Rows:
    """The filled picture, 0 and 255."""
    height, width = len(picture), len(picture[0]) if picture else 0
    filled = [[255 if value else 0 for value in row] for row in picture]
    y = core
    while y + core <= height:
        x = core
        while x + core <= width:
            window = [255 if picture[v][u] else 0 for v in range(y - core, y + core) for u in range(x - core, x + core)]
            if sum(window) / len(window) > threshold:
                for v in range(y - core, y + core):
                    for u in range(x - core, x + core):
                        filled[v][u] = 255
            x += step
        y += step
    return filled
