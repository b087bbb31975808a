"""The tables of docs/reports/methods.md, by the names of their sections."""

from __future__ import annotations

from benchmarks.methods.blocks import CORE_AND_STEP, cells, traced, walls
from benchmarks.page_section import table
from contour.image.opencv import outer_contours
from contour.tracing.direct_scan import default_gap_px, default_width_px, scan_pairs
from contour.tracing.sliding_matrix import default_core_px, default_threshold, fill_windows
from contour.tracing.trace import TraceSettings

CLUTTER = ((0, 0), (20, 4), (80, 12))


def tables() -> dict[str, str]:
    """Each table as Markdown."""
    return {"core-and-step": core_and_step(), "noise": noise()}


def core_and_step() -> str:
    """What core and step do to the outline of the L."""
    rows = []
    for core, step in CORE_AND_STEP:
        _, mean_px, share = traced(TraceSettings("sliding-matrix", core_px=core, step_px=step), "l")
        rows.append([f"core {core}, step {step}", f"{mean_px:.1f}", f"{share:+.1f}"])
    return table(["`core_px`, `step_px`", "mean error, px", "area, %"], rows)


def noise() -> str:
    """What lies beside a convex block, and what the methods make of it."""
    scan, windows = TraceSettings("direct-scan"), TraceSettings("sliding-matrix")
    rows = []
    for specks, chips in CLUTTER:
        there = ("convex", specks, chips)
        mask, seen = walls(*there).mask, cells(*there)
        _, dropped = scan_pairs(mask, default_gap_px(seen), default_width_px(seen))
        core = default_core_px(seen.pitch_px)
        filled = fill_windows(mask, core, core, default_threshold(seen))
        rows.append(
            [
                f"{specks} specks, {chips} chips",
                str(len(dropped)),
                f"{traced(scan, *there)[1]:.1f}",
                f"{traced(TraceSettings('direct-scan', min_width_px=0), *there)[1]:.1f}",
                str(len(outer_contours(filled)) - 1),
                f"{traced(windows, *there)[1]:.1f}",
            ]
        )
    head = [
        "beside the block",
        "direct-scan: pairs dropped",
        "mean error, px",
        "with nothing dropped, px",
        "sliding-matrix: contours dropped",
        "mean error, px",
    ]
    return table(head, rows)
