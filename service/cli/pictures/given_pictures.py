"""Pictures named on a command line, each by itself or all of a folder."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from service.cli.errors import UserError


def add_pictures_argument(parser: argparse.ArgumentParser, *, what: str, needed: bool = True) -> None:
    """The pictures; a folder stands for those in it."""
    parser.add_argument(
        "images", nargs="+" if needed else "*", type=Path, metavar="IMAGE", help=f"{what}; a folder: all in it"
    )


def pictures_of(given: list[Path]) -> list[Path]:
    """The files that were named, a folder as its pictures in the order that people sort them; raise UserError.

    What else lies in a folder is passed over and counted on standard error; its folders are not entered.
    """
    pictures = []
    for path in given:
        if not path.is_dir():
            pictures.append(path)
            continue
        found, others = pictures_in(path)
        passed_over = f", {others} other files are passed over" if others > 0 else ""
        print(f"{path}: {len(found)} pictures{passed_over}", file=sys.stderr)
        pictures += found
    return pictures


def pictures_in(folder: Path) -> tuple[list[Path], int]:
    """The folder's pictures in the order that people sort them, and how many other files it holds; raise UserError."""
    from drivers.camera.files.folder import is_video, list_versions, natural_order

    try:
        pictures = [one.path for one in natural_order(list_versions(folder)) if not is_video(one.path)]
        others = sum(not path.is_dir() and not path.name.startswith(".") for path in folder.iterdir()) - len(pictures)
    except OSError as error:
        raise UserError(f"{folder}: cannot be looked into: {error.strerror}. Name another folder") from error
    if not pictures:
        held = f"{others} other files" if others > 0 else "nothing"
        raise UserError(f"{folder}: holds no picture, but {held}. Name a folder of .png, .jpg or other picture files")
    return pictures, others
