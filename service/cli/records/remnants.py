"""`combtrace remnants`: what is left of blocks that were cut, and which of it holds a part."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from service.cli.errors import EXIT_OK, EXIT_REFUSED, UserError
from service.cli.file_names import output_path
from service.cli.options.part import add_part_arguments, with_part
from service.config.plain_recipe import PlainRecipe

if TYPE_CHECKING:
    from service.config.recipes import PartToCut
    from service.parts.fit import PartFit
    from service.records.remnants import Remnant, Remnants

HELP = "list what is left of blocks, and find what holds a part"
DESCRIPTION = """\
List the remnants that are there: the pieces that were left of blocks once their parts
were cut out, kept by the daemon (`remnants` in the configuration) or by
`combtrace fit --remnants`. With --fits, those into which a part fits, the smallest
first, with its pose in the frame in which the piece was cut.

Exit status: 0 done; 3 with --fits: the part fits into none; 2 unusable input or usage."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which list, and what is asked of it."""
    parser.add_argument("--config", type=Path, default=Path("config.yaml"), metavar="FILE", help="default config.yaml")
    parser.add_argument("--file", type=Path, metavar="FILE", help="the list itself, instead of the configuration's")
    parser.add_argument("--fits", dest="part", type=Path, metavar="PART", help="only those that hold this drawing")
    add_part_arguments(parser, name_the_part=False)
    parser.add_argument("--used", type=int, metavar="N", help="note that remnant N was taken")
    parser.add_argument("--picture", nargs=2, metavar=("N", "FILE"), help="write the picture of remnant N (JPEG)")
    parser.add_argument("--all", action="store_true", help="also those that were taken")
    parser.add_argument("--json", action="store_true", help="JSON Lines, one object a remnant")


def run(args: argparse.Namespace) -> int:
    """List, search, take or show."""
    from service.records.remnants import RemnantsError

    remnants = _list_of(args)
    try:
        if args.picture is not None:
            return _write_picture(remnants, *args.picture)
        if args.used is not None:
            remnants.take(args.used)
            return EXIT_OK
        found = remnants.all(used=args.all)
    except RemnantsError as error:
        raise UserError(str(error)) from error
    if args.part is None:
        _tell([(one, None) for one in found], as_json=args.json)
        return EXIT_OK
    fitting = _fitting(found, args)
    _tell(fitting, as_json=args.json)
    return EXIT_OK if fitting else EXIT_REFUSED


def _list_of(args: argparse.Namespace) -> Remnants:
    from service.config.config_file import ConfigError, load_config
    from service.records.remnants import Remnants

    if args.file is not None:
        if not args.file.is_file():
            raise UserError(f"--file {args.file}: there is no such list")
        return Remnants(args.file)
    try:
        config = load_config(args.config)
    except ConfigError as error:
        raise UserError(str(error)) from error
    if config.remnants is None:
        raise UserError(f"{args.config}: remnants are not kept. Set remnants, or name a list by --file")
    return Remnants(config.remnants.path)


def _fitting(found: Sequence[Remnant], args: argparse.Namespace) -> list[tuple[Remnant, PartFit | None]]:
    """Those that hold the part, the smallest first: what is large is kept for what is large."""
    from service.measuring.part_trial import PartTrial
    from service.parts.fit import fit_part
    from service.parts.part import PartFileError
    from service.parts.sure_block import SureBlock

    recipe = with_part(PlainRecipe(), args)
    asked: PartToCut | None = recipe.part
    assert asked is not None
    try:
        part = PartTrial().part_of(asked)
    except PartFileError as error:
        raise UserError(str(error)) from error
    pairs: list[tuple[Remnant, PartFit | None]] = []
    for one in sorted(found, key=lambda remnant: remnant.area_mm2):
        block = SureBlock.of(one.contour, one.bound_mm)
        fit = None if block is None else fit_part(part, block, asked)
        if fit is not None and fit.fits:
            pairs.append((one, fit))
    return pairs


def _tell(found: Sequence[tuple[Remnant, PartFit | None]], *, as_json: bool) -> None:
    for one, fit in found:
        if as_json:
            print(json.dumps(_record(one, fit), ensure_ascii=False))
            continue
        low, high = one.contour.exterior.min(axis=0), one.contour.exterior.max(axis=0)
        box = f"{high[0] - low[0]:.0f} x {high[1] - low[1]:.0f} mm"
        size = f"{box}, {one.area_mm2:.0f} mm², {one.thickness_mm:g} mm high"
        taken = "" if one.used_at is None else f", taken {one.used_at}"
        print(f"{one.number:5d}  {size}, of {one.source}{taken}" + ("" if fit is None else f": {fit.sentence}"))
    if not found and not as_json:
        print("none", file=sys.stderr)


def _record(one: Remnant, fit: PartFit | None) -> dict[str, Any]:
    rings = [ring.tolist() for ring in one.contour.rings]
    return {
        "number": one.number,
        "source": one.source,
        "made_at": one.made_at,
        "used_at": one.used_at,
        "thickness_mm": one.thickness_mm,
        "uncertainty_mm": one.bound_mm,
        "area_mm2": one.area_mm2,
        "millimetres": {"exterior": rings[0], "holes": rings[1:]},
        **({} if fit is None else {"fit": fit.fields()}),
    }


def _write_picture(remnants: Remnants, number: str, file: str) -> int:
    if not number.isdigit():
        raise UserError(f"--picture {number}: expected a remnant's number, then a file")
    picture, path = remnants.picture(int(number)), output_path(file)
    try:
        path.write_bytes(picture)
    except OSError as error:
        raise UserError(f"{path}: cannot be written: {error.strerror}. Name another file") from error
    return EXIT_OK
