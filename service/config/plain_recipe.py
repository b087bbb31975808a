"""The recipe of those who name no configuration: told without pydantic, which takes longer to load than a trace."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from contour.polygon.start_vertex import Start
    from contour.tracing.trace import Method
    from service.config.recipes import OneOfParts, PartToCut


@dataclass(frozen=True)
class PlainRecipe:
    """What a picture is measured by, each at the default of `Recipe`; a test holds them to it."""

    number: int = 1
    method: Method = "wall-tips"
    thickness_mm: float = 20.0
    tolerance_mm: float = 0.1
    thickness_tolerance_mm: float = 0.0
    max_uncertainty_mm: float = 0.0
    max_disagreement_pitches: float = 2.0
    network: bool = True
    margin_mm: float = 0.0
    first_vertex: Start | None = None
    max_vertices: int = 4000
    budget_mm: float = 0.0
    min_area_mm2: float = 100.0
    max_area_mm2: float = 4_000_000.0
    max_holes: int = 1000
    polarity: Literal["auto", "bright", "dark"] = "auto"
    binarize: Literal["flat", "otsu"] | int = "flat"
    edge: Literal["auto", "cut", "cells"] = "auto"
    pieces: Literal["one", "largest"] = "one"
    max_bridged_mm: float = 0.0
    bridge: Literal["straight", "arcs"] = "straight"
    roi_px: tuple[float, ...] = ()
    roi_mm: tuple[float, ...] = ()
    part: PartToCut | None = None
    parts: tuple[OneOfParts, ...] = ()
    parts_apart_mm: float = 0.0
    parts_tries: int = 2
    parameters: dict[str, float] = field(default_factory=dict)

    @property
    def asked_parts(self) -> tuple[PartToCut, ...]:
        """All parts that it names, in their order."""
        return self.parts if self.part is None else (self.part,)
