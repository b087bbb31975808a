"""`recipes` of config.yaml: how each block type is traced, what of it is accepted, and what is made of it."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, field_validator, model_validator

from contour.errors import ParameterError
from contour.placement.pose import MOST_STEPS, Turns
from contour.placement.several import MOST_TRIES
from contour.polygon.start_vertex import Start
from contour.ribbon.ribbon import Ribbon
from contour.tracing.trace import Method
from service.config.plain_recipe import PlainRecipe
from service.config.values import FilePath, Model, Number, Point

DEFAULT_METHOD: Method = "wall-tips"
METHOD_PARAMETERS: dict[str, dict[str, tuple[float, float]]] = {
    "wall-tips": {},
    "sliding-matrix": {"core_px": (1, 1000), "step_px": (1, 2000), "threshold": (0, 255)},
    "direct-scan": {"max_gap_px": (0, 100_000), "min_width_px": (0, 100_000)},
    "find-contours": {},
}


class Gcode(Model):
    """How G-code of a contour moves; heights above the table."""

    feed_mm_min: float = Field(3000, gt=0, le=1e6, description="Feed along the rings, mm/min.")
    plunge_mm_min: float = Field(600, gt=0, le=1e6, description="Feed downwards, mm/min.")
    safe_z_mm: float | None = Field(
        None, ge=0, le=10_000, description="Height between rings, mm; none = 20 mm above the block."
    )
    cut_z_mm: float | None = Field(
        None, ge=-1000, le=10_000, description="Height along the rings, mm; none = the safe height, a dry run."
    )
    path_tolerance_mm: float = Field(0.01, gt=0, le=10, description="How far corners may be rounded (G64 P), mm.")
    direction: Literal["climb", "conventional"] = Field(
        "climb", description="climb: the material is on the right of the way; conventional: on the left."
    )
    lead_in_mm: float = Field(
        0, ge=0, le=1000, description="Straight way onto each ring through what is no material, mm; 0 = none."
    )
    template: FilePath | None = Field(None, description="Program around $rings; none = one for LinuxCNC.")


class PartToCut(Model):
    """The part that is to be cut from the block: it must fit, or the block is refused (119)."""

    file: FilePath = Field(description="Its drawing: .dxf, .svg, .geojson or .json.")
    units: Literal["um", "mm", "cm", "m", "in"] | None = Field(
        None, description="Unit of a drawing that does not say its own; none is guessed."
    )
    layer: str = Field(
        "", max_length=255, description="Layer, or group of an SVG, that it is on; empty = the whole file."
    )
    margin_mm: float = Field(
        0,
        ge=0,
        le=1000,
        description="Least distance to the block's edge and holes, mm, besides the contour's own bound.",
    )
    rotation: Literal["free", "fixed"] | Annotated[int, Field(ge=1, le=MOST_STEPS)] = Field(
        "free", description="free: any turn; fixed: as drawn; a number: that many equal steps of the circle."
    )
    ribbon_angle_deg: float | None = Field(
        None,
        ge=-360,
        le=360,
        description="Direction of the core's ribbon in the machine frame, degrees from x counter-clockwise: the "
        "drawing's x axis comes to lie along it, either way round; none = it does not matter.",
    )
    ribbon_from_picture: bool = Field(
        False,
        description="That direction is read from each picture; ribbon_angle_deg is for those that do not tell it, "
        "which are refused without.",
    )
    ribbon_tolerance_deg: float = Field(2, ge=0, le=90, description="How far from it the part may be turned, degrees.")

    @property
    def turns(self) -> Turns:
        """The turns that the part may take."""
        steps = {"free": None, "fixed": 1}.get(str(self.rotation), self.rotation)
        turns = Turns.free() if steps is None else Turns.steps(int(steps))
        return turns if self.ribbon_angle_deg is None else turns.along(self.ribbon_angle_deg, self.ribbon_tolerance_deg)

    def on(self, ribbon: Ribbon | None) -> Self:
        """The same for a block whose ribbon was read from its picture, where that is asked for; raise ParameterError
        where it was not told well enough and no angle is given, or where no turn is left.
        """
        if not self.ribbon_from_picture:
            return self
        why = "nobody looked" if ribbon is None else ribbon.why
        if ribbon is not None and ribbon.angle_deg is not None and ribbon.bound_deg is not None:
            left = self.ribbon_tolerance_deg - ribbon.bound_deg
            if left >= 0:
                told = {"ribbon_angle_deg": ribbon.angle_deg, "ribbon_tolerance_deg": left}
                read: Self = self.model_copy(update=told)
                assert read.turns.intervals
                return read
            why = f"it is told within {ribbon.bound_deg:.1f} degrees only, {self.ribbon_tolerance_deg:g} are allowed"
        if self.ribbon_angle_deg is None:
            raise ParameterError(
                f"Where the core's ribbon runs cannot be read from the picture: {why}. Look where it runs and set "
                "ribbon_angle_deg, or light the block so that its walls show sharply."
            )
        return self

    @model_validator(mode="after")
    def _may_be_turned_somehow(self) -> Self:
        try:
            assert self.turns.intervals
        except ParameterError as error:
            raise ValueError(str(error)) from error
        return self


class OneOfParts(PartToCut):
    """One of several parts that are to be cut from the block; as many as fit are laid."""

    quantity: int = Field(1, ge=1, le=200, description="How often it is to be cut.")
    priority: int = Field(1, ge=1, le=9, description="1 is laid before 2; of one priority, the larger first.")


class Recipe(Model):
    """A block type: how it is traced and what is accepted."""

    number: int = Field(ge=1, le=65_535, description="Number by which triggers name it.")
    name: str = Field(min_length=1, max_length=80, description="Name for people.")
    method: Method = Field(DEFAULT_METHOD, description="How the contour is traced.")
    thickness_mm: float = Field(20, ge=0, le=10_000, description="Height of the block's top above the table, mm.")
    tolerance_mm: float = Field(0.1, ge=0, le=100, description="Largest shift by leaving vertices out, mm.")
    thickness_tolerance_mm: float = Field(
        0, ge=0, le=1000, description="How far the block's top may lie from that height, mm."
    )
    max_uncertainty_mm: float = Field(
        0, ge=0, le=1000, description="Largest accepted 95 % bound on the contour's position, mm; 0 = not checked."
    )
    max_disagreement_pitches: float = Field(
        2.0,
        ge=0,
        le=1000,
        description="How far contour and busy part of the picture may be apart in one place, cell pitches, and an "
        "eighth of it everywhere; 0 = not checked.",
    )
    network: bool = Field(
        True,
        description="Whether a network looks for the comb where the picture itself shows no outline, and for comb "
        "beyond outlines that it does show.",
    )
    margin_mm: float = Field(
        0,
        ge=-1000,
        le=1000,
        description="How far the polygon's edges are moved into the material, mm: the exterior shrinks, holes grow; "
        "negative = out of it.",
    )
    start: Literal["traced", "lower-left", "lower-right", "upper-left", "upper-right"] | Point = Field(
        "traced",
        description="Vertex at which each ring begins: as traced, the outermost towards a corner, or the nearest to a "
        "point [x, y] in mm; all in the machine frame.",
    )
    max_vertices: int = Field(4000, ge=3, le=1_000_000, description="Most vertices of all rings together.")
    budget_mm: float = Field(
        0,
        ge=0,
        le=100,
        description="Most material that may be given up so that there are no more than max_vertices, mm; 0 = none.",
    )
    min_area_mm2: float = Field(100, ge=0, le=4e9, description="Smallest accepted area, mm², holes taken off.")
    max_area_mm2: float = Field(4_000_000, gt=0, le=4e9, description="Largest accepted area, mm², holes taken off.")
    max_holes: int = Field(
        1000, ge=0, le=1000, description="Most holes that the block may have; what else looks like one lies on it."
    )
    polarity: Literal["auto", "bright", "dark"] = Field("auto", description="Walls against the table.")
    binarize: Literal["flat", "otsu"] | Annotated[int, Field(ge=0, le=255)] = Field(
        "flat", description="How walls are told from gaps: flat, otsu, or a fixed grey level 0 to 255."
    )
    edge: Literal["auto", "cut", "cells"] = Field(
        "auto", description="auto: seen in the picture; cut: cells are cut open at the edge; cells: closed."
    )
    pieces: Literal["one", "largest"] = Field(
        "one", description="one: other blocks in view are refused; largest: smaller ones are not."
    )
    max_bridged_mm: float = Field(
        0, ge=0, le=1000, description="Longest hidden part of the edge that may be bridged, mm; 0 = none."
    )
    bridge: Literal["straight", "arcs"] = Field(
        "straight", description="straight: only straight edges are bridged; arcs: arcs and curves, too."
    )
    roi_px: tuple[Number, ...] = Field(
        (), description="Nothing is seen outside of it: left, top, right, bottom, px; none = the whole picture."
    )
    roi_mm: tuple[Number, ...] = Field(
        (), description="The same in the machine frame, at the block's top: left, bottom, right, top, mm."
    )
    exports: tuple[Literal["dxf", "svg", "geojson", "gcode"], ...] = Field(
        (), description="Forms in which an accepted contour is kept in the archive: dxf, svg, geojson, gcode."
    )
    gcode: Gcode = Field(Gcode(), description="How G-code moves.")
    part: PartToCut | None = Field(None, description="The part that is to be cut from the block; none = not checked.")
    parts: tuple[OneOfParts, ...] = Field(
        (), max_length=50, description="Several parts instead: as many as fit are laid; none = not asked for."
    )
    parts_apart_mm: float = Field(0, ge=0, le=1000, description="Least distance between two of these parts, mm.")
    parts_tries: int = Field(
        2, ge=1, le=MOST_TRIES, description="Layouts that are tried, each towards another side; the best is taken."
    )
    parameters: dict[str, Number] = Field(
        default_factory=dict, description="Sizes of the method; left out, they follow from the picture."
    )

    @model_validator(mode="after")
    def _wall_tips_finds_its_own_threshold(self) -> Self:
        if self.method == "wall-tips" and self.binarize != "flat":
            raise ValueError(
                f"binarize is {self.binarize!r}, but wall-tips finds its own threshold; use flat, or another method"
            )
        return self

    @model_validator(mode="after")
    def _one_part_or_several(self) -> Self:
        if self.part is not None and self.parts:
            raise ValueError("part and parts are both given, expected one of them")
        return self

    @property
    def asked_parts(self) -> tuple[PartToCut, ...]:
        """All parts that it names, in their order."""
        return self.parts if self.part is None else (self.part,)

    @model_validator(mode="after")
    def _one_region_of_interest(self) -> Self:
        if self.roi_px and self.roi_mm:
            raise ValueError("roi_px and roi_mm are both given, expected one of them")
        return self

    @model_validator(mode="after")
    def _areas_in_order(self) -> Self:
        if self.min_area_mm2 >= self.max_area_mm2:
            raise ValueError(
                f"min_area_mm2 is {self.min_area_mm2:g}, expected less than max_area_mm2, {self.max_area_mm2:g}"
            )
        return self

    @model_validator(mode="after")
    def _parameters_of_the_method(self) -> Self:
        known = METHOD_PARAMETERS[self.method]
        for name, value in self.parameters.items():
            if name not in known:
                there = ", ".join(known) or "none"
                owner = next((f"; {name} is {other}'s" for other, its in METHOD_PARAMETERS.items() if name in its), "")
                raise ValueError(f"parameters.{name} is none of {self.method}'s; there are: {there}{owner}")
            low, high = known[name]
            if not low <= value <= high:
                raise ValueError(f"parameters.{name} is {value:g}, expected {low:g} to {high:g}")
            if name.endswith("_px") and value != int(value):
                raise ValueError(f"parameters.{name} is {value:g}, expected a whole number of pixels")
        return self

    @property
    def needs_millimetres(self) -> str | None:
        """The first of its keys that means nothing without a calibration."""
        meant = {
            "roi_mm": self.roi_mm,
            "margin_mm": self.margin_mm,
            "start": isinstance(self.start, tuple),
            "max_bridged_mm": self.max_bridged_mm,
            "part": self.part is not None,
            "parts": bool(self.parts),
        }
        return next((key for key, value in meant.items() if value), None)

    @property
    def first_vertex(self) -> Start | None:
        """Where rings begin; None = as traced."""
        return None if self.start == "traced" else self.start

    @field_validator("roi_px", "roi_mm")
    @classmethod
    def _box(cls, value: tuple[float, ...]) -> tuple[float, ...]:
        if value and (len(value) != 4 or value[0] >= value[2] or value[1] >= value[3]):
            raise ValueError(
                f"is {list(value)}, expected four numbers, the third above the first and the fourth above the second"
            )
        return value


AnyRecipe = Recipe | PlainRecipe
