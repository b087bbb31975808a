"""`combtrace trace` as a user runs it: JSON as the contract says, exit statuses, overlays, and every unusable input."""

from __future__ import annotations

import json
import os
import shutil
import struct
import zlib
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from tests.support.pictures.combs import write_combs
from tests.support.processes.processes import called, combtrace

ROOT = Path(__file__).parents[3]
SAMPLES = ROOT / "service" / "samples"
RECTANGLE = SAMPLES / "1-rectangle.jpg"
L_SHAPE = SAMPLES / "2-l-shape.jpg"
CALIBRATION = SAMPLES / "calibration.yaml"
KEYS = {
    "image", "status", "reason", "reasons", "method", "polarity", "pitch_px", "edge", "pixels", "area_px2",
    "uncertainty_px", "frame", "thickness_mm", "millimetres", "area_mm2", "uncertainty_mm", "evidence", "timings_ms",
}  # fmt: skip


@pytest.fixture(scope="module")
def comb(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small picture, for what is the same with any."""
    return write_combs(tmp_path_factory.mktemp("small") / "combs") / "0.png"


def traced(*arguments: str | Path, status: int = 0) -> list[dict[str, Any]]:
    """The JSON Lines on standard output."""
    done = called("trace", *arguments, "--json", "-")
    assert done.returncode == status, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


def shoelace(ring: list[list[float]]) -> float:
    x, y = np.array(ring).T
    return float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2)


def test_json_has_the_contracts_keys_and_the_same_vertices_in_pixels_and_millimetres() -> None:
    (record,) = traced(SAMPLES / "4-with-holes.jpg", "--calibration", CALIBRATION)
    assert set(record) >= KEYS
    assert (record["status"], record["reason"], record["reasons"]) == ("ok", None, [])
    assert (record["frame"], record["thickness_mm"]) == ("machine", 20.0)
    assert len(record["pixels"]["holes"]) == len(record["millimetres"]["holes"]) == 2
    assert len(record["pixels"]["exterior"]) == len(record["millimetres"]["exterior"])
    assert shoelace(record["millimetres"]["exterior"]) > 0
    assert shoelace(record["pixels"]["exterior"]) < 0
    assert all(shoelace(hole) < 0 for hole in record["millimetres"]["holes"])
    net = sum(shoelace(ring) for ring in [record["millimetres"]["exterior"], *record["millimetres"]["holes"]])
    assert record["area_mm2"] == pytest.approx(net, rel=1e-9)
    assert set(record["timings_ms"]) >= {"read", "mask", "trace", "convert", "simplify", "total"}
    assert 0.15 <= record["uncertainty_px"] < 2.0
    # The shipped calibration states nothing of itself: the picture's part alone, at about 0.4 mm a pixel.
    assert record["uncertainty_mm"] == pytest.approx(0.385 * record["uncertainty_px"], rel=0.1)


def test_without_a_calibration_everything_in_millimetres_is_null_and_that_is_no_refusal() -> None:
    (record,) = traced(RECTANGLE)
    assert record["status"] == "ok"
    assert [record[key] for key in ("millimetres", "area_mm2", "uncertainty_mm", "thickness_mm")] == [None] * 4
    assert record["area_px2"] > 100_000


def test_the_sliding_matrix_traces_the_rectangle() -> None:
    """The truth is 82 900 mm² or so at 0.375 mm a pixel; the paper's methods are some pixels off all around."""
    (record,) = traced(RECTANGLE, "--method", "sliding-matrix", "--calibration", CALIBRATION)
    assert (record["method"], record["status"]) == ("sliding-matrix", "ok")
    assert record["area_mm2"] == pytest.approx(79_000, rel=0.06)


def test_a_direct_scan_torn_by_two_rows_is_shown_and_refused() -> None:
    """Where a row runs between walls, `max_gap_px` ends it nine cells early: the polygon has a slit that no tool can
    follow."""
    (record,) = traced(RECTANGLE, "--method", "direct-scan", "--calibration", CALIBRATION, status=3)
    assert (record["method"], record["reason"]) == ("direct-scan", "methods_disagree")
    assert record["area_mm2"] == pytest.approx(79_000, rel=0.06)


def test_find_contours_finds_cells_and_is_refused() -> None:
    (record,) = traced(RECTANGLE, "--method", "find-contours", "--calibration", CALIBRATION, status=3)
    assert record["status"] == "refused"
    assert record["reason"] == record["reasons"][0]
    assert record["reason"] in ("area_out_of_limits", "methods_disagree", "too_many_points", "self_intersecting")
    assert record["pixels"] is not None


def test_parameters_of_the_command_line_reach_the_method() -> None:
    windows = ("--method", "sliding-matrix", "--threshold", "30")
    coarse = traced(RECTANGLE, *windows, "--core-px", "40", "--step-px", "40", status=3)[0]
    fine = traced(RECTANGLE, *windows, "--core-px", "16", "--step-px", "8", status=3)[0]
    assert coarse["reasons"] == fine["reasons"] == ["methods_disagree"]  # both are too fat all around
    assert coarse["area_px2"] > fine["area_px2"]


def test_a_step_above_twice_the_core_is_told_once_and_traced_nevertheless(comb: Path) -> None:
    sizes = ("--method", "sliding-matrix", "--core-px", "10", "--step-px")
    done = combtrace("trace", comb, comb, *sizes, "21", "--json", "-")
    assert len(done.stdout.splitlines()) == 2
    assert done.stderr.count("step_px is 21, expected up to 20, twice core_px") == 1
    assert "step_px is" not in called("trace", comb, *sizes, "20").stderr


def test_a_core_by_hand_is_accepted_like_the_one_that_follows() -> None:
    """The threshold follows from the cells, whoever gives the core."""
    (by_hand,) = traced(RECTANGLE, "--method", "sliding-matrix", "--core-px", "10", "--step-px", "10")
    (followed,) = traced(RECTANGLE, "--method", "sliding-matrix")
    assert by_hand["area_px2"] == pytest.approx(followed["area_px2"], rel=0.01)


def test_the_thickness_moves_the_plane() -> None:
    """Under a camera 1.2 m up, a plane 60 mm higher is seen 5 % nearer: the same pixels are fewer millimetres."""
    low = traced(RECTANGLE, "--calibration", CALIBRATION, "--thickness-mm", "0")[0]["area_mm2"]
    high = traced(RECTANGLE, "--calibration", CALIBRATION, "--thickness-mm", "60")[0]["area_mm2"]
    assert high / low == pytest.approx((1220.0 - 60) ** 2 / 1220.0**2, rel=0.01)


def test_an_overlay_is_written_for_each_picture_and_text_names_it(tmp_path: Path) -> None:
    done = called("trace", RECTANGLE, L_SHAPE, "--overlay", tmp_path / "seen")
    assert done.returncode == 0
    names = sorted(path.name for path in (tmp_path / "seen").iterdir())
    assert names == ["1-rectangle-contour.png", "2-l-shape-contour.png"]
    assert "1-rectangle-contour.png" in done.stdout
    drawn = cv2.imread(str(tmp_path / "seen" / names[0]))
    assert drawn.shape[1:] == (1600, 3)
    assert 1200 < len(drawn) < 1400, "its caption stands above it"
    green = (drawn[..., 1] > 180) & (drawn[..., 0] < 120) & (drawn[..., 2] < 120)
    assert green.sum() > 2000


def test_an_overlay_never_replaces_the_picture_it_is_of(tmp_path: Path) -> None:
    picture = tmp_path / "block.jpg"
    picture.write_bytes(RECTANGLE.read_bytes())
    done = called("trace", picture, "--overlay", picture)
    assert done.returncode == 2
    assert "is a file that is read" in done.stderr
    assert picture.read_bytes() == RECTANGLE.read_bytes()


def test_pictures_of_one_name_from_several_folders_get_an_overlay_each(tmp_path: Path, comb: Path) -> None:
    pictures = [tmp_path / side / name for side, name in (("left", "a.jpg"), ("right", "a.jpg"), ("right", "b.jpg"))]
    for picture, source in zip(pictures, (comb, L_SHAPE, comb), strict=True):
        picture.parent.mkdir(exist_ok=True)
        picture.write_bytes(source.read_bytes())
    done = called("trace", *pictures, "--overlay", tmp_path / "seen", "--thickness-mm", "20")
    assert done.returncode == 0, done.stderr
    names = sorted(path.name for path in (tmp_path / "seen").iterdir())
    assert names == ["b-contour.png", "left-a-contour.png", "right-a-contour.png"]
    assert "--thickness-mm 20 has no effect: without a calibration" in done.stderr
    # An overlay's name may be that of another picture of the same run.
    (tmp_path / "left" / "b-contour.png").write_bytes(comb.read_bytes())
    done = called("trace", pictures[2], tmp_path / "left" / "b-contour.png", "--overlay", tmp_path / "left")
    assert done.returncode == 2
    assert "is a file that is read" in done.stderr


def test_a_json_file_stays_as_it_was_where_the_command_cannot_go_on(tmp_path: Path, comb: Path) -> None:
    out = tmp_path / "out.jsonl"
    out.write_text("old\n")
    (tmp_path / "seen").mkdir()
    (tmp_path / "seen" / f"{L_SHAPE.stem}-contour.png").mkdir()
    done = called("trace", comb, L_SHAPE, "--overlay", tmp_path / "seen", "--json", out)
    assert done.returncode == 2
    assert out.read_text() == "old\n"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out.jsonl", "seen"]


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["a.jpg", "--json", "a.jpg"], "--json a.jpg: is a file that is read"),
        (["--json", "a.jpg", "b.jpg"], "--json a.jpg: is called as a picture is"),  # what a shell makes of --json *.jpg
        (["a.jpg", "--calibration", CALIBRATION, "--svg", "link.svg"], "--svg link.svg: is a file that is read"),
        (["a.jpg", "--overlay", "o.png", "--json", "o.png"], "--json o.png: is called as a picture is"),
        (["a.jpg", "--calibration", CALIBRATION, "--json", "o", "--svg", "./o"], "--svg o: --json has the same file"),
    ],
)
def test_no_output_takes_the_place_of_a_picture_or_of_another_output(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str | Path], told: str
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("a.jpg", "b.jpg"):
        (tmp_path / name).write_bytes(RECTANGLE.read_bytes())
    (tmp_path / "link.svg").symlink_to("a.jpg")
    done = called("trace", *arguments)
    assert done.returncode == 2
    assert told in done.stderr
    assert (tmp_path / "a.jpg").read_bytes() == (tmp_path / "b.jpg").read_bytes() == RECTANGLE.read_bytes()


def test_a_name_that_ends_in_a_slash_is_a_folder_of_one_picture_too(tmp_path: Path, comb: Path) -> None:
    calibration = ("--calibration", comb.parent.with_suffix(".yaml"))
    done = called("trace", comb, *calibration, "--overlay", f"{tmp_path}/seen/", "--svg", f"{tmp_path}/out/")
    assert done.returncode == 0, done.stderr
    assert [path.name for path in (tmp_path / "seen").iterdir()] == ["0-contour.png"]
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["0.svg"]


def test_a_sign_that_the_terminal_does_not_have_is_told_as_an_escape(comb: Path) -> None:
    done = combtrace("trace", comb, variables={"PYTHONIOENCODING": "ascii"})
    assert done.returncode == 0, done.stderr
    assert "px\\xb2" in done.stdout


def test_json_to_a_file_leaves_the_text_on_standard_output(tmp_path: Path, comb: Path) -> None:
    done = called("trace", comb, "--json", tmp_path / "out.jsonl")
    assert "wall-tips" in done.stdout
    assert json.loads((tmp_path / "out.jsonl").read_text())["status"] == "ok"


def test_a_picture_whose_name_is_no_utf_8_is_told_in_json_all_the_same(tmp_path: Path, comb: Path) -> None:
    picture, told = tmp_path / os.fsdecode(b"bild-\xe4.jpg"), tmp_path / "told.json"
    picture.write_bytes(comb.read_bytes())
    done = called("trace", picture, "--json", told)
    assert done.returncode == 0, done.stderr
    assert json.loads(told.read_text())["image"].endswith("bild-\\udce4.jpg")


def test_text_goes_to_standard_error_when_json_goes_to_standard_output(comb: Path) -> None:
    done = called("trace", comb, "--json", "-")
    assert "vertices" in done.stderr
    assert len(done.stdout.splitlines()) == 1


def test_no_config_file_that_happens_to_lie_around_is_read(tmp_path: Path, comb: Path) -> None:
    (tmp_path / "config.yaml").write_text("this is: [no configuration")
    assert combtrace("trace", comb, cwd=tmp_path).returncode == 0


def test_a_recipe_is_found_by_name_and_its_limits_refuse(tmp_path: Path, comb: Path) -> None:
    config = tmp_path / "config.yaml"
    config.write_text(
        f"camera: {{kind: files, path: x}}\ncalibration: {{file: {comb.parent}.yaml}}\n"
        "controller: {kind: none}\n"
        "recipes:\n- {number: 1, name: default}\n- {number: 2, name: small, max_area_mm2: 500}\n"
    )
    assert traced(comb, "--config", config)[0]["status"] == "ok"
    (record,) = traced(comb, "--config", config, "--recipe", "small", status=3)
    assert record["reason"] == "area_out_of_limits"
    assert "500 mm²" in record["details"][0]
    done = called("trace", comb, "--config", config, "--recipe", "huge")
    assert done.returncode == 2
    assert "there are: default (1), small (2)" in done.stderr


def test_the_worst_status_of_several_pictures_counts(tmp_path: Path, comb: Path) -> None:
    empty = tmp_path / "empty.png"
    cv2.imwrite(str(empty), np.full((200, 300), 30, np.uint8))
    assert called("trace", comb, empty).returncode == 3
    assert called("trace", comb, empty, tmp_path / "nowhere.png").returncode == 2
    assert [record["status"] for record in traced(comb, empty, tmp_path / "no.png", status=2)] == [
        "ok",
        "refused",
        "error",
    ]


@pytest.mark.parametrize(("value", "codes"), [(0, [102, 110]), (30, [110]), (128, [110]), (255, [102, 110])])
def test_an_empty_table_is_refused_with_no_block_found(tmp_path: Path, value: int, codes: list[int]) -> None:
    """A black or white picture shows no table at all: that is said first."""
    cv2.imwrite(str(tmp_path / "empty.png"), np.full((200, 300), value, np.uint8))
    (record,) = traced(tmp_path / "empty.png", status=3)
    assert record["reason_codes"] == codes
    assert record["reasons"][-1] == "no_block_found"
    assert record["pixels"] is None


def test_a_block_that_leaves_the_picture_is_refused(tmp_path: Path) -> None:
    picture = cv2.imread(str(RECTANGLE), cv2.IMREAD_GRAYSCALE)
    cv2.imwrite(str(tmp_path / "cut.png"), picture[300:, :])
    (record,) = traced(tmp_path / "cut.png", status=3)
    assert "touches_border" in record["reasons"]


def test_a_calibration_for_another_size_is_refused_by_name(tmp_path: Path) -> None:
    picture = cv2.imread(str(RECTANGLE), cv2.IMREAD_GRAYSCALE)
    cv2.imwrite(str(tmp_path / "half.png"), cv2.resize(picture, (800, 600)))
    (record,) = traced(tmp_path / "half.png", "--calibration", CALIBRATION, status=3)
    assert record["reason"] == "calibration_mismatch"
    assert "800 x 600" in record["details"][0]
    assert "1600 x 1200" in record["details"][0]


def chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def huge_png() -> bytes:
    header = struct.pack(">IIBBBBB", 60_000, 60_000, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", b"") + chunk(b"IEND", b"")


def encoded(ending: str, picture: np.ndarray) -> bytes:
    return cv2.imencode(ending, picture)[1].tobytes()


BAD = {
    "missing": None,
    "empty.png": b"",
    "text.png": b"this is no picture\n" * 20,
    "truncated.jpg": RECTANGLE.read_bytes()[:100_000],
    "truncated.png": encoded(".png", np.random.default_rng(1).integers(0, 255, (300, 400), np.uint8))[:-4000],
    "huge.png": huge_png(),
    "zip.jpg": b"PK\x03\x04" + bytes(300),
}


@pytest.mark.parametrize("name", BAD)
def test_an_unusable_file_is_one_clear_line_and_status_2(tmp_path: Path, name: str) -> None:
    data = BAD[name]
    if data is not None:
        (tmp_path / name).write_bytes(data)
    done = called("trace", tmp_path / name)
    assert done.returncode == 2
    assert done.stdout == ""
    (line,) = done.stderr.splitlines()
    assert name in line
    assert "Traceback" not in line


def test_a_folder_is_no_picture(tmp_path: Path) -> None:
    done = called("trace", tmp_path)
    assert done.returncode == 2
    assert str(tmp_path) in done.stderr


@pytest.mark.parametrize(
    ("name", "convert"),
    [
        ("colour.png", lambda grey: cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR)),
        ("alpha.png", lambda grey: cv2.cvtColor(grey, cv2.COLOR_GRAY2BGRA)),
        ("deep.png", lambda grey: grey.astype(np.uint16) * 257),
    ],
)
def test_the_same_picture_in_another_form_gives_the_same_contour(
    tmp_path: Path, name: str, convert: Any, comb: Path
) -> None:
    grey = cv2.imread(str(comb), cv2.IMREAD_GRAYSCALE)
    cv2.imwrite(str(tmp_path / "grey.png"), grey)
    cv2.imwrite(str(tmp_path / name), convert(grey))
    plain, other = traced(tmp_path / "grey.png", tmp_path / name)
    assert other["pixels"] == plain["pixels"]


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["--method", "sliding-matrix", "--core-px", "0"], "core_px is 0"),
        (["--method", "sliding-matrix", "--threshold", "300"], "threshold is 300"),
        (["--method", "direct-scan", "--core-px", "5"], "parameters.core_px is none of direct-scan's"),
        (["--core-px", "5"], "there are: none; core_px is sliding-matrix's"),
        (["--calibration", "config.yaml"], "`combtrace calibrate` makes one"),
        (["--binarize", "fuzzy"], "expected flat, otsu, or a number 0 to 255"),
        (["--binarize", "256"], "expected flat, otsu, or a number 0 to 255"),
        (["--method", "magic"], "invalid choice: 'magic'"),
        (["--calibration", "/nowhere.yaml"], "/nowhere.yaml: cannot be read"),
        (["--config", "/nowhere.yaml"], "/nowhere.yaml: cannot be read"),
        (["--thickness-mm", "-3"], "--thickness-mm -3: expected 0 to 10000"),
        (["--overlay", "/nowhere/x.png"], "/nowhere/x.png: cannot be written"),
        (["--json", "/nowhere/x.jsonl"], "/nowhere/x.jsonl: cannot be written"),
    ],
)
def test_bad_usage_is_told_and_has_status_2(arguments: list[str], expected: str, comb: Path) -> None:
    done = called("trace", comb, *arguments)
    assert done.returncode == 2
    assert expected in done.stderr
    assert "Traceback" not in done.stderr


def test_a_picture_that_is_not_there_is_named_once(tmp_path: Path) -> None:
    told = called("trace", tmp_path / "none.png")
    assert told.returncode == 2
    assert told.stderr.startswith(f"{tmp_path / 'none.png'}: cannot be read")


def test_a_region_of_interest_hides_what_lies_outside() -> None:
    (whole,) = traced(RECTANGLE)
    xs, ys = zip(*whole["pixels"]["exterior"], strict=True)
    around = f"{min(xs) - 20},{min(ys) - 20},{max(xs) + 20},{max(ys) + 20}"
    (seen,) = traced(f"--roi-px={around}", RECTANGLE)
    assert seen["area_px2"] == pytest.approx(whole["area_px2"], rel=1e-3)
    (cut,) = traced("--roi-px", "0,0,800,1199", RECTANGLE, status=3)
    assert cut["reason"] == "touches_border"
    assert "region of interest" in cut["details"][0]
    for wrong in ("1,2,3", "9,9,1,1"):
        assert called("trace", f"--roi-px={wrong}", RECTANGLE).returncode == 2


def test_a_refusal_is_told_in_russian_with_what_was_measured(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "black.png"), np.zeros((200, 300), np.uint8))
    told = called("trace", "--language", "ru", tmp_path / "black.png")
    assert told.returncode == 3
    assert "отказ: 102 image_quality: Снимок нерезкий" in told.stdout
    assert "brightest parts reach 0 of 255" in told.stdout


def test_a_refusal_for_several_blocks_shows_both_outlines_below_its_caption(tmp_path: Path) -> None:
    small = cv2.resize(cv2.imread(str(RECTANGLE)), (640, 480), interpolation=cv2.INTER_AREA)
    cv2.imwrite(str(tmp_path / "two.png"), np.concatenate([small, small], axis=1))
    (record,) = traced(tmp_path / "two.png", "--overlay", tmp_path / "seen.png", status=3)
    assert record["reason"] == "several_blocks"
    seen = cv2.imread(str(tmp_path / "seen.png"))
    picture = seen[len(seen) - 480 :].astype(int)
    assert len(seen) > 480
    lines = (picture[:, :, 2] - picture[:, :, 0]) > 120  # red, and yellow around the other
    # Both lie alike in their halves, so both lines enclose the same box.
    left, right = (np.argwhere(half) for half in (lines[:, :640], lines[:, 640:]))
    for side in ("min", "max"):
        np.testing.assert_allclose(getattr(left, side)(axis=0), getattr(right, side)(axis=0), atol=6)


def test_two_links_to_one_picture_each_get_their_outputs(tmp_path: Path, comb: Path) -> None:
    links = [tmp_path / name for name in ("monday.jpg", "tuesday.jpg")]
    for link in links:
        link.symlink_to(comb)
    out = tmp_path / "out"
    records = traced(*links, "--overlay", out, "--calibration", comb.parent.with_suffix(".yaml"), "--svg", out)
    assert [record["image"] for record in records] == [str(link) for link in links]
    names = {path.name for path in out.iterdir()}
    assert names == {f"{day}{end}" for day in ("monday", "tuesday") for end in ("-contour.png", ".svg")}


def test_a_folder_stands_for_its_pictures_in_order_and_counts_what_it_passes_over(tmp_path: Path, comb: Path) -> None:
    folder = tmp_path / "day"
    (folder / "older").mkdir(parents=True)
    for name in ("block10.png", "block9.PNG", "older/block1.png"):
        shutil.copy(comb, folder / name)
    for name in ("notes.txt", "calibration.yaml", ".hidden.png"):
        (folder / name).write_text("")
    done = called("trace", folder, "--json", "-", "--overlay", tmp_path / "seen")
    assert done.returncode == 0, done.stderr
    seen = [json.loads(line)["image"] for line in done.stdout.splitlines()]
    assert seen == [str(folder / "block9.PNG"), str(folder / "block10.png")]
    assert f"{folder}: 2 pictures, 2 other files are passed over" in done.stderr
    assert {path.name for path in (tmp_path / "seen").iterdir()} == {"block9-contour.png", "block10-contour.png"}


def test_a_folder_with_one_picture_has_its_outputs_in_a_folder_too(tmp_path: Path, comb: Path) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "block.jpg").symlink_to(comb)
    traced(tmp_path / "in", "--overlay", tmp_path / "seen")
    assert (tmp_path / "seen" / "block-contour.png").is_file()


@pytest.mark.parametrize(("content", "told"), [((), "but nothing"), (("notes.txt",), "but 1 other files")])
@pytest.mark.parametrize("command", ["trace", "teach-table --output {0}/table.npz", "verify --outline {0}/o.json"])
def test_a_folder_without_a_picture_is_an_error(
    command: str, content: tuple[str, ...], told: str, tmp_path: Path
) -> None:
    (tmp_path / "o.json").write_text('{"exterior": [[0, 0], [9, 0], [9, 9]]}')
    folder = tmp_path / "in"
    folder.mkdir()
    for name in content:
        (folder / name).write_text("")
    name, *options = command.format(tmp_path).split()
    done = called(name, folder, *options, *(["--calibration", CALIBRATION] if name == "verify" else []))
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
    assert f"{folder}: holds no picture, {told}" in done.stderr
