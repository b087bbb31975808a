"""Between which bounds the figures of accepted jobs lie: the recipe's, and those that every picture is held to."""

from __future__ import annotations

from collections.abc import Mapping

from contour.acceptance.quality import QualityLimits, most_blur_px
from service.trends.history import History

Bounds = tuple[float | None, float | None]
"""Least and most; None = no bound, or none that is known."""


def limits_of(history: History) -> Mapping[str, Bounds]:
    """Bounds by quantity. Those of a recipe are the last ones used, where the span has jobs of one recipe only."""
    pictures = QualityLimits()
    pitch_px = history.whole.figures["pitch_px"]
    bounds: dict[str, Bounds] = {
        "level": (pictures.min_level, None),
        "blur_px": (None, most_blur_px(pitch_px.mean, pictures) if pitch_px.known else None),
    }
    if len({recipe.number for recipe in history.recipes}) == 1:
        settings = max(history.recipes, key=lambda used: used.use.last).settings
        bounds["uncertainty_mm"] = (None, settings.get("max_uncertainty_mm") or None)  # 0 = not checked
        bounds["area_mm2"] = (settings.get("min_area_mm2"), settings.get("max_area_mm2"))
    return bounds
