"""Pictures of a gauge for `combtrace accept`: of files, or of the camera, which a person is led through."""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING

from service.cli.errors import UserError

if TYPE_CHECKING:
    from drivers.camera import Camera
    from service.certifying.sight import Eye, Sight
    from service.config.config import Config


def from_files(images: list[Path], eye: Eye) -> list[Sight]:
    """A sight for each picture, each told."""
    from service.certifying.sight import served

    sights = looked_at(images, eye)
    _, left = served(sights)
    refused = {sight.name: sight.refused for sight in left}
    for number, sight in enumerate(sights, 1):
        tell(f"picture {number} of {len(sights)}: {sight.name}: {_seen(sight, refused.get(sight.name))}")
    return sights


def looked_at(images: list[Path], eye: Eye) -> list[Sight]:
    """A sight for each picture, by the file's name, or its path where two have one name; raise UserError."""
    from drivers.camera import CameraError
    from drivers.camera.files.decode import read_picture

    names = Counter(image.name for image in images)
    sights = []
    for image in images:
        try:
            picture = read_picture(image)
        except CameraError as error:
            raise UserError(f"{image}: {str(error).removeprefix(f'{image}: ')}") from error
        sights.append(eye.look(picture, image.name if names[image.name] == 1 else str(image)))
    return sights


def from_camera(args: argparse.Namespace, config: Config, eye: Eye, height_mm: float) -> list[Sight]:
    """Sights of frames, until nothing is missing or standard input ends; every frame is kept."""
    from service.certifying.guide import plan, still_missing, told
    from service.certifying.sight import served
    from service.cli.options.camera import opened_camera
    from service.wiring.devices import make_camera
    from service.wiring.errors import WiringError

    if args.config is None:
        raise UserError("name pictures, or --config FILE: it names the camera")
    if args.keep.is_dir() and any(args.keep.glob("*.png")):
        raise UserError(
            f"--keep {args.keep}: holds pictures already. Name another folder for new ones, or this one as "
            "pictures, to use those"
        )
    try:
        camera = make_camera(config)
    except WiringError as error:
        raise UserError(str(error)) from error
    sights: list[Sight] = []
    tell(plan(args.places))
    with opened_camera(args, camera):
        while True:
            kept, left = served(sights)
            if sights:
                refused = next((one.refused for one in left if one.name == sights[-1].name), None)
                tell(f"{sights[-1].name}: {_seen(sights[-1], refused)}")
            lack = still_missing(kept, eye, height_mm, args.places)
            if lack.nothing:
                return sights
            tell(f"missing: {told(lack)}")
            tell("lay the gauge and press Enter; Ctrl-D ends")
            if not sys.stdin.readline():
                return sights
            sights.append(_grabbed(camera, args.keep, eye))


def _grabbed(camera: Camera, folder: Path, eye: Eye) -> Sight:
    """The sight of the next frame, which is kept under a name that no other has."""
    import time

    from service.records.pictures import PictureFileError, write_picture

    frame = camera.grab(time.monotonic(), 5.0)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        number = 1 + max(
            (int(one.stem[6:]) for one in folder.glob("place-*.png") if one.stem[6:].isdecimal()), default=0
        )
        path = folder / f"place-{number:03d}.png"
        write_picture(path, frame.pixels)
    except (OSError, PictureFileError) as error:
        raise UserError(f"--keep {folder}: the picture cannot be kept: {error}. Name another folder") from error
    return eye.look(frame.pixels, path.name, frame.camera)


def _seen(sight: Sight, refused: str | None) -> str:
    if refused is not None or sight.gauge is None:
        return f"refused: {refused or sight.refused}"
    return f"serves, {len(sight.gauge.lengths)} lengths"


def tell(text: str) -> None:
    """To standard error: standard output may carry JSON."""
    print(text, file=sys.stderr, flush=True)
