"""What a person reads who has made a mistake in config.yaml: the line, the key, and words of our own."""

from __future__ import annotations

from pathlib import Path

import pytest

from service.config.config_file import ConfigError, load_config

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
        (
            {"recipe": "telemetry: {node: a, page_url: 'ftp://x'}"},
            "page_url: seen 'ftp://x', expected text of the form",
        ),
        ({"recipe": "  - yes"}, "line 14: recipes[2]: seen true, as yes and on are read, expected keys with values"),
        ({"recipe": "    parameters: [1]"}, "line 14: recipes[1].parameters: seen [1], expected keys with values"),
        (
            {"recipe": "  - {name: c}"},
            "line 14: recipes[2].number: is missing. Add it (Number by which triggers name it)",
        ),
        ({"recipe": "  - 7"}, "line 14: recipes[2]: seen 7, expected keys with values"),
        ({"recipe": "    roi_px: [a, 0, 9, 9]"}, "line 14: recipes[1].roi_px[0]: seen 'a', expected a number"),
        ({"recipe": "    margin_mm: 2"}, "calibration is missing: a recipe's margin_mm needs millimetres"),
        ({"recipe": "    start: [0, 0]"}, "calibration is missing: a recipe's start needs millimetres"),
        ({"recipe": "    max_bridged_mm: 5"}, "calibration is missing: a recipe's max_bridged_mm needs millimetres"),
    ],
)
def test_a_mistake_names_line_and_key_and_says_what_is_expected(
    tmp_path: Path, change: dict[str, str], expected: str
) -> None:
    text = told(tmp_path, **change)
    assert expected in text
    for words in ("Input", "Field", "valid ", "dictionary", "tuple", "literal"):
        assert words not in text


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("camera:\n\tkind: files\n", "line 2, column 1: a tab; indent by spaces"),
        ("camera:\n  kind: files\n path: x\n", "line 3, column 2: indented otherwise than line 1, where its section"),
        ("camera:\n  kind: files\n   path: x\n", "line 3, column 8: a colon where none can stand"),
        ("camera: {kind: files\ncontroller: {kind: none}\n", "line 2, column 11: the bracket opened in line 1 is not"),
        ("camera: {kind: files}}\n", "line 1, column 22: the bracket } closes none"),
        ("camera: {kind: files,, path: x}\n", "line 1, column 22: a value is missing before ,"),
        ("log: {level: 'info}\n", "line 2, column 1: the quote opened in line 1 is not closed"),
        ('camera: {path: "C:\\Users\\x"}\n', "line 1, column 21: in double quotes a \\ begins a character's code"),
        ("triggers: - kind: interval\n", "line 1, column 11: a list's dash where none can stand"),
        ("camera: @home\n", "line 1, column 9: text that begins with @ has to be put in quotes"),
        ("camera: !home\n", "line 1, column 9: text that begins with ! has to be put in quotes"),
        ("camera: &a [*a]\n", "line 1, column 9: refers to itself"),
        ("a: 1\n---\nb: 2\n", "line 2, column 1: goes on after its end"),
        ("log: | info\n", "line 1, column 8: after | or > text begins on the next line"),
        ("a: 1\nb: \x07\n", "line 2: holds a control character (code 7)"),
        ("a: " + "[" * 2000 + "]" * 2000 + "\n", "brackets are nested too deeply"),
        ("a: " + "9" * 5000 + "\n", "line 1, column 4: a number of 5000 digits"),
        ('a: "\\UFFFFFFFF"\n', "holds the code of a character"),
        ("controller: {port: 5:20}\n", "line 1, column 20: 5:20 is no plain number"),
        ("camera = files\n", "holds 'camera = files' and no keys, expected keys such as camera: and controller:"),
        (": x\n", "line 1, column 1: a colon without a key before it"),
    ],
)
def test_what_the_yaml_library_finds_is_told_in_words_of_our_own(tmp_path: Path, text: str, expected: str) -> None:
    path = tmp_path / "config.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError) as error:
        load_config(path)
    assert str(error.value).startswith(f"{path}: {expected}")


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        (
            "page: yes",
            "line 14: page: seen true, as yes and on are read, expected keys with values (The operator's page",
        ),
        ("log: {format: off}", "line 14: log.format: seen false, as no and off are read, expected one of text, json"),
        ("1: 2", "line 14: 1: unknown key, expected one of adopted_recipes, archive"),
        ("null: 2", "line 14: null: unknown key, expected one of adopted_recipes, archive"),
        ("log:{format: json}", "line 14: log:{format: unknown key, and a space is missing after its colon"),
        ("default_recipe: 2026-01-01", "seen the date 2026-01-01, expected a whole number"),
        ("service: {state_dir: ~/var}", "service.state_dir: is '~/var', and ~ is no folder here. Write the whole path"),
        ("metrics: {host: 'http://cell'}", "metrics.host: is 'http://cell', expected a host name or address and noth"),
        ("metrics: {host: '10.0.0.1:80'}", "metrics.host: is '10.0.0.1:80', expected a host name or address and noth"),
        ("metrics: {host: '[::1]'}", "metrics.host: is '[::1]', expected a host name or address and nothing else"),
    ],
)
def test_what_is_written_where_something_else_is_expected_is_named_with_its_line(
    tmp_path: Path, line: str, expected: str
) -> None:
    assert expected in told(tmp_path, recipe=line)


@pytest.mark.parametrize("host", ["::1", "fe80::1%eth0", "10.0.0.1", "plc-7.local", "plc_7", "0.0.0.0"])
def test_names_and_addresses_are_hosts(tmp_path: Path, host: str) -> None:
    path = tmp_path / "config.yaml"
    path.write_text(FILE.format(camera="", period="1", recipe=f"metrics: {{host: '{host}'}}"))
    metrics = load_config(path).metrics
    assert metrics is not None
    assert metrics.host == host


def test_two_mistakes_are_two_lines_in_the_order_of_the_file(tmp_path: Path) -> None:
    lines = told(tmp_path, camera="  average: 0", recipe="    max_vertices: 1").splitlines()
    assert [line.split(":")[0] for line in lines] == ["line 4", "line 14"]
