"""Adopted recipes go before those of the configuration file, until these are changed there; nothing is half written."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from service.config.adopted_recipes import MOST_KEPT, AdoptedError, Word, keep_adopted, load_adopted
from service.config.config import Config
from service.config.config_file import ConfigError, load_config
from service.config.recipe_keys import with_values

WORD = Word("anna", "2026-11-23T12:00:00.000+00:00", "smaller sheets")
FILE = "adopted.json"


def written(folder: Path, recipe: str = "{number: 1, name: sheet}", more: str = "") -> Path:
    path = folder / "config.yaml"
    path.write_text(
        "camera: {kind: files, path: in}\ncalibration: {file: c.yaml}\ncontroller: {kind: none}\n"
        f"adopted_recipes: {FILE}\nrecipes: [{recipe}]\n{more}"
    )
    return path


def adopt(config: Config, **values: Any) -> tuple[int, Config]:
    """As the service does it: kept, then in force."""
    assert config.adopted_recipes is not None
    recipe = with_values(config.recipe(1), values)
    return keep_adopted(config.adopted_recipes, config, recipe, WORD), config.with_recipe(recipe)


def test_what_was_adopted_is_in_force_wherever_the_configuration_is_read(tmp_path: Path) -> None:
    path = written(tmp_path)
    first = load_config(path)
    number, config = adopt(first, margin_mm=2)
    assert (number, config.recipe(1).margin_mm) == (1, 2)
    again = load_config(path)
    assert again.recipe(1) == config.recipe(1)
    assert again.as_written(1) == first.recipe(1)
    assert adopt(again, tolerance_mm=0.3)[0] == 2
    kept = load_adopted(tmp_path / FILE).recipes[1].adoptions
    assert [one.changes for one in kept] == [{"margin_mm": (0.0, 2.0)}, {"tolerance_mm": (0.1, 0.3)}]
    recipe = load_config(path).recipe(1)
    assert (recipe.margin_mm, recipe.tolerance_mm) == (2, 0.3)


def test_who_changes_the_recipe_in_the_file_has_the_last_word(tmp_path: Path) -> None:
    adopt(load_config(written(tmp_path)), margin_mm=2)
    path = written(tmp_path, "{number: 1, name: sheet, tolerance_mm: 0.5}")
    config = load_config(path)
    assert (config.recipe(1).margin_mm, config.recipe(1).tolerance_mm) == (0, 0.5)
    assert load_config(written(tmp_path)).recipe(1).margin_mm == 2, "put back"
    adopt(load_config(written(tmp_path, "{number: 1, name: sheet, margin_mm: 2}")), max_vertices=50)
    copied = load_config(written(tmp_path, "{number: 1, name: sheet, margin_mm: 2}"))
    assert copied.recipe(1).max_vertices == 50, "adopted over what was copied into the file meanwhile"


def test_a_name_or_place_that_is_changed_in_the_file_ends_nothing(tmp_path: Path) -> None:
    adopt(load_config(written(tmp_path, "{number: 1, name: sheet, part: {file: a.dxf}}")), **{"part.margin_mm": 3})
    recipe = load_config(written(tmp_path, "{number: 1, name: plate, part: {file: b.dxf}}")).recipe(1)
    assert recipe.part is not None
    assert (recipe.name, recipe.part.margin_mm, recipe.part.file) == ("plate", 3, tmp_path / "b.dxf")


def test_keys_that_a_later_version_has_end_nothing(tmp_path: Path) -> None:
    path = written(tmp_path)
    adopt(load_config(path), margin_mm=2)
    content = json.loads((tmp_path / FILE).read_text())
    del content["recipes"]["1"]["over"]["budget_mm"], content["recipes"]["1"]["adoptions"][0]["values"]["budget_mm"]
    (tmp_path / FILE).write_text(json.dumps(content))
    assert load_config(path).recipe(1).margin_mm == 2


def test_a_recipe_that_is_gone_takes_its_adoption_with_it(tmp_path: Path) -> None:
    adopt(load_config(written(tmp_path)), margin_mm=2)
    assert load_config(written(tmp_path, "{number: 2, name: other}", "default_recipe: 2\n")).recipe(2).margin_mm == 0


def test_the_oldest_adoptions_are_let_go_and_numbers_go_on(tmp_path: Path) -> None:
    config = load_config(written(tmp_path))
    for turn in range(MOST_KEPT + 3):
        number, config = adopt(config, margin_mm=turn + 1)
    assert number == MOST_KEPT + 3
    assert [one.number for one in load_adopted(tmp_path / FILE).recipes[1].adoptions] == list(range(4, MOST_KEPT + 4))


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"{",
        b"[]",
        b'{"version": 2}',
        b'{"recipes": {"x": 1}}',
        b'{"recipes": {"1": {"over": {}, "adoptions": []}}}',
    ],
)
def test_a_file_that_is_none_is_told_with_the_next_step_and_the_configuration_is_not_used(
    tmp_path: Path, content: bytes
) -> None:
    path = written(tmp_path)
    (tmp_path / FILE).write_bytes(content)
    with pytest.raises(ConfigError, match=rf"{FILE}: is no file of adopted recipes .* move it away"):
        load_config(path)


def test_a_file_that_cannot_be_read_is_told(tmp_path: Path) -> None:
    path = written(tmp_path)
    (tmp_path / FILE).mkdir()
    with pytest.raises(ConfigError, match=rf"{FILE}: cannot be read: Is a directory"):
        load_config(path)


def test_what_was_adopted_and_can_no_longer_be_is_told(tmp_path: Path) -> None:
    path = written(tmp_path)
    adopt(load_config(path), margin_mm=2)
    path.write_text(path.read_text().replace("calibration: {file: c.yaml}\n", ""))
    with pytest.raises(ConfigError, match=r"recipe 1 cannot be as it was adopted: .*margin_mm needs millimetres"):
        load_config(path)


def test_what_is_damaged_is_not_written_over(tmp_path: Path) -> None:
    config = load_config(written(tmp_path))
    (tmp_path / FILE).write_bytes(b"half")
    with pytest.raises(AdoptedError):
        adopt(config, margin_mm=2)
    assert (tmp_path / FILE).read_bytes() == b"half"
