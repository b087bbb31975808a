"""A contour, or its parts, as a program for LinuxCNC: holes first, along the rings; standard library only."""


class Cutting:
    """How to move: heights above the machine's Z zero and feeds, mm and mm/min. cut_z_mm None = a dry run."""

    def __init__(self, safe_z_mm, cut_z_mm=None, feed_mm_min=3000.0, plunge_mm_min=600.0, path_tolerance_mm=0.01):
        if cut_z_mm is not None and cut_z_mm >= safe_z_mm:
            raise SystemExit(f"cut-z {cut_z_mm:g} is not below safe-z {safe_z_mm:g}; expected it below. Correct one")
        self.safe_z_mm = safe_z_mm
        self.cut_z_mm = safe_z_mm if cut_z_mm is None else cut_z_mm
        self.feed_mm_min, self.plunge_mm_min = feed_mm_min, plunge_mm_min
        self.path_tolerance_mm = path_tolerance_mm


def program(contour, cutting):
    """The program's text, absolute millimetres of the work coordinates G54, which the calibration is aligned to."""
    rings = driven(contour)
    lines = [
        f"(combtrace job {contour.job_id}, recipe {contour.recipe}, {len(contour.parts)} parts, {len(rings)} rings)",
        "G17 G21 G40 G49 G54 G80 G90 G94",
        f"G64 P{cutting.path_tolerance_mm:g}",
        f"G0 Z{cutting.safe_z_mm:g}",
    ]
    for ring in rings:
        lines += [f"G0 {_point(ring[0])}", f"G1 Z{cutting.cut_z_mm:g} F{cutting.plunge_mm_min:g}"]
        lines += [f"G1 {_point(point)} F{cutting.feed_mm_min:g}" for point in [*ring[1:], ring[0]]]
        lines += [f"G0 Z{cutting.safe_z_mm:g}"]
    return "\n".join([*lines, "M2", ""])


def driven(contour):
    """The rings in the order in which they are cut: of its parts where it has any, else its own; holes first."""
    shapes = [part.rings for part in contour.parts] or [contour.rings]
    return [ring for rings in shapes for ring in [*rings[1:], rings[0]]]


def out_of_limits(contour, cutting, limits, offset):
    """What lies outside of the machine's limits, in words; None where all is inside.

    limits: (least, most) of X, Y, Z in machine units of mm. offset: of the work coordinates in force, mm.
    """
    for axis, name in enumerate("XY"):
        values = [point[axis] + offset[axis] for ring in driven(contour) for point in ring]
        low, high = limits[axis]
        if min(values) < low or max(values) > high:
            return f"{name} from {min(values):.3f} to {max(values):.3f} mm, the machine goes from {low:g} to {high:g}"
    for height in (cutting.safe_z_mm, cutting.cut_z_mm):
        if not limits[2][0] <= height + offset[2] <= limits[2][1]:
            low, high = limits[2]
            return f"Z to {height + offset[2]:.3f} mm, the machine goes from {low:g} to {high:g}"
    return None


def _point(point):
    return f"X{point[0]:.3f} Y{point[1]:.3f}"
