"""The calibration report: one HTML file with its pictures, to be kept beside the calibration."""

from __future__ import annotations

import html
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from service.measuring.report_pictures import coverage, millimetre_map, residual_arrows, work_frame

if TYPE_CHECKING:
    from contour.calibration.fixed_marks import Sentinels
    from contour.camera_calibration.board import Board
    from contour.camera_calibration.calibrate import CameraResult, Setup
    from service.measuring.board_pictures import Gathered

STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; color: #222; max-width: 1360px; margin: 24px auto; padding: 0 16px; }
h1 { font-size: 24px; margin-bottom: 4px; } h2 { font-size: 18px; margin: 28px 0 8px; }
.verdict { font-size: 18px; padding: 12px 16px; border-left: 6px solid; }
.good { border-color: #1a7f37; background: #eaf7ee; } .bad { border-color: #b35900; background: #fff4e5; }
.pictures { display: grid; grid-template-columns: repeat(auto-fit, minmax(420px, 1fr)); gap: 20px; }
figure { margin: 0; } figcaption { font-size: 13px; color: #555; margin-top: 4px; }
svg { width: 100%; height: auto; display: block; overflow: hidden; }
table { border-collapse: collapse; } td, th { text-align: left; padding: 3px 14px 3px 0; border-bottom: 1px solid #ddd;
vertical-align: top; } td.number { text-align: right; }
.frame { fill: #fff; stroke: #999; } .arrow path { stroke: #b2182b; stroke-width: 1; } .arrow circle { fill: #333; }
.never { fill: url(#hatch); stroke: #bbb; stroke-width: .5; } .hull { fill: none; stroke: #d95f02; stroke-width: 2; }
.value { font-size: 11px; text-anchor: middle; } .axis { font-size: 18px; font-weight: bold; fill: #fff; stroke: #000;
stroke-width: 3; paint-order: stroke; }
.x { stroke: #e41a1c; stroke-width: 4; } .y { stroke: #4daf4a; stroke-width: 4; }
.aside { position: absolute; }
.origin { fill: #fff; stroke: #000; stroke-width: 2; } .seen circle { fill: none; stroke: #ff0; stroke-width: 1; }
"""
HATCH = (
    '<svg width="0" height="0" class="aside"><defs><pattern id="hatch" width="8" height="8" '
    'patternUnits="userSpaceOnUse" patternTransform="rotate(45)"><rect width="8" height="8" fill="#fff"/>'
    '<line x1="0" y1="0" x2="0" y2="8" stroke="#c33" stroke-width="3"/></pattern></defs></svg>'
)


def write_report(
    path: Path,
    result: CameraResult,
    gathered: Gathered,
    board: Board,
    setup: Setup,
    sentinels: Sentinels | None,
) -> None:
    """Write the report; raise OSError."""
    verdict = result.verdict
    sections = [
        f'<p class="verdict {"good" if verdict.good else "bad"}">{html.escape(verdict.sentence)}</p>',
        *(f'<p class="verdict bad">{html.escape(text)}</p>' for text in _warnings(result, setup)),
        "<h2>The numbers</h2>",
        _table(_numbers(result, board, setup, sentinels)),
        "<h2>Pictures</h2>",
        f'<div class="pictures">{"".join(_pictures(result, gathered, board, setup))}</div>',
        "<h2>Lens models on unseen views</h2>",
        "<p>Each model was fitted with a fifth of the views left out, in turns; the simplest one whose error on "
        "the views left out is within one standard error of the best was taken. A lower error on fitted views is no "
        "merit.</p>",
        _models(result),
        "<h2>Views</h2>",
        _views(result, gathered),
    ]
    title = "Calibration" + (f" of {html.escape(setup.camera_name)}" if setup.camera_name else "")
    text = (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title>'
        f"<style>{STYLE}</style></head><body>{HATCH}<h1>{title}</h1>{''.join(sections)}</body></html>\n"
    )
    path.write_text(text, encoding="utf-8")


def _warnings(result: CameraResult, setup: Setup) -> list[str]:
    told = [check.warning(setup.accept_apart) for check in result.lengths]
    return [text for text in told if text is not None]


def _numbers(result: CameraResult, board: Board, setup: Setup, sentinels: Sentinels | None) -> list[tuple[str, str]]:
    verdict, calibration = result.verdict, result.calibration
    matrix, sure = calibration.camera_matrix, verdict.uncertainty
    x, y, z = calibration.camera_position
    lens = ", ".join(f"{value:.5f}" for value in calibration.distortion_coefficients)
    halves = verdict.halves_mm
    rows = [
        (f"95 % of positions at {height:g} mm are within", f"{figure:.3f} mm (where corners were seen)")
        for height, figure in zip(sure.heights_mm, sure.figures_mm, strict=True)
    ]
    rows += [
        (
            "two independent halves differ by",
            f"{halves[0].mean():.3f} mm on the table, {halves[-1].mean():.3f} mm at "
            f"{sure.heights_mm[-1]:g} mm (mean over the picture)",
        ),
        ("this is, against propagated noise,", f"{verdict.inflation:.2f} times as much; the figures above carry it"),
        ("corner noise", f"{result.noise_px:.3f} px, one standard deviation a coordinate"),
        ("residuals alike throughout a zone", f"{verdict.structure_px:.3f} px"),
        ("scale in the middle", f"{verdict.mm_per_px:.4f} mm a pixel"),
        ("board", f"{board.kind}, {board.name_of_size} squares of {board.square_mm:g} mm"),
        ("board's pattern above the table", f"{setup.board_thickness_mm:g} mm"),
        ("views", f"{len(result.views)} used, turned against each other by up to {result.turn_deg:.0f}°"),
        ("corners enclose", verdict.zones.text),
        (
            "contours outside of what corners enclose",
            "are taken, too" if sure.covered_px is None else "are refused (115 outside_work_area)",
        ),
        ("lens model", result.model.name),
        ("focal length", f"{matrix[0, 0]:.2f}, {matrix[1, 1]:.2f} px"),
        ("principal point", f"{matrix[0, 2]:.2f}, {matrix[1, 2]:.2f} px"),
        ("distortion", lens),
        ("camera stands at", f"x {x:.1f}, y {y:.1f}, z {z:.1f} mm in the work frame"),
        *(("measured by hand", str(check)) for check in result.lengths),
        *([] if result.lengths else [("measured by hand", "nothing: sizes are taken as they were told")]),
        ("fixed marks", ", ".join(str(mark.id) for mark in sentinels.marks) if sentinels else "none"),
    ]
    return rows


def _pictures(result: CameraResult, gathered: Gathered, board: Board, setup: Setup) -> list[str]:
    verdict, size = result.verdict, gathered.size
    sure = verdict.uncertainty
    block = int(np.flatnonzero(sure.heights_mm == setup.block_mm)[0])
    plane = next(view for view in result.views if view.name == setup.plane)
    pixels = [view.pixels for view in result.views]
    return [
        work_frame(gathered.plane_picture, result.calibration, 4 * board.square_mm, plane.pixels),
        coverage(verdict.zones, size),
        residual_arrows(pixels, result.residuals_px, size),
        millimetre_map(sure.map_mm[0], verdict.zones, size, "95 % bound on the table, mm"),
        millimetre_map(sure.map_mm[block], verdict.zones, size, f"95 % bound at {setup.block_mm:g} mm, mm"),
        millimetre_map(verdict.halves_mm[0], verdict.zones, size, "Two independent halves differ on the table by, mm"),
        millimetre_map(
            verdict.halves_mm[block],
            verdict.zones,
            size,
            f"Two independent halves differ at {setup.block_mm:g} mm by, mm",
        ),
    ]


def _models(result: CameraResult) -> str:
    rows = ["<tr><th>model</th><th>unseen views, px</th><th>fitted views, px</th><th></th></tr>"]
    for trial in result.trials:
        taken = "taken" if trial.model == result.model else ""
        rows.append(
            f'<tr><td>{html.escape(trial.model.name)}</td><td class="number">{trial.unseen_px:.4f}</td>'
            f'<td class="number">{trial.fitted_px:.4f}</td><td>{taken}</td></tr>'
        )
    return f"<table>{''.join(rows)}</table>"


def _views(result: CameraResult, gathered: Gathered) -> str:
    rows = ["<tr><th>view</th><th>corners</th><th>misses, px</th><th>edges, px</th><th></th></tr>"]
    for view, misses in zip(result.views, result.residuals_px, strict=True):
        error = float(np.sqrt((misses**2).sum(axis=1).mean()))
        note = "on the table" if view.name == gathered.plane else ""
        rows.append(
            f'<tr><td>{html.escape(view.name)}</td><td class="number">{len(view.ids)}</td><td class="number">'
            f'{error:.3f}</td><td class="number">{view.edge_sigma_px:.2f}</td><td>{note}</td></tr>'
        )
    for one in (*gathered.dropped, *result.dropped):
        rows.append(
            f'<tr><td>{html.escape(one.name)}</td><td colspan="4">not used: {html.escape(one.reason)}</td></tr>'
        )
    return f"<table>{''.join(rows)}</table>"


def _table(rows: list[tuple[str, str]]) -> str:
    cells = "".join(f"<tr><th>{html.escape(name)}</th><td>{html.escape(value)}</td></tr>" for name, value in rows)
    return f"<table>{cells}</table>"
