"""Which other things in a picture are blocks, and which are debris."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from contour.geometry.rings import Contour, area
from contour.tracing.trace import TraceSettings
from contour.tracing.tracing import trace
from contour.walls.pieces import Piece, pieces_beside, with_earlier, without_loose_pieces
from tests.support.pictures.small_scenes import block

PITCH = 20.0
RING = np.array([[20.0, 20.0], [20.0, 220.0], [220.0, 220.0], [220.0, 20.0]])


def comb(mask: np.ndarray, left: int, top: int, columns: int, rows: int, pitch: float = PITCH) -> None:
    """Hexagonal cells drawn as walls, three pixels wide."""
    for row in range(rows):
        for column in range(columns):
            at = np.array([left + (column + 0.5 * (row % 2)) * pitch, top + row * 0.866 * pitch])
            angles = np.radians(np.arange(30, 390, 60))
            corners = at + pitch / np.sqrt(3) * np.column_stack((np.cos(angles), np.sin(angles)))
            cv2.polylines(mask, [np.rint(corners).astype(np.int32)], True, 255, 3)


def empty() -> np.ndarray:
    return np.zeros((480, 640), np.uint8)


def test_a_second_comb_is_a_piece_with_its_area_and_place() -> None:
    mask = empty()
    comb(mask, 40, 40, 9, 10)
    comb(mask, 350, 120, 8, 7)
    (piece,) = pieces_beside(mask, RING, PITCH)
    assert piece.area_px2 == pytest.approx(56 * 0.866 * PITCH**2, rel=0.25)
    assert abs(area(Contour(piece.outline_px))) == pytest.approx(piece.area_px2, rel=0.1)
    np.testing.assert_allclose(piece.outline_px.min(axis=0), piece.box_px[:2], atol=10)
    np.testing.assert_allclose(piece.outline_px.max(axis=0), piece.box_px[2:], atol=10)
    left, top, right, bottom = piece.box_px
    assert 320 <= left <= 345
    assert 95 <= top <= 115
    assert 500 <= right <= 535
    assert 230 <= bottom <= 255


def test_equal_blocks_measure_alike_whatever_lies_open_at_their_borders() -> None:
    rendered = block("rectangle")
    two = np.concatenate([rendered.picture, rendered.picture], axis=1)
    found = trace(two, TraceSettings())
    (other,) = found.others
    assert other.area_px2 == pytest.approx(area(found.contour), rel=0.07)


def test_a_corner_that_the_frame_cuts_is_seen_by_its_walls() -> None:
    rendered = block("rectangle")
    left = rendered.truth_px.exterior[:, 0].min()
    for over in (4, 10, 20):
        assert trace(rendered.picture[:, round(left) + over :], TraceSettings()).reaches_frame
    assert not trace(rendered.picture[:, round(left) - 4 :], TraceSettings()).reaches_frame


def test_pieces_come_largest_first_and_in_pixels_of_the_picture() -> None:
    mask = empty()
    comb(mask, 300, 60, 5, 4)
    comb(mask, 300, 250, 12, 10)
    large, small = pieces_beside(mask, RING, PITCH, 2)
    assert large.area_px2 > 4 * small.area_px2
    assert large.box_px[1] > 400


def test_a_pieces_width_is_that_of_its_widest_place_or_of_where_it_may_go_on_outside_of_the_picture() -> None:
    """One in view, one that the border cuts lengthwise, and one that runs out of the picture."""
    mask = empty()
    comb(mask, 300, 60, 10, 3)
    comb(mask, 300, 433, 8, 4)
    comb(mask, 500, 200, 12, 3)
    whole, across, cut = sorted(pieces_beside(mask, RING, PITCH), key=lambda piece: piece.box_px[1])
    assert whole.width_px == pytest.approx(2.7 * PITCH, abs=0.6 * PITCH)
    assert across.width_px == pytest.approx(2.7 * PITCH, abs=0.6 * PITCH)
    assert cut.width_px == pytest.approx(8 * PITCH, abs=PITCH)


@pytest.mark.parametrize("cells", [(2, 2), (3, 2), (6, 1)])
def test_an_offcut_of_a_few_cells_is_none(cells: tuple[int, int]) -> None:
    mask = empty()
    comb(mask, 350, 120, *cells)
    assert pieces_beside(mask, RING, PITCH) == ()


def test_chips_cables_letters_and_grids_of_other_sizes_are_none() -> None:
    mask = empty()
    rng = np.random.default_rng(7)
    for _ in range(60):
        start = rng.uniform((260, 20), (600, 220))
        cv2.line(mask, np.rint(start).astype(int), np.rint(start + rng.uniform(-15, 15, 2)).astype(int), 255, 2)
    cv2.putText(mask, "BLOCK 808", (260, 300), cv2.FONT_HERSHEY_SIMPLEX, 1.5, 255, 3)
    for x in range(250, 640, 90):
        cv2.line(mask, (x, 320), (x, 479), 255, 2)
    cv2.line(mask, (230, 400), (639, 400), 255, 2)
    assert pieces_beside(mask, RING, PITCH) == ()


def test_what_belongs_to_the_traced_block_is_none() -> None:
    mask = empty()
    comb(mask, 40, 40, 9, 10)
    assert pieces_beside(mask, RING, PITCH) == ()


@pytest.mark.parametrize("method", ["wall-tips", "sliding-matrix"])
def test_a_traced_picture_tells_of_the_block_beside(method: str) -> None:
    one = block("rectangle").picture
    assert trace(one, TraceSettings(method=method)).others == ()
    two = np.concatenate([one, one[:, :420]], axis=1)
    (other,) = trace(two, TraceSettings(method=method)).others
    assert other.area_px2 > 5000


def with_strip(columns: int, rows: int, gap_px: int) -> np.ndarray:
    """A comb of 12 by 12 cells with a strip below it, its walls so far from the comb's."""
    mask, strip = empty(), empty()
    comb(mask, 100, 40, 12, 12)
    comb(strip, 110, 100, columns, rows)
    bottom, top = (int(np.flatnonzero(part.any(axis=1))[place]) for part, place in ((mask, -1), (strip, 0)))
    return mask | np.roll(strip, bottom + gap_px + 1 - top, axis=0)


def test_a_strip_of_swarf_is_taken_out_however_near_it_lies_and_the_block_stays() -> None:
    alone = empty()
    comb(alone, 100, 40, 12, 12)
    found = without_loose_pieces(with_strip(8, 1, 1), PITCH)
    assert (found == alone).all()


@pytest.mark.parametrize(("aside", "own"), [(0.0, True), (0.3, False)])
def test_cells_that_go_on_in_the_blocks_rows_beyond_a_gap_are_its_own(aside: float, own: bool) -> None:
    """As a felt-pen's line leaves them that is as dark as the table; a strip of swarf lies in no row."""
    mask = empty()
    comb(mask, 60, 30, 16, 16)
    rows = np.flatnonzero(mask.any(axis=1))
    line = int(rows[0] + 0.84 * (rows[-1] - rows[0]))
    mask[line : line + round(0.7 * PITCH)] = 0
    below = np.roll(mask[line:], round(aside * PITCH), axis=1)
    parted = np.concatenate([mask[:line], below])
    kept = without_loose_pieces(parted, PITCH, lambda: parted)[line:]
    assert (np.count_nonzero(kept) > 0.5 * np.count_nonzero(below)) == own


@pytest.mark.parametrize(
    ("columns", "rows", "gap_px"),
    [(8, 1, 0), (12, 4, 2), (1, 1, 2)],
    ids=["one that touches it", "a part as large as a third of it", "a cell"],
)
def test_what_may_be_the_blocks_own_stays(columns: int, rows: int, gap_px: int) -> None:
    mask = with_strip(columns, rows, gap_px)
    assert without_loose_pieces(mask, PITCH) is mask


def test_broken_walls_beside_the_block_stay_and_so_do_fragments_of_a_faint_one() -> None:
    torn = empty()
    comb(torn, 100, 40, 12, 12)
    cv2.polylines(torn, [np.array([[110, 265], [180, 262], [260, 268]], np.int32)], False, 255, 3)
    assert without_loose_pieces(torn, PITCH) is torn
    fragments = empty()
    for left in (40, 180, 320, 460):
        comb(fragments, left, 60, 5, 5)
    assert without_loose_pieces(fragments, PITCH) is fragments


def with_shaving(*, length: float = 2.5, gap_px: int = 4) -> tuple[np.ndarray, np.ndarray]:
    """A comb of 12 by 12 cells, and the same with a bent strip of one wall below it, so many pitches long."""
    alone = empty()
    comb(alone, 100, 40, 12, 12)
    bottom = int(np.flatnonzero(alone.any(axis=1))[-1])
    across = np.linspace(0.0, length * PITCH, 6)
    zigzag = np.stack([150 + across, bottom + gap_px + 3 + 5 * (np.arange(6) % 2)], axis=1)
    mask = alone.copy()
    cv2.polylines(mask, [np.rint(zigzag).astype(np.int32)], False, 255, 3)
    return alone, mask


def test_a_shaving_is_taken_out_where_no_faint_wall_leads_to_it_from_the_block() -> None:
    alone, mask = with_shaving()
    assert (without_loose_pieces(mask, PITCH, lambda: mask) == alone).all()
    bottom = int(np.flatnonzero(alone.any(axis=1))[-1])
    linked = cv2.line(mask.copy(), (170, bottom - 20), (170, bottom + 10), 255, 2)
    assert (without_loose_pieces(mask, PITCH, lambda: linked) == mask).all()
    assert (without_loose_pieces(mask, PITCH) == mask).all()


def test_a_wall_or_two_that_stand_alone_stay() -> None:
    _, mask = with_shaving(length=1.0)
    assert (without_loose_pieces(mask, PITCH, lambda: mask) == mask).all()


def test_a_piece_that_a_later_look_does_not_see_still_lies_there() -> None:
    def piece(left: int, right: int, area_px2: float) -> Piece:
        return Piece(area_px2, (left, 300, right, 400))

    first, less, far = piece(100, 200, 9000.0), piece(150, 200, 3000.0), piece(400, 450, 4000.0)
    assert with_earlier((), (first, far), RING) == (first, far), "largest first"
    assert with_earlier((less,), (first,), RING) == (first,), "of one piece the look counts that saw more of it"
    assert with_earlier((first,), (less,), RING) == (first,)
    assert with_earlier((first,), (first,), RING) == (first,)
    within = Piece(5000.0, (100, 100, 200, 200))
    assert with_earlier((far,), (within,), RING) == (far,), "what the outline holds now is the block"


def test_a_second_block_so_near_that_it_hides_the_edge_is_a_piece_all_the_same() -> None:
    rendered = block("rectangle")
    picture, ring = np.roll(rendered.picture, -95, axis=1), rendered.truth_px.exterior - [95.0, 0.0]
    longest = max(np.roll(ring, -1, axis=0) - ring, key=lambda side: float(np.hypot(*side)))
    along = longest / np.hypot(*longest) * np.sign(longest[0])
    part = np.zeros(picture.shape, np.uint8)
    cv2.fillPoly(part, [np.rint(ring).astype(np.int32)], 255)
    x, y = np.meshgrid(np.arange(picture.shape[1]), np.arange(picture.shape[0]))
    part[x * along[0] + y * along[1] < (ring @ along).max() - 110.0] = 0
    apart = np.column_stack((np.eye(2), (110.0 + 0.8 * rendered.pitch_px) * along))
    size = picture.shape[::-1]
    there = cv2.warpAffine(cv2.dilate(part, np.ones((5, 5), np.uint8)), apart, size) > 127
    two = np.where(there, np.maximum(cv2.warpAffine(picture, apart, size), picture), picture)
    traced = trace(two, TraceSettings())
    assert "covered" in {stretch.state for stretch in traced.evidence or ()}, "it is looked at once more"
    assert len(traced.others) == 1
