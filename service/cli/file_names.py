"""Names for files that are made of pictures, one each, and never a picture's own."""

from __future__ import annotations

import argparse
import os
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path

from service.cli.errors import UserError

PICTURE_ENDINGS = (
    *(".png", ".jpg", ".jpeg", ".jpe", ".jp2", ".bmp", ".tif", ".tiff", ".webp", ".gif", ".avif"),
    *(".pgm", ".ppm", ".pbm", ".pnm", ".pam"),
)


def output_path(text: str) -> Path:
    """A file or folder by its name; one that ends in / is a folder, and made. For argparse."""
    path = Path(text)
    if text.endswith("/"):
        try:
            path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise argparse.ArgumentTypeError(
                f"{text}: cannot make the folder: {error.strerror}. Name another"
            ) from None
    return path


def make_folder(option: str, path: Path) -> None:
    """Make the folder that an option names; raise UserError."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"{option} {path}: cannot make the folder: {error.strerror}. Name another") from error


def check_outputs(images: Iterable[Path], outputs: Sequence[tuple[str, Path]], *, drawn: str = "--overlay") -> None:
    """Raise UserError where an output, of an option, would replace a picture that is read, or another option's output.

    Only the option `drawn` makes pictures: `--json *.jpg` names the first picture of a folder as the output.
    """
    pictures = {_identity(image) for image in images if os.path.exists(image)}
    options: dict[Path, str] = {}
    for option, path in outputs:
        if path.is_file() and _identity(path) in pictures:
            raise UserError(f"{option} {path}: is a file that is read. Name another file")
        if option != drawn and path.suffix.lower() in PICTURE_ENDINGS:
            raise UserError(f"{option} {path}: is called as a picture is, and holds none. Name another file")
        other = options.setdefault(path.resolve(), option)
        if other != option and not _is_device(path):
            raise UserError(f"{option} {path}: {other} has the same file. Name one for each")


def _identity(path: Path) -> tuple[int, int]:
    """The same for all names of one file."""
    status = path.stat()
    return status.st_dev, status.st_ino


def _is_device(path: Path) -> bool:
    return path.exists() and not path.is_file()


def distinct_stems(images: Sequence[Path]) -> dict[Path, str]:
    """A stem for each picture: its own where no other has it, else with as many of its folders as tell it apart.

    Pictures of one folder that differ in their suffix only keep it: `left-a`, `right-a`, `b.png`, `b.jpg`.
    """
    # Not resolved: two links to one file are two names, and each gets its own.
    whole = {image: Path(os.path.abspath(image)) for image in images}
    alike: dict[str, set[Path]] = {}
    for path in whole.values():
        alike.setdefault(path.stem, set()).add(path)
    stems = {
        path: stem if len(group) == 1 else _distinct(path, group) for stem, group in alike.items() for path in group
    }
    taken = Counter(stems.values())  # left-a.png may be called as left/a.png is told from right/a.png
    return {
        image: stems[path] if taken[stems[path]] == 1 else "_".join(path.parts[1:]) for image, path in whole.items()
    }


def _distinct(path: Path, group: set[Path]) -> str:
    """The name of a path that no other of the group has, with as few folders as possible."""
    with_suffix = Counter(other.with_suffix("") for other in group)[path.with_suffix("")] > 1
    own = path if with_suffix else path.with_suffix("")
    for depth in range(1, len(own.parts)):
        tail = own.parts[-depth:]
        others = (other if with_suffix else other.with_suffix("") for other in group if other != path)
        if all(other.parts[-depth:] != tail for other in others):
            return "-".join(tail)
    return "-".join(own.parts[1:])
