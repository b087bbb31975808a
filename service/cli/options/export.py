"""The exports of `combtrace trace`: --dxf, --svg, --geojson, --gcode."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from service.cli.errors import UserError
from service.cli.file_names import distinct_stems, make_folder, output_path
from service.export.forms import ENDINGS

if TYPE_CHECKING:
    from service.config.recipes import Recipe
    from service.export.gcode import GcodeSettings
    from service.measuring.measurement import Measurement


def add_export_arguments(parser: argparse.ArgumentParser) -> None:
    """One option a form."""
    for form, ending in ENDINGS.items():
        parser.add_argument(
            f"--{form}",
            type=output_path,
            metavar="FILE",
            help=f"accepted contour in mm, with the part in it, .{ending}; a folder for several images",
        )


@dataclass(frozen=True)
class Exports:
    """Where the contours of accepted pictures go. paths: form, and the file of each picture."""

    paths: tuple[tuple[str, dict[Path, Path]], ...] = ()
    gcode: GcodeSettings | None = None

    @classmethod
    def of(cls, args: argparse.Namespace, recipe: Recipe, *, calibrated: bool) -> Exports:
        """By the arguments; raise UserError, also where there is no calibration to give millimetres."""
        from service.export.document import ExportError
        from service.export.recipe_exports import gcode_settings

        given = [(form, getattr(args, form)) for form in ENDINGS if getattr(args, form) is not None]
        if given and not calibrated:
            raise UserError(f"--{given[0][0]}: exports are in mm; name the calibration by --calibration or --config")
        paths = []
        for form, path in given:
            folder = args.several or path.is_dir()
            if folder:
                make_folder(f"--{form}", path)
                files = {image: path / f"{stem}.{ENDINGS[form]}" for image, stem in distinct_stems(args.images).items()}
            else:
                files = {args.images[0]: path}
            paths.append((form, files))
        try:
            return cls(tuple(paths), gcode_settings(recipe))
        except ExportError as error:
            raise UserError(str(error)) from error

    @property
    def outputs(self) -> list[tuple[str, Path]]:
        """Each file, by its option."""
        return [(f"--{form}", file) for form, files in self.paths for file in files.values()]

    def write(self, image: Path, measurement: Measurement) -> list[str]:
        """Write what is asked for, and say where; a refused contour is not written, and an older file stays."""
        gcode = self.gcode
        if not self.paths or gcode is None:
            return []
        from service.export.document import ExportError
        from service.export.files import exported, write_export
        from service.export.recipe_exports import document_of

        document = document_of(measurement, image.name)
        if document is None:
            return ["refused: nothing exported, files of before are as they were"]
        told = []
        for form, files in self.paths:
            file = files[image]
            try:
                write_export(file, exported(form, document, lambda: gcode))
            except ExportError as error:
                raise UserError(f"--{form}: {error}") from error
            told.append(str(file))
        return told
