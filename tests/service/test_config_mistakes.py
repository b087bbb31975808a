"""What a person reads who has made a mistake in config.yaml: the line, the key, and words of our own."""

from __future__ import annotations

from pathlib import Path

import pytest

from service.config_file import ConfigError, load_config

FILE = """\
camera:
  kind: files
  path: pictures
{camera}
controller: {{kind: none}}
triggers:
  - kind: interval
    period_s: {period}
recipes:
  - number: 1
    name: a
  - number: 2
    name: b
{recipe}
"""


def told(tmp_path: Path, *, camera: str = "", period: str = "1", recipe: str = "") -> str:
    path = tmp_path / "config.yaml"
    path.write_text(FILE.format(camera=camera, period=period, recipe=recipe))
    with pytest.raises(ConfigError) as error:
        load_config(path)
    return str(error.value).replace(f"{path}: ", "")


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"camera": "  average: 0"}, "line 4: camera.average: seen 0, expected 1 or more (Frames of a still scene"),
        ({"camera": "  loop: perhaps"}, "line 4: camera.loop: seen 'perhaps', expected true or false (Begin again"),
        ({"camera": "  paht: x"}, "line 4: camera.paht: unknown key; did you mean path?"),
        ({"period": "soon"}, "line 8: triggers[0].period_s: seen 'soon', expected a number (Period, s)"),
        (
            {"recipe": "    method: magic"},
            "line 14: recipes[1].method: seen 'magic', expected one of wall-tips, sliding",
        ),
        (
            {"recipe": "    start: middle"},
            "line 14: recipes[1].start: seen 'middle', expected one of traced, lower-left, lower-right, upper-left, "
            "upper-right or a list of numbers (Vertex at which",
        ),
        ({"recipe": "    start: [1]"}, "line 14: recipes[1].start: seen [1], expected one of traced"),
        (
            {"recipe": "    binarize: 300"},
            "line 14: recipes[1].binarize: seen 300, expected one of flat, otsu or 255 at",
        ),
        ({"recipe": "    max_vertices: 10.5"}, "line 14: recipes[1].max_vertices: seen 10.5, expected a whole number"),
        ({"recipe": "    parameters: [1]"}, "line 14: recipes[1].parameters: seen [1], expected keys with values"),
        (
            {"recipe": "  - {name: c}"},
            "line 14: recipes[2].number: is missing. Add it (Number by which triggers name it)",
        ),
        ({"recipe": "  - 7"}, "line 14: recipes[2]: seen 7, expected keys with values"),
        ({"recipe": "    roi_px: [a, 0, 9, 9]"}, "line 14: recipes[1].roi_px[0]: seen 'a', expected a number"),
        ({"recipe": "    margin_mm: 2"}, "calibration is missing: a recipe's margin_mm needs millimetres"),
        ({"recipe": "    start: [0, 0]"}, "calibration is missing: a recipe's start needs millimetres"),
    ],
)
def test_a_mistake_names_line_and_key_and_says_what_is_expected(
    tmp_path: Path, change: dict[str, str], expected: str
) -> None:
    text = told(tmp_path, **change)
    assert expected in text
    for words in ("Input", "Field", "valid ", "dictionary", "tuple", "literal"):
        assert words not in text


def test_two_mistakes_are_two_lines_in_the_order_of_the_file(tmp_path: Path) -> None:
    lines = told(tmp_path, camera="  average: 0", recipe="    max_vertices: 1").splitlines()
    assert [line.split(":")[0] for line in lines] == ["line 4", "line 14"]
