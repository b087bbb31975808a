"""Run by the interpreter of another version of combtrace, not imported: measures jobs as that version does.

A line of JSON in, a line out; the first line out says which versions are at work. It keeps to names that versions have
in common, and knows nothing of the version that asks. Argument: a wheel, else what is installed is asked.
"""

from __future__ import annotations

import dataclasses
import importlib.metadata
import json
import sys
import zipfile
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any


def measured(asked: dict[str, Any]) -> dict[str, Any]:
    """Why the job is refused, by code, and what was measured."""
    from drivers.controller.errors import ContourTooLarge, MailboxError
    from service.link.contour_message import Envelope, contour_pages
    from service.reasons import Reason
    from service.records.archived_job import load_archived, recipe_with
    from service.records.evidence import measurement_fields

    archived = load_archived(Path(asked["archive"]), asked["job_id"])
    document, settings = archived.document, asked["recipe"]
    _leave_out_later(document["recipe"], asked["defaults"])
    recipe = recipe_with(archived, settings)
    thickness_mm = recipe.thickness_mm if "thickness_mm" in settings else document["thickness_mm"]
    calibration = None if asked["calibration"] is None else Path(asked["calibration"])
    measurer = archived.measurer(calibration, asked["limits"])
    seen = measurer.measure(archived.frame(), recipe, thickness_mm, document["frame"]["camera"])
    codes = [int(reason) for reason in seen.reasons]
    kept = document["envelope"]
    if kept is not None and not codes and seen.millimetres is not None:
        known = {one.name for one in dataclasses.fields(Envelope)}  # a later version's may have more
        try:
            contour_pages(seen, Envelope(**{name: kept[name] for name in known if name in kept}))
        except ContourTooLarge:
            codes = [int(Reason.TOO_MANY_POINTS)]
        except MailboxError:
            codes = [int(Reason.SELF_INTERSECTING)]
    return {"codes": codes, "kept": measurement_fields(seen)}


def _leave_out_later(recipe: dict[str, Any], defaults: dict[str, Any]) -> None:
    """Take out what this version does not know where it says no more than a default: its own then counts."""
    from pydantic import ValidationError

    from service.config.recipes import Recipe

    try:
        Recipe.model_validate(recipe)
    except ValidationError as error:
        for key in {mistake["loc"][0] for mistake in error.errors()}:
            if key in recipe and recipe[key] == defaults.get(key):
                del recipe[key]


def main() -> None:
    """Answer until nobody asks, with what a wheel has before what is installed, where one is named."""
    with TemporaryDirectory(
        prefix="combtrace-other-"
    ) as folder:  # goes with this process, also where the asker is killed
        for wheel in sys.argv[1:]:
            zipfile.ZipFile(wheel).extractall(folder)
            sys.path.insert(0, folder)
        answer_all()


def answer_all() -> None:
    """Say which versions are at work, then a line for each line."""
    import cv2
    import numpy

    cv2.setNumThreads(1)
    versions = {"combtrace": importlib.metadata.version("combtrace"), "numpy": numpy.__version__}
    print(json.dumps({**versions, "opencv": cv2.__version__}), flush=True)
    for line in sys.stdin:
        try:
            answer = measured(json.loads(line))
        except Exception as error:  # noqa: BLE001 - of whatever kind that version has; who asked counts and tells it
            answer = {"error": f"{type(error).__name__}: {error}"}
        print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    main()
