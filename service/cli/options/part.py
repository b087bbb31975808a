"""The part that a command lays into blocks: a recipe's, or one of the command line."""

from __future__ import annotations

import argparse
import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any

from service.cli.errors import UserError
from service.config.plain_recipe import PlainRecipe

if TYPE_CHECKING:
    from service.config.recipes import AnyRecipe, PartToCut

_KEYS = {
    "part": "file",
    "part_units": "units",
    "part_layer": "layer",
    "margin_mm": "margin_mm",
    "rotation": "rotation",
    "ribbon_angle_deg": "ribbon_angle_deg",
    "ribbon_from_picture": "ribbon_from_picture",
    "ribbon_tolerance_deg": "ribbon_tolerance_deg",
}
"""Options, and the keys of a recipe's `part` that they change."""


def add_part_arguments(parser: argparse.ArgumentParser, *, name_the_part: bool = True) -> None:
    """The part's file, but where it is named otherwise, and how it may lie."""
    if name_the_part:
        parser.add_argument(
            "--ribbon-from-picture",
            action=argparse.BooleanOptionalAction,
            help="read it from the picture; --ribbon-angle-deg where that does not tell",
        )
        of_recipe = "drawing: .dxf, .svg, .geojson; default the recipe's"
        parser.add_argument("--part", type=Path, metavar="FILE", help=of_recipe)
    parser.add_argument("--part-units", choices=("um", "mm", "cm", "m", "in"), help="where the drawing says none")
    parser.add_argument("--part-layer", metavar="NAME", help="only this layer of the drawing")
    parser.add_argument(
        "--margin-mm", type=float, metavar="MM", help="least distance to the block's edge, besides its bound"
    )
    parser.add_argument(
        "--rotation", type=_rotation, metavar="free|fixed|N", help="turns; N = equal steps; default free"
    )
    parser.add_argument(
        "--ribbon-angle-deg", type=float, metavar="DEG", help="core's ribbon: the drawing's x axis lies along it"
    )
    parser.add_argument("--ribbon-tolerance-deg", type=float, metavar="DEG", help="within so much; default 2")


def with_part(recipe: AnyRecipe, args: argparse.Namespace) -> AnyRecipe:
    """The recipe with the part of the command line, or its own as changed there; raise UserError."""
    from pydantic import ValidationError

    from service.config.mistakes import describe
    from service.config.recipes import PartToCut

    given = {key: value for option, key in _KEYS.items() if (value := getattr(args, option, None)) is not None}
    if recipe.parts and not given:
        return recipe
    own: dict[str, Any] = {} if recipe.part is None else recipe.part.model_dump()
    if "file" in given:  # its unit and layer are its own, too
        own = {key: value for key, value in own.items() if key not in ("units", "layer")}
    if "file" not in given and not own:
        raise UserError("which part? Name its drawing by --part, or a recipe that has one by --config and --recipe")
    try:
        part: PartToCut = PartToCut.model_validate({**own, **given})
    except ValidationError as error:
        raise UserError("part: " + "; ".join(describe(error, PartToCut))) from error
    if isinstance(recipe, PlainRecipe):
        return dataclasses.replace(recipe, part=part)
    return recipe.model_copy(update={"part": part, "parts": ()})


def _rotation(text: str) -> str | int:
    return text if text in ("free", "fixed") else int(text)
