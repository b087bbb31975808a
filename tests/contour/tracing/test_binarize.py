import cv2
import numpy as np
import pytest

from contour.errors import ParameterError
from contour.tracing.binarize import binarize
from contour.tracing.paper_cells import HEXAGON, measure_cells
from tests.support.pictures.small_scenes import block


def honeycomb(pitch: float, wall: float, size: tuple[int, int] = (400, 500)) -> np.ndarray:
    """A wall mask drawn here, independent of the renderer: bands of width `wall` around the bisectors of a lattice."""
    y, x = (grid.ravel().astype(float) for grid in np.mgrid[: size[0], : size[1]])
    height = pitch * np.sqrt(3) / 2
    near = []
    for row in np.rint(y / height) + np.arange(-1, 2)[:, None]:
        shift = row % 2 / 2
        near += [
            np.column_stack([(column + shift) * pitch, row * height])
            for column in np.rint(x / pitch - shift) + np.arange(-1, 2)[:, None]
        ]
    sites = np.array(near)
    distance = np.linalg.norm(sites - np.column_stack([x, y]), axis=2)
    first, second = np.argsort(distance, axis=0)[:2, None, :]
    own = np.take_along_axis(sites, np.concatenate([first, second])[..., None], axis=0)
    nearest, next_ = np.take_along_axis(distance, np.concatenate([first, second]), axis=0)
    from_wall = (next_**2 - nearest**2) / (2 * np.linalg.norm(own[0] - own[1], axis=1))
    in_block = ((own > [90, 70]) & (own < [410, 320])).all(axis=2).any(axis=0)
    return np.where((from_wall < wall / 2) & in_block, 255, 0).astype(np.uint8).reshape(size)


@pytest.mark.parametrize(("pitch", "wall"), [(7, 1.5), (10, 2), (14, 3), (25, 3), (40, 5), (60, 3)])
def test_pitch_and_wall_width_of_a_drawn_honeycomb(pitch: float, wall: float) -> None:
    cells = measure_cells(honeycomb(pitch, wall))
    assert cells is not None
    assert cells.pitch_px == pytest.approx(pitch, rel=0.04)
    assert cells.wall_px == pytest.approx(wall, abs=0.5 + 0.1 * wall)
    assert cells.wall_share == pytest.approx(1 - (1 - wall / pitch) ** 2, abs=0.06)
    assert cells.cell_px2 == pytest.approx(pitch**2 / HEXAGON, rel=0.1)


def test_cells_that_have_run_together_and_specks_do_not_move_the_pitch() -> None:
    mask = honeycomb(25, 3)
    rng = np.random.default_rng(1)
    mask[:, 200:240][rng.random((400, 40)) < 0.2] = 0
    for y, x in rng.integers(80, 300, (40, 2)):
        cv2.circle(mask, (int(x), int(y)), 6, 0, -1)
    mask[rng.random(mask.shape) < 0.002] = 255
    cells = measure_cells(mask)
    assert cells is not None
    assert cells.pitch_px == pytest.approx(25, rel=0.06)


@pytest.mark.parametrize(
    "mask",
    [
        np.zeros((50, 50), np.uint8),
        np.full((50, 50), 255, np.uint8),
        np.zeros((1, 1), np.uint8),
        (np.random.default_rng(0).random((200, 200)) < 0.02).astype(np.uint8) * 255,
    ],
)
def test_a_mask_without_cells_has_no_pitch(mask: np.ndarray) -> None:
    assert measure_cells(mask) is None


def test_five_cells_are_too_few_and_twelve_are_enough() -> None:
    mask = np.zeros((120, 200), np.uint8)
    for k in range(5):
        cv2.rectangle(mask, (10 + 20 * k, 20), (30 + 20 * k, 40), 255, 2)
    assert measure_cells(mask) is None
    for k in range(7):
        cv2.rectangle(mask, (10 + 20 * k, 40), (30 + 20 * k, 60), 255, 2)
    assert measure_cells(mask) is not None


@pytest.mark.parametrize("kind", ["easy", "shop", "dim", "dark"])
@pytest.mark.parametrize("name", ["rectangle", "l", "crescent", "holed"])
def test_pitch_and_polarity_are_read_from_rendered_blocks(name: str, kind: str) -> None:
    scene = block(name, kind)
    walls = binarize(scene.picture)
    assert walls.polarity == ("dark" if kind == "dark" else "bright")
    assert walls.cells is not None
    assert walls.cells.pitch_px == pytest.approx(scene.pitch_px, rel=0.08)


@pytest.mark.parametrize("kind", ["easy", "shop", "dim", "dark"])
def test_walls_are_on_the_block_and_hardly_beside_it(kind: str) -> None:
    scene = block("l", kind)
    walls = binarize(scene.picture)
    inside = np.zeros(walls.mask.shape, np.uint8)
    cv2.fillPoly(inside, [np.round(scene.truth_px.exterior).astype(np.int32)], 1)
    beside = cv2.dilate(inside, np.ones((9, 9), np.uint8)) == 0
    assert set(np.unique(walls.mask)) == {0, 255}
    assert 0.1 < np.mean(walls.mask[inside > 0] > 0) < 0.5
    assert np.mean(walls.mask[beside] > 0) < 0.004


def test_light_that_falls_off_breaks_otsu_but_not_the_flattened_mask() -> None:
    scene = block("rectangle", "easy")
    height, width = scene.picture.shape
    lamp = np.linspace(1.0, 0.12, width)[None, :] * np.ones((height, 1))
    uneven = (scene.picture * lamp + 90 * (1 - lamp)).astype(np.uint8)
    right = np.zeros(uneven.shape, np.uint8)
    cv2.fillPoly(right, [np.round(scene.truth_px.exterior).astype(np.int32)], 1)
    right[:, : width * 5 // 8] = 0
    share = {mode: np.mean(binarize(uneven, mode, "bright").mask[right > 0] > 0) for mode in ("flat", "otsu")}
    assert 0.1 < share["flat"] < 0.5
    assert not 0.1 < share["otsu"] < 0.5


@pytest.mark.parametrize(("gain", "offset"), [(0.5, 0), (0.5, 100), (0.8, 20)])
def test_gain_and_offset_of_the_light_leave_the_pitch(gain: float, offset: float) -> None:
    scene = block("rectangle", "easy")
    changed = (scene.picture * gain + offset).astype(np.uint8)
    cells = binarize(changed).cells
    assert cells is not None
    assert cells.pitch_px == pytest.approx(scene.pitch_px, rel=0.04)


def test_colour_counts_as_its_grey_levels() -> None:
    picture = block("l").picture
    np.testing.assert_array_equal(binarize(cv2.merge([picture] * 3)).mask, binarize(picture).mask)


def test_a_fixed_level_splits_exactly_there() -> None:
    picture = np.array([[10, 99, 100, 101, 200]], np.uint8)
    np.testing.assert_array_equal(binarize(picture, 100, "bright").mask, [[0, 0, 0, 255, 255]])
    np.testing.assert_array_equal(binarize(picture, 100, "dark").mask, [[255, 255, 255, 0, 0]])


def test_otsu_finds_polarity_by_the_cells() -> None:
    mask = honeycomb(25, 3)
    assert binarize(mask, "otsu").polarity == "bright"
    assert binarize(255 - mask, "otsu").polarity == "dark"


def test_without_cells_walls_are_what_the_border_is_not() -> None:
    picture = np.full((40, 40), 200, np.uint8)
    picture[10:30, 10:30] = 20
    assert binarize(picture, "otsu").polarity == "dark"
    assert binarize(255 - picture, "otsu").polarity == "bright"


@pytest.mark.parametrize("sigma", [0, 1, 4, 15])
def test_an_empty_table_has_no_walls_and_no_cells(sigma: float) -> None:
    noise = np.random.default_rng(3).normal(60, sigma, (480, 640))
    walls = binarize(noise.clip(0, 255).astype(np.uint8))
    assert walls.cells is None
    assert np.mean(walls.mask > 0) < 1e-3


@pytest.mark.parametrize("shape", [(1, 1), (1, 300), (300, 1), (5, 5), (40, 33)])
@pytest.mark.parametrize("mode", ["flat", "otsu", 128])
def test_small_pictures_are_no_special_case(shape: tuple[int, int], mode: str | int) -> None:
    picture = np.random.default_rng(1).integers(0, 256, shape).astype(np.uint8)
    walls = binarize(picture, mode)
    assert walls.mask.shape == shape
    assert walls.mask.dtype == np.uint8


@pytest.mark.parametrize("level", [-1, 256])
def test_a_level_off_the_grey_scale_is_refused(level: int) -> None:
    with pytest.raises(ParameterError, match=f"binarize is {level}"):
        binarize(np.zeros((5, 5), np.uint8), level)


@pytest.mark.parametrize("kind", ["easy", "shop", "dim", "dark"])
def test_a_picture_taken_for_large_gives_the_same_pitch(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = block("l", kind)
    plain = binarize(scene.picture)
    monkeypatch.setattr("contour.tracing.binarize._EASY_PX", 60_000)
    hasty = binarize(scene.picture)
    assert plain.cells is not None
    assert hasty.cells is not None
    assert hasty.polarity == plain.polarity
    assert hasty.cells.pitch_px == pytest.approx(plain.cells.pitch_px, rel=0.05)
    assert np.mean(hasty.mask != plain.mask) < 0.02


def test_cells_too_fine_for_the_first_look_are_found_in_the_second(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("contour.tracing.binarize._EASY_PX", 12_000)
    picture = (honeycomb(7, 1.5) // 255 * 120 + 60).astype(np.uint8)
    cells = binarize(picture).cells
    assert cells is not None
    assert cells.pitch_px == pytest.approx(7, rel=0.1)
