"""`combtrace accept` on a rendered cell: what passes, what is found, what is refused, and what the certificate says."""

from __future__ import annotations

import io
import json
import re
import shutil
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from contour.calibration.calibration import SimpleCalibration
from contour.length_test.verdict import Limit
from service.certifying.earlier import EarlierError, compared, read_earlier
from service.certifying.gauge_file import BlockFile, BoardEntry, CornersEntry, PlateFile, read_gauge
from service.certifying.sight import Sight, served
from service.certifying.trial import NotCertified, check_able, studied
from service.cli.main import main
from tests.support.service.gauge_trials import (
    HEIGHT_MM,
    PlateTrial,
    certificate,
    circumstances,
    seen,
    stored,
)


@pytest.fixture(scope="module")
def folder(trial: PlateTrial, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return stored(trial, tmp_path_factory.mktemp("cell"))


@pytest.fixture(scope="module")
def last(folder: Path) -> dict[str, Any]:
    """The JSON of the first certificate, which the command wrote beside its page."""
    words = ["--operator", "Anna", "--cell", "cell 3", "--json", str(folder / "last.json"), "--language", "ru"]
    assert main(["accept", str(folder / "pictures"), *options(folder), *words]) == 0
    return dict(json.loads((folder / "last.json").read_text()))


def options(folder: Path) -> list[str]:
    named = {"gauge": "plate.yaml", "calibration": "calibration.yaml", "output": "certificate.html"}
    return [word for name, file in named.items() for word in (f"--{name}", str(folder / file))]


# --- what it decides --------------------------------------------------------------------------------------------------


def test_a_good_cell_passes_with_all_that_other_programs_rely_on(last: dict[str, Any]) -> None:
    relied_on = ("passes", "limit_mm", "largest_error_mm", "lengths", "form_error_mm", "uncertainty_mm")
    assert {*relied_on, "calibration_hash", "version"} <= set(last)
    assert last["passes"] is True
    assert last["decision"] == "passes"
    assert last["limit_mm"] == 0.1
    assert abs(last["largest_error_mm"]) + last["uncertainty_mm"] < 0.1
    assert len(last["lengths"]) == 30
    assert {entry["decision"] for entry in last["lengths"]} == {"passes"}
    assert last["marks_largest_px"] < 0.5
    assert last["against"] is None
    assert all(len(picture["pixels_hash"]) == 71 for picture in last["pictures"])


# --- what does not serve ----------------------------------------------------------------------------------------------


def test_pictures_that_do_not_serve_are_named_with_their_reason(trial: PlateTrial, tmp_path: Path) -> None:
    cut = trial.pictures[2].copy()
    x, y, _ = trial.spots[2]
    cut[:, int(trial.cell.camera.project(np.array([[x, y]]), HEIGHT_MM)[0, 0]) :] = 90
    empty = np.full_like(cut, 90)
    shown = [trial.pictures[0], trial.pictures[1], cut, empty, trial.pictures[0], empty[:100]]
    _, _, sights = seen(trial.told, trial.record, shown, tmp_path)
    sights[1] = replace(sights[1], edge_px=3 * (sights[0].edge_px or 0.0))
    kept, left = served(sights)
    assert [sight.name for sight in kept] == ["p0"]
    reasons = {sight.name: sight.refused for sight in left}
    assert "blurred: its edges spread over" in reasons["p1"]
    assert re.search("gauge is not whole|markers are seen|corners are seen", reasons["p2"])
    assert "no marker" in reasons["p3"]
    assert reasons["p4"] == "the gauge lies where it lay in p0. Move or turn it"
    assert "1280 x 100 px" in reasons["p5"]
    assert [sight.name for sight in served([sights[0], sights[4]], places_of_their_own=False)[0]] == ["p0", "p4"]


def test_too_few_positions_certify_nothing(
    folder: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path, last: dict[str, Any]
) -> None:
    before = (folder / "certificate.html").read_bytes()
    some = [str(folder / "pictures" / f"p{number}.png") for number in (0, 1)]
    assert main(["accept", *some, *options(folder), "--json", str(tmp_path / "none.json")]) == 2
    told = capsys.readouterr().err
    assert "too few positions: 2 of 2 pictures serve" in told
    assert "3 more places" in told
    assert "Nothing is certified" in told
    assert not (tmp_path / "none.json").exists()
    assert (folder / "certificate.html").read_bytes() == before


def test_a_gauge_that_is_nowhere_certifies_nothing(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    told = yaml.safe_load((folder / "plate.yaml").read_text())
    told["board"]["dictionary"] = "DICT_7X7_250"
    (folder / "other.yaml").write_text(yaml.safe_dump(told))
    words = ["--gauge", str(folder / "other.yaml"), "--calibration", str(folder / "calibration.yaml")]
    assert main(["accept", str(folder / "pictures" / "p0.png"), *words]) == 2
    assert "the gauge was found in none of 1 pictures; the first: p0.png: no marker" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("more", "expected"),
    [
        (["--limit-mm", "0.015"], "is sure to 0.0"),
        (["--limit-mm", "0"], "--limit-mm 0: expected a number above 0"),
        (["--places", "3"], "--places 3: expected 5 to 100"),
        (["--temperature-c", "293"], "--temperature-c 293: expected 0 to 60"),
        (["--limit-mm-per-m", "-1"], "--limit-mm-per-m -1: expected 0 or more"),
        (["--against", "plate.yaml"], "is no certificate"),
        (["--study", "anna"], "--study anna: expected OPERATOR=FOLDER"),
        (["--gauge", "none.yaml"], "none.yaml: cannot be read"),
    ],
)
def test_bad_options_are_one_clear_line(
    folder: Path, more: list[str], expected: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    assert main(["accept", "pictures/p0.png", *options(folder), *more]) == 2
    told = capsys.readouterr().err.splitlines()
    assert expected in told[-1]


def test_a_scale_that_is_not_known_at_the_gauges_height_certifies_nothing(trial: PlateTrial, tmp_path: Path) -> None:
    simple = replace(trial.record, calibration=SimpleCalibration(1280, 960, 0.4, (0.0, 960.0)), sentinels=None)
    _, guard, _ = seen(trial.told, simple, [], tmp_path)
    with pytest.raises(NotCertified, match=r"does not know the scale at .*, the height of the gauge's plane"):
        check_able(read_gauge(tmp_path / "gauge.yaml"), guard, Limit(0.1), None)


# --- the camera -------------------------------------------------------------------------------------------------------


def test_the_camera_is_led_through_the_places_and_its_pictures_are_kept(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    taken = tmp_path / "taken"
    shutil.copytree(folder / "pictures", taken)
    shutil.copy(taken / "p0.png", taken / "p0b.png")  # the gauge was not moved
    config = tmp_path / "config.yaml"
    named = {"camera": {"kind": "files", "path": str(taken)}, "controller": {"kind": "none"}}
    config.write_text(yaml.safe_dump({**named, "calibration": {"file": str(folder / "calibration.yaml")}}))
    kept = tmp_path / "kept"
    words = ["--gauge", str(folder / "plate.yaml"), "--config", str(config), "--keep", str(kept)]
    monkeypatch.setattr("sys.stdin", io.StringIO("\n" * 7))
    assert main(["accept", *words, "--output", str(tmp_path / "c.html")]) == 0
    told = capsys.readouterr().err
    assert told.count("lay the gauge and press Enter") == 6, "five places, and one that was none"
    assert "place-002.png: refused: the gauge lies where it lay in place-001.png" in told
    assert "missing: 5 more places" in told
    assert len(list(kept.glob("place-*.png"))) == 6
    again = ["accept", str(kept), "--gauge", str(folder / "plate.yaml"), "--config", str(config)]
    assert main([*again, "--output", str(tmp_path / "c.html")]) == 0, "kept pictures give it again"
    monkeypatch.setattr("sys.stdin", io.StringIO(""))
    assert main(["accept", *words]) == 2
    assert "holds pictures already. Name another folder" in capsys.readouterr().err
    assert main(["accept", *words[:-1], str(tmp_path / "new")]) == 2
    assert "the gauge was found in none of 0 pictures" in capsys.readouterr().err


# --- beside last year's, and by several people ------------------------------------------------------------------------


def test_last_years_certificate_stands_beside_this_one(
    folder: Path, last: dict[str, Any], tmp_path: Path, trial: PlateTrial
) -> None:
    words = ["--against", str(folder / "last.json"), "--json", str(tmp_path / "now.json"), "--temperature-c", "20"]
    people = [f"{name}={folder / 'pictures'}" for name in ("anna", "boris")]
    page = ["--output", str(tmp_path / "now.html")]
    words = [*options(folder), *page, *words, "--study", *people]
    assert main(["accept", str(folder / "pictures"), *words]) == 0
    now = json.loads((tmp_path / "now.json").read_text())
    assert now["against"]["number"] == last["number"]
    assert [entry["moved"] for entry in now["against"]["lengths"]] == [False] * 5
    assert now["study"]["operators"] == 2
    assert now["study"]["operators_mm"] == pytest.approx(0.0, abs=1e-9), "both laid it alike"
    text = (tmp_path / "now.html").read_text()
    assert f"Beside certificate {last['number']}" in text
    assert "<td>unchanged</td>" in text
    grown = certificate(trial.told, trial.record, trial.again(warmer_k=60.0), tmp_path)
    changes = compared(grown, read_earlier(folder / "last.json")).changes
    assert any(change.moved for change in changes)


def test_last_years_certificate_is_not_written_over(folder: Path, last: dict[str, Any]) -> None:
    earlier = str(folder / "last.json")
    for option in ("--json", "--output"):
        words = [*options(folder), "--against", earlier, option, earlier]
        assert main(["accept", str(folder / "pictures"), *words]) == 2
    assert json.loads((folder / "last.json").read_text()) == last


def test_a_certificate_with_a_number_that_is_none_is_no_certificate(last: dict[str, Any], tmp_path: Path) -> None:
    (tmp_path / "odd.json").write_text(json.dumps({**last, "limit_mm": float("nan")}))
    with pytest.raises(EarlierError, match=r"odd\.json: is no certificate: limit_mm: Input should be a finite number"):
        read_earlier(tmp_path / "odd.json")


def test_a_gauge_at_nought_degrees_is_in_the_command_that_repeats_it(folder: Path, tmp_path: Path) -> None:
    words = ["--json", str(tmp_path / "cold.json"), "--output", str(tmp_path / "cold.html"), "--temperature-c", "0"]
    main(["accept", str(folder / "pictures"), *options(folder), *words])
    assert "--temperature-c 0.0" in json.loads((tmp_path / "cold.json").read_text())["command"]


def test_a_study_of_unequal_numbers_or_of_a_picture_that_does_not_serve_is_refused(
    trial: PlateTrial, tmp_path: Path
) -> None:
    _, _, sights = seen(trial.told, trial.record, trial.pictures[:3], tmp_path)
    gauge, told = read_gauge(tmp_path / "gauge.yaml"), circumstances()
    with pytest.raises(NotCertified, match="anna 2, boris 1; expected as many"):
        studied(gauge, told, {"anna": sights[:2], "boris": sights[2:]})
    with pytest.raises(NotCertified, match="Name two operators or more"):
        studied(gauge, told, {"anna": sights})
    with pytest.raises(NotCertified, match="--study boris: dark does not serve: no light"):
        studied(gauge, told, {"anna": sights, "boris": [Sight("dark", "", refused="no light")]})


# --- the page ---------------------------------------------------------------------------------------------------------


def test_the_page_speaks_russian_and_tells_what_repeats_the_test(folder: Path, last: dict[str, Any]) -> None:
    text = (folder / "certificate.html").read_text()
    assert 'lang="ru"' in text
    assert "Выдержано: заявленный предел подтверждён." in text
    assert "соответствие им не заявляется" in text
    for told in ("Anna", "cell 3", "rendered", last["calibration_hash"], "G-plate", last["gauge"]["file_hash"]):
        assert told in text
    assert "combtrace accept --gauge plate.yaml --calibration calibration.yaml --places 5 pictures" in text
    assert text.count("<svg") == 3
    assert "http" not in text.replace("http-equiv", ""), "complete in itself"


def test_both_languages_have_the_same_texts_with_the_same_values() -> None:
    texts = json.loads((files("service.certifying") / "static" / "texts.json").read_text(encoding="utf-8"))
    english, russian = texts["en"], texts["ru"]
    assert list(english) == list(russian)
    values = re.compile(r"\{(\w+)\}")
    differing = [key for key in english if sorted(values.findall(english[key])) != sorted(values.findall(russian[key]))]
    assert differing == []
    code = "".join(path.read_text() for path in Path(str(files("service.certifying"))).glob("*.py"))
    made = {"passes", "fails", "undecided", "plate", "block", "dot_passes", "dot_fails", "dot_undecided", "says"}
    made |= {"cause_gauge", "cause_warmth", "cause_height", "by_stated", "by_recipe", "by_default"}
    assert [key for key in english if not re.search(rf"""["']{key}["']""", code) and key not in made] == []


def test_every_key_of_gauge_and_certificate_is_in_the_reference(last: dict[str, Any]) -> None:
    page = (Path(__file__).parents[3] / "docs" / "reference" / "certificates.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`(\w+)`", page))
    entries = {key for name in ("lengths", "forms", "planes", "pictures") for key in last[name][0]}
    models = (PlateFile, BlockFile, BoardEntry, CornersEntry)
    keys = {*last, *entries, *(key for model in models for key in model.model_fields)}
    assert sorted(keys - named) == []


def test_the_gauge_file_of_the_guide_is_one(tmp_path: Path) -> None:
    guide = (Path(__file__).parents[3] / "docs" / "how-to" / "acceptance.md").read_text(encoding="utf-8")
    (tmp_path / "gauge.yaml").write_text(guide.split("```yaml\n")[1].split("```")[0])
    assert len(read_gauge(tmp_path / "gauge.yaml").known) == 4
