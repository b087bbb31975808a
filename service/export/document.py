"""What every export says beside the rings: where they come from, and how sure they are."""

from __future__ import annotations

from dataclasses import dataclass

from contour.geometry.rings import Contour, oriented_contour

EXTERIOR, HOLES = "EXTERIOR", "HOLES"
PART, PART_HOLES = "PART", "PART_HOLES"
"""Names of the layers that exterior and holes of block and part are on."""


class ExportError(Exception):
    """A contour cannot be written in that form: seen, expected, next step."""


@dataclass(frozen=True)
class ExportDocument:
    """A contour to be exported, machine frame, mm; `thickness_mm` is the height of its plane above the table.

    title: one line that names the picture or job. uncertainty_mm: 95 % bound on its position, None = not known. parts:
    what is to be cut from the block, where it lies in it.
    """

    contour: Contour
    title: str
    thickness_mm: float
    uncertainty_mm: float | None = None
    parts: tuple[Contour, ...] = ()

    def oriented_parts(self) -> list[Contour]:
        """The parts' rings, as `oriented` has the block's."""
        return [oriented_contour(part, counter_clockwise=True) for part in self.parts]

    def oriented(self) -> Contour:
        """The rings as everywhere else: exterior counter-clockwise, holes clockwise, first vertex not repeated."""
        return oriented_contour(self.contour, counter_clockwise=True)

    @property
    def note(self) -> str:
        """One plain line for comments: title, frame, unit, height, bound. Only printable ASCII, no brackets."""
        bound = "not known" if self.uncertainty_mm is None else f"{self.uncertainty_mm:.3f} mm"
        text = f"{self.title}; machine frame, mm; plane {self.thickness_mm:g} mm above the table; 95 % bound {bound}"
        return "".join(letter if letter.isascii() and letter.isprintable() else "?" for letter in text).translate(
            str.maketrans("()", "[]")
        )
