"""Outlines in SVG: paths and basic shapes; width, height and viewBox together say what a user unit is."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from contour.geometry.arrays import Float64s
from service.parts.part import MOST_ENTITIES, UNITS_MM, Asked, Drawing, PartFileError, Stroke, chord_in
from service.parts.svg_path import path_strokes

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_LENGTH = re.compile(rf"\s*({_NUMBER})\s*(mm|cm|in)\s*")
_TRANSFORM = re.compile(r"(\w+)\s*\(([^)]*)\)")
_GROUPS = frozenset({"g", "a"})
_HIDDEN = re.compile(r"display\s*:\s*none|transform\s*:")
_WORDS = frozenset({"title", "desc", "metadata", "text", "style", "namedview"})
"""What tells of the drawing and cannot be an outline."""

_SHAPES = frozenset({"path", "rect", "circle", "ellipse", "line", "polyline", "polygon"})
_DEEPEST = 100
_ROUND = 1e-6
"""Share by which the scales along width and height may differ: sizes are written with few digits."""


def read_svg(path: Path, asked: Asked) -> Drawing:
    """The strokes of all paths and shapes, y turned up; raise PartFileError without the file's name.

    Where the picture has a size in mm, cm or in, and a viewBox, a stroke's unit is that of the size. Layers are groups
    by their id.
    """
    try:
        root = ElementTree.parse(path).getroot()
    except (OSError, ElementTree.ParseError, LookupError, ValueError) as error:
        raise PartFileError(f"is no SVG that can be read ({error}). Save it anew as plain SVG") from error
    if _local(root) != "svg":
        raise PartFileError(f"is XML of <{_local(root)}>, expected <svg>")
    stated, scale = _scale(root)
    unit = asked.settled(stated)
    start = root
    if asked.layer:
        found = [one for one in root.iter() if one.get("id") == asked.layer and _local(one) in _GROUPS]
        if not found:
            raise PartFileError(f"has no group with the id {asked.layer!r}. Correct part.layer")
        start = found[0]
    # SVG's y runs down: what is drawn is seen as it is only with y turned.
    base = np.array([[scale, 0.0, 0.0], [0.0, -scale, 0.0]])
    strokes: list[Stroke] = []
    for stroke in _walked(start, _product(base, _above(root, start)), chord_in(unit)):
        strokes.append(stroke)
        if len(strokes) > MOST_ENTITIES:
            raise PartFileError(f"has more than {MOST_ENTITIES} strokes. Save the part alone, or name its layer")
    return Drawing(tuple(strokes), unit)


def _local(element: ElementTree.Element) -> str:
    return str(element.tag).rpartition("}")[2]


def _scale(root: ElementTree.Element) -> tuple[str, float]:
    """The unit of the picture's size and how much of it a user unit is; "" and 1 where it has no size in a unit."""
    sizes = [_LENGTH.fullmatch(root.get(name, "")) for name in ("width", "height")]
    box = [float(number) for number in re.findall(_NUMBER, root.get("viewBox", ""))]
    if sizes[0] is None or sizes[1] is None or len(box) != 4 or min(box[2:]) <= 0:
        return "", 1.0
    if sizes[0][2] != sizes[1][2]:
        raise PartFileError(f"has its width in {sizes[0][2]} and its height in {sizes[1][2]}. Use one unit")
    scales = [float(size[1]) / side for size, side in zip(sizes, box[2:], strict=True) if size is not None]
    if abs(scales[0] - scales[1]) > _ROUND * max(scales):
        raise PartFileError(
            f"is {scales[0]:g} {sizes[0][2]} a unit along its width and {scales[1]:g} along its height, expected the "
            "same. Correct width, height or viewBox"
        )
    assert sizes[0][2] in UNITS_MM
    return sizes[0][2], scales[0]


def _above(root: ElementTree.Element, wanted: ElementTree.Element) -> Float64s:
    """The transforms of all groups around an element, the element's own left out."""
    if root is wanted:
        return np.eye(2, 3)
    parents = {child: parent for parent in root.iter() for child in parent}
    matrix, element = np.eye(2, 3), wanted
    while element is not root:
        element = parents[element]
        matrix = _product(_matrix(element), matrix)
    return matrix


def _walked(element: ElementTree.Element, matrix: Float64s, chord: float, depth: int = 0) -> Iterator[Stroke]:
    kind = _local(element)
    if kind in _WORDS:
        return
    name = f"<{kind}>" + (f" {element.get('id')!r}" if element.get("id") else "")
    if kind == "defs" and not len(element):
        return
    if depth and kind not in _GROUPS | _SHAPES:
        raise PartFileError(f"holds {name}, expected only groups and {', '.join(sorted(_SHAPES))}. Save as plain SVG")
    if element.get("display") == "none" or _HIDDEN.search(element.get("style", "")):
        raise PartFileError(f"{name} is hidden, or moved by its style. Take it out, or save as plain SVG")
    if depth > _DEEPEST:
        raise PartFileError(f"{name} lies in more than {_DEEPEST} groups. Save as plain SVG")
    matrix = _product(matrix, _matrix(element))
    if kind in _GROUPS or not depth:
        for child in element:
            if isinstance(child.tag, str):  # comments have none
                yield from _walked(child, matrix, chord, depth + 1)
        return
    stretch = float(np.linalg.norm(matrix[:, :2], 2))
    if stretch <= 0:
        raise PartFileError(f"{name} is drawn at no size. Correct its transform")
    try:
        runs = path_strokes(_path_data(element, kind), chord / stretch)
    except (ValueError, TypeError, ArithmeticError, RecursionError) as error:
        raise PartFileError(f"{name}: cannot be drawn ({error}). Correct it") from error
    for points, closed in runs:
        placed = points @ matrix[:, :2].T + matrix[:, 2]
        if len(placed) < 2 or not np.ptp(placed, axis=0).any():
            raise PartFileError(f"{name} has no length. Take it out")
        yield Stroke(placed, closed, name)


def _path_data(element: ElementTree.Element, kind: str) -> str:
    """A shape as the path that SVG defines it by."""

    def length(name: str) -> float:
        text = element.get(name, "0")
        if not re.fullmatch(rf"\s*{_NUMBER}\s*", text):
            raise ValueError(f"{name} is {text!r}, expected a number of user units")
        return float(text)

    if kind == "path":
        return element.get("d", "")
    if kind in ("polyline", "polygon"):
        return f"M{element.get('points', '')}" + ("Z" if kind == "polygon" else "")
    if kind == "line":
        return f"M{length('x1')},{length('y1')}L{length('x2')},{length('y2')}"
    if kind == "rect":
        x, y, width, height = (length(name) for name in ("x", "y", "width", "height"))
        if length("rx") or length("ry"):
            raise ValueError("it has round corners; turn it into a path")
        return f"M{x},{y}h{width}v{height}h{-width}Z"
    rx, ry = (length("r"), length("r")) if kind == "circle" else (length("rx"), length("ry"))
    left, y = length("cx") - rx, length("cy")
    return f"M{left},{y}A{rx},{ry} 0 0 1 {left + 2 * rx},{y}A{rx},{ry} 0 0 1 {left},{y}Z"


def _matrix(element: ElementTree.Element) -> Float64s:
    """The element's transform, (2, 3)."""
    matrix = np.eye(2, 3)
    text = element.get("transform", "")
    found = _TRANSFORM.findall(text)
    if text.strip() and not found:
        raise PartFileError(f"has the transform {text[:40]!r}, which is none that SVG knows")
    for kind, arguments in found:
        numbers = [float(number) for number in re.findall(_NUMBER, arguments)]
        try:
            matrix = _product(matrix, _one_transform(kind, numbers))
        except (ValueError, IndexError) as error:
            raise PartFileError(f"has the transform {text[:40]!r}, which is none that SVG knows") from error
    return matrix


def _one_transform(kind: str, numbers: list[float]) -> Float64s:
    if kind == "matrix":
        return np.array(numbers).reshape(3, 2).T
    if kind == "translate":
        return np.array([[1.0, 0.0, numbers[0]], [0.0, 1.0, numbers[1] if len(numbers) > 1 else 0.0]])
    if kind == "scale":
        return np.array([[numbers[0], 0.0, 0.0], [0.0, numbers[-1], 0.0]])
    if kind == "rotate":
        cosine, sine = math.cos(math.radians(numbers[0])), math.sin(math.radians(numbers[0]))
        turn = np.array([[cosine, -sine], [sine, cosine]])
        centre = np.array(numbers[1:3] or [0.0, 0.0])
        return np.column_stack([turn, centre - turn @ centre])
    if kind in ("skewX", "skewY"):
        slope = math.tan(math.radians(numbers[0]))
        return np.array(
            [[1.0, slope, 0.0], [0.0, 1.0, 0.0]] if kind == "skewX" else [[1.0, 0.0, 0.0], [slope, 1.0, 0.0]]
        )
    raise ValueError(kind)


def _product(outer: Float64s, inner: Float64s) -> Float64s:
    """The transform that does `inner`, then `outer`, (2, 3)."""
    return np.column_stack([outer[:, :2] @ inner[:, :2], outer[:, :2] @ inner[:, 2] + outer[:, 2]])
