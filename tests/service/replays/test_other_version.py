"""What another version is asked with does not presume that it knows what this one does."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from service.config.recipes import Recipe
from service.records.archived_job import load_archived
from service.records.evidence import EvidenceError
from service.records.replay import Settings
from service.replays import other_version
from service.replays.against import OtherVersion, OtherVersionError
from service.replays.errors import ReplayError
from tests.support.service.archives import changed_document, write_archive


@pytest.fixture
def archive(tmp_path: Path) -> Path:
    write_archive(tmp_path / "cell-7", 2)
    return tmp_path / "cell-7"


def asked(archive: Path, **changes: Any) -> dict[str, Any]:
    defaults = Recipe(number=1, name="-").model_dump(mode="json")
    known = {"archive": str(archive), "job_id": 1, "recipe": {}, "limits": {}, "calibration": None}
    return {**known, "defaults": defaults, **changes}


def with_recipe(archive: Path, **changes: object) -> None:
    changed_document(archive, 1, recipe={**load_archived(archive, 1).document["recipe"], **changes})


def test_it_measures_what_the_archive_says(archive: Path) -> None:
    found = other_version.measured(asked(archive))
    assert found["codes"] == []
    assert found["kept"]["millimetres"] == load_archived(archive, 1).document["measurement"]["millimetres"]
    refused = other_version.measured(asked(archive, recipe={"max_area_mm2": 1000}))
    assert refused["codes"] == [112]


def test_what_it_does_not_know_is_left_out_where_it_is_a_default(archive: Path) -> None:
    before = other_version.measured(asked(archive))["kept"]["millimetres"]
    envelope = load_archived(archive, 1).document["envelope"]
    changed_document(archive, 1, envelope={**envelope, "field_of_a_later_version": 7})
    with_recipe(archive, glow=False, edge="of a later version")
    defaults = {**asked(archive)["defaults"], "glow": False, "edge": "of a later version"}
    assert other_version.measured(asked(archive, defaults=defaults))["kept"]["millimetres"] == before


def test_what_it_does_not_know_and_somebody_set_is_an_error(archive: Path) -> None:
    with_recipe(archive, glow=True)
    with pytest.raises(EvidenceError, match=r"recipe\.glow"):
        other_version.measured(asked(archive, defaults={"glow": False}))


def environment(folder: Path, script: str) -> Path:
    python = folder / "bin" / "python"
    python.parent.mkdir(parents=True)
    python.write_text(f"#!/bin/sh\n{script}\n")
    python.chmod(0o755)
    return folder


def test_an_environment_without_combtrace_says_why_it_cannot_be_started(tmp_path: Path) -> None:
    with pytest.raises(ReplayError, match="no combtrace that could be started there: No module named combtrace"):
        OtherVersion(environment(tmp_path, 'echo "No module named combtrace" >&2'))


def test_one_that_ends_is_told_with_its_last_words(tmp_path: Path) -> None:
    first = '{"combtrace": "0.0.9", "numpy": "1", "opencv": "4"}'
    with (
        OtherVersion(environment(tmp_path, f"echo '{first}'; read line; echo out of memory >&2")) as other,
        pytest.raises(OtherVersionError, match="the other version has ended: out of memory"),
    ):
        other.measured(tmp_path, 1, Settings())
