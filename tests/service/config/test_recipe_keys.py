"""A recipe's keys set one by one: within the model's own bounds, and never a name, a number or a path."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.config.recipe_keys import RecipeMistake, changes, settable, with_values
from service.config.recipes import Recipe

RECIPE = Recipe.model_validate(
    {"number": 1, "name": "sheet", "gcode": {"template": "t.ngc"}, "parts": [{"file": "a.dxf"}, {"file": "b.dxf"}]}
)


def test_every_key_may_be_set_but_names_paths_and_which_parts_there_are() -> None:
    keys = settable(RECIPE).keys()
    assert keys.isdisjoint({"number", "name", "part", "parts", "gcode.template", "parts.0.file"})
    assert keys >= Recipe.model_fields.keys() - {"number", "name", "part", "parts", "gcode"}
    assert keys >= {"gcode.feed_mm_min", "parts.0.quantity", "parts.1.margin_mm", "parameters"}


@given(st.floats(0, 100), st.floats(-1000, 1000), st.integers(1, 200), st.none() | st.floats(0, 10_000))
def test_what_is_set_is_what_differs_and_setting_it_back_gives_the_recipe(
    tolerance: float, margin: float, quantity: int, height: float | None
) -> None:
    values = {
        "tolerance_mm": tolerance,
        "margin_mm": margin,
        "parts.1.quantity": quantity,
        "gcode.safe_z_mm": height,
    }
    changed = with_values(RECIPE, values)
    assert settable(changed) == {**settable(RECIPE), **values}
    assert {key: after for key, (_, after) in changes(RECIPE, changed).items()} == {
        key: value for key, value in values.items() if settable(RECIPE)[key] != value
    }
    assert with_values(changed, settable(RECIPE)) == RECIPE


@pytest.mark.parametrize(
    ("values", "told"),
    [
        ({"tolerance_mm": -1}, "tolerance_mm: seen -1, expected 0 or more"),
        ({"tolerance_mm": 10**400}, "expected a number"),
        ({"tolerance_mm": True}, "expected a number"),
        ({"tolerance_mm": None}, "expected a number"),
        ({"gcode.feed_mm_min": float("inf")}, "expected a finite number"),
        ({"tolerence_mm": 1}, "unknown key; did you mean tolerance_mm?"),
        ({"gcode": {}}, "unknown key"),
        ({"parts.2.quantity": 1}, "unknown key"),
        ({"number": 2}, "in the configuration file alone"),
        ({"name": "b"}, "in the configuration file alone"),
        ({"part": None}, "in the configuration file alone"),
        ({"parts.0.file": "/etc/shadow"}, "in the configuration file alone"),
        ({"gcode.template": "/etc/shadow"}, "in the configuration file alone"),
        ({"parameters": {"core_px": 3}}, "is none of wall-tips's"),
        ({"roi_px": [1, 2, 3]}, "expected four numbers"),
        ({"exports": ["dxf", "exe"]}, "expected one of dxf"),
        ({"min_area_mm2": 5e6}, "expected less than max_area_mm2"),
    ],
)
def test_what_cannot_be_is_refused_with_its_key(values: dict[str, Any], told: str) -> None:
    with pytest.raises(RecipeMistake) as refused:
        with_values(RECIPE, values)
    assert told in str(refused.value)
    assert len(str(refused.value)) < 400
