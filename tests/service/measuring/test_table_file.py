"""The taught table as a file, and the commands that write and use it."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from contour.image.taught_table import TaughtTable
from service.cli.main import main
from service.measuring.table_file import TableFileError, TableRecord, load_table, save_table
from tests.support.pictures.grid_tables import grid_table, with_block


@pytest.fixture
def record() -> TableRecord:
    return TableRecord(TaughtTable(grid_table(), 1.5), "cam 7", 4, "2026-01-02T03:04:05+00:00")


@pytest.fixture
def shop(tmp_path: Path) -> Path:
    """A folder with pictures of an empty table, a configuration that names a table file, and no controller."""
    (tmp_path / "empty").mkdir()
    for seed in range(4):
        cv2.imwrite(str(tmp_path / "empty" / f"{seed}.png"), grid_table(seed))
    (tmp_path / "config.yaml").write_text(
        "camera: {kind: files, path: empty}\ncontroller: {kind: none}\ntable: {file: table.npz}\n"
    )
    return tmp_path


def test_what_is_written_is_read(tmp_path: Path, record: TableRecord) -> None:
    save_table(tmp_path / "table.npz", record)
    back = load_table(tmp_path / "table.npz")
    assert np.array_equal(back.table.picture, record.table.picture)
    assert (back.table.noise, back.camera, back.pictures, back.taught_at) == (1.5, "cam 7", 4, record.taught_at)
    assert [path.name for path in tmp_path.iterdir()] == ["table.npz"]


def test_a_failed_write_leaves_the_old_file(tmp_path: Path, record: TableRecord) -> None:
    with pytest.raises(TableFileError, match="cannot be written"):
        save_table(tmp_path / "no" / "table.npz", record)
    blocked = tmp_path / "table.npz"
    blocked.mkdir()
    with pytest.raises(TableFileError, match="cannot be written"):
        save_table(blocked, record)
    assert [path.name for path in tmp_path.iterdir()] == ["table.npz"]


@pytest.mark.parametrize("content", [b"", b"nonsense", b"PK\x03\x04 cut off"])
def test_a_file_that_is_no_table_is_told(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "table.npz").write_bytes(content)
    with pytest.raises(TableFileError, match=r"table.npz.*[Tt]each the table again"):
        load_table(tmp_path / "table.npz")


def test_archives_of_other_things_are_told(tmp_path: Path, record: TableRecord) -> None:
    path = tmp_path / "table.npz"
    np.savez(path, picture=record.table.picture)
    with pytest.raises(TableFileError, match="holds no taught table"):
        load_table(path)
    np.savez(path, picture=record.table.picture, noise=1.0, about=np.array(json.dumps({"version": 9})))
    with pytest.raises(TableFileError, match="version 9"):
        load_table(path)


def test_a_table_is_taught_by_the_configured_camera_and_used_from_then_on(shop: Path, capsys) -> None:
    picture = shop / "block.png"
    cv2.imwrite(str(picture), with_block(grid_table(78)))
    config = ["--config", str(shop / "config.yaml")]
    assert main(["teach-table", *config, "--frames", "4"]) == 0
    assert "table of 4 pictures, 640 x 480 px, noise 1." in capsys.readouterr().out
    assert main(["trace", *config, str(picture)]) == 0
    dark = shop / "dark.png"
    cv2.imwrite(str(dark), (with_block(grid_table(78)) * 0.4).astype(np.uint8))
    assert main(["trace", *config, str(dark)]) == 3
    assert "102 image_quality: The table's light is 4" in capsys.readouterr().out


def test_teaching_is_refused_where_something_moves_or_lies_there(shop: Path, capsys) -> None:
    output = ["--output", str(shop / "table.npz")]
    moved = grid_table(9)
    moved[100:200, 100:200] = 250
    cv2.imwrite(str(shop / "moved.png"), moved)
    assert main(["teach-table", *output, str(shop / "empty" / "0.png"), str(shop / "moved.png")]) == 3
    assert "changed by" in capsys.readouterr().err
    from tests.support.pictures.small_scenes import block

    cv2.imwrite(str(shop / "block.png"), block("rectangle").picture)
    assert main(["teach-table", *output, str(shop / "block.png")]) == 3
    assert "Clear the table" in capsys.readouterr().err
    assert not (shop / "table.npz").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "no configuration"),
        (["--frames", "0", "--output", "x", "y.png"], "expected 1 to 100"),
        (["--output", "x.npz", "nowhere.png"], "nowhere.png"),
    ],
)
def test_wrong_usage_is_told(arguments: list[str], words: str, capsys) -> None:
    assert main(["teach-table", *arguments]) == 2
    assert words in capsys.readouterr().err


def test_a_broken_table_file_stops_the_commands_before_any_picture(shop: Path, capsys) -> None:
    (shop / "table.npz").write_bytes(b"nonsense")
    assert main(["trace", "--config", str(shop / "config.yaml"), str(shop / "empty" / "0.png")]) == 2
    assert "Teach the table again" in capsys.readouterr().err
