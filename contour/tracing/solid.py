"""A block of closed border cells, a sheet with holes or a slab of foam: the outline around its material."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property

from contour.errors import NoBlockFound
from contour.geometry.arrays import Bytes, Float64s
from contour.geometry.rings import Contour
from contour.material.closed_cells import MaterialEdge, material_edge
from contour.material.foam import foam_edge
from contour.tracing.cut_lines import stub_cuts, with_cuts
from contour.tracing.edge_kind import (
    FINE_PITCH_PX,
    check_closed,
    check_fine,
    edge_kind,
    lined_by_walls,
    teeth_cut,
    tooth_px,
)
from contour.tracing.plates import like_plate, plate_edge
from contour.tracing.touched_edges import touched_cuts
from contour.tracing.trace import Edge, OnStage, Trace
from contour.walls.cell_scale import CellScale, probe
from contour.walls.pieces import pieces_beside
from contour.walls.wall_evidence import BlockEvidence
from contour.walls.wall_mask import wall_mask


@dataclass(frozen=True, eq=False)
class Solid:
    """A picture's material with the cells that it closes; each part is looked for once, when it is first asked for."""

    picture: Bytes
    light: Bytes
    polarity: str
    on_stage: OnStage

    @cached_property
    def cells(self) -> CellScale:
        """Raises NoBlockFound."""
        return probe(self.light, self.polarity)

    @cached_property
    def walls(self) -> Bytes:
        """The mask of the walls, (H, W); raises NoBlockFound."""
        cells = self.cells
        return wall_mask(self.light, cells.pitch_px, bright=cells.bright, contrast=cells.contrast).mask

    @cached_property
    def edge(self) -> MaterialEdge:
        """Raises NoBlockFound."""
        return material_edge(self.picture, self.cells.pitch_px, self.walls)

    @cached_property
    def lined(self) -> bool:
        """Whether walls, or webs, line the edge of material; raises NoBlockFound."""
        return lined_by_walls(self.edge.contour.exterior, self.light, self.cells)

    def closed(self) -> Trace:
        """The serrated boundary of a block whose border cells are closed; its cells must show that it is one."""
        _ = self.walls
        self.on_stage("mask")
        foam = None if self.cells.comb.cellular else self.foam()
        if foam is not None:
            return replace(foam, edge="cells")
        check_closed(self.edge.contour.exterior, self.cells.pitch_px, self.cells.wall_px)
        return self.around(self.edge)

    def check_fine(self, seen: BlockEvidence, outline: Contour) -> None:
        """Raise EdgeContradicted where cells are too fine to tell a cut border from a closed one."""
        if seen.pitch_px < FINE_PITCH_PX:
            with suppress(NoBlockFound):
                check_fine(self.edge, seen, outline)

    def foam(self) -> Trace | None:
        """The outline of a slab of foam, cut as it mostly is; None where it is none."""
        _ = self.walls
        try:
            slab = foam_edge(self.light, self.edge, self.cells.pitch_px)
        except NoBlockFound:
            return None
        return None if slab is None else replace(self.around(slab), edge="cut")

    def around(self, outline: MaterialEdge) -> Trace:
        """The trace of such an outline."""
        others = pieces_beside(self.walls, outline.contour.exterior, self.cells.pitch_px)
        self.on_stage("trace")
        return Trace(
            "wall-tips",
            "bright" if self.cells.bright else "dark",
            self.cells.pitch_px,
            outline.contour,
            self.light,
            uncertainty_px=outline.bound_px,
            others=others,
            edge="cells",
        )

    def if_closed(self, seen: BlockEvidence) -> tuple[Trace | None, Edge]:
        """The boundary of a block with closed border cells, some of them opened by straight cuts; None where it was cut
        otherwise or nothing tells it from the table. And which kind of border it is.
        """
        cells, _ = self.cells, self.walls
        try:
            material = self.edge
        except NoBlockFound:
            return None, "cut"
        if not self.lined:
            return None, "cut"
        kind, comb = edge_kind(material, seen), cells.comb
        sheet = plate_edge(material, wide=False) if kind == "cells" else None
        if sheet is not None:
            # Webs of a sheet do not end as walls do.
            (found, kind), comb = sheet, replace(comb, plate=True)
        else:
            touched = [] if kind == "cut" else self._touched(material, seen)
            closed = kind == "cells" and not touched
            if closed and teeth_cut(material.contour.exterior, seen):
                return None, "mixed"
            if touched:
                # It may be cut on all sides, and what few ends are sure lie on others than are touched.
                kind = edge_kind(material, seen, touched)
            cut = None if closed or kind == "cut" else with_cuts(material, seen, touched)
            found = material if closed else cut
        return None if found is None else replace(self.around(found), comb=comb, edge=kind), kind

    def _touched(self, material: MaterialEdge, seen: BlockEvidence) -> list[Float64s]:
        """Straight cuts along edges that material touches, or through what is left of walls of a single cell."""
        teeth = tooth_px(seen)
        found = touched_cuts(material, seen.pitch_px, tooth_px=teeth, walls=self.walls, wall_px=seen.wall_px)
        return found or stub_cuts(material, seen)

    def plate(self, seen: BlockEvidence) -> Trace | BlockEvidence | None:
        """The outline of a perforated sheet; what is seen of it, as of a sheet, where it was cut along more than one
        line; None where it is none.
        """
        asked, wide = like_plate(seen.comb)
        if not asked:
            return None
        cells, _ = self.cells, self.walls
        try:
            found = plate_edge(self.edge, wide=wide) if self.lined else None
        except NoBlockFound:
            return None
        if found is None:
            return None
        comb = replace(cells.comb, plate=True)
        outline, edge = found
        if outline is None:
            return replace(seen, comb=comb)
        return replace(self.around(outline), comb=comb, edge=edge)
