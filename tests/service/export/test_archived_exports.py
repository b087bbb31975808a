"""A recipe's exports beside the evidence of its jobs, through the whole daemon."""

from __future__ import annotations

from pathlib import Path

import ezdxf
import pytest

from service.cli.main import main

SAMPLES = Path(__file__).parents[3] / "service" / "samples"
CONFIG = """
camera: {{kind: files, path: {picture}}}
calibration: {{file: {samples}/calibration.yaml}}
controller: {{kind: none}}
recipes: [{{number: 1, name: default, thickness_mm: 20, exports: [dxf, svg, geojson, gcode], gcode: {gcode}}}]
service: {{state_dir: var}}
"""


def run_once(folder: Path, gcode: str) -> tuple[int, list[str]]:
    picture = SAMPLES / "1-rectangle.jpg"
    (folder / "config.yaml").write_text(CONFIG.format(picture=picture, samples=SAMPLES, gcode=gcode))
    status = main(["run", "--once", "--config", str(folder / "config.yaml")])
    return status, sorted(path.name.split("-")[1] for path in folder.glob("var/archive/*/*"))


def test_a_job_leaves_its_contour_in_every_form_that_its_recipe_names(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    status, names = run_once(tmp_path, "{cut_z_mm: 1}")
    assert status == 0
    forms = ["contour.dxf", "contour.geojson", "contour.ngc", "contour.svg"]
    assert [name for name in names if name.startswith("contour")] == forms
    (drawing,) = tmp_path.glob("var/archive/*/*.dxf")
    assert len(list(ezdxf.readfile(drawing).modelspace())) == 1
    (program,) = tmp_path.glob("var/archive/*/*.ngc")
    assert "(cuts at Z 1)" in program.read_text()


@pytest.mark.parametrize(
    ("gcode", "text"), [("{template: none.txt}", "none.txt"), ("{safe_z_mm: 10}", "not above the block")]
)
def test_what_cannot_be_exported_is_told_and_the_evidence_is_kept(gcode, text, tmp_path, monkeypatch, caplog):
    monkeypatch.chdir(tmp_path)
    status, names = run_once(tmp_path, gcode)
    assert status == 0
    assert "frame.png" in names
    assert [name for name in names if name.startswith("contour")] == ["contour.dxf", "contour.geojson", "contour.svg"]
    assert "recipe 1 will not be exported: gcode" in caplog.text
    assert "not exported" in caplog.text
    assert text in caplog.text
