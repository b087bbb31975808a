from pathlib import Path

import pytest

from service.cli.file_names import distinct_stems


@pytest.mark.parametrize(
    ("images", "stems"),
    [
        (["a.png", "b.png"], ["a", "b"]),
        (["x/a.png", "y/a.png", "y/b.png"], ["x-a", "y-a", "b"]),
        (["x/a.png", "x/a.jpg"], ["a.png", "a.jpg"]),
        (["1/x/a.png", "2/x/a.png"], ["1-x-a", "2-x-a"]),
        (["a.png", "a.png"], ["a", "a"]),
    ],
)
def test_each_picture_has_a_stem_of_its_own_and_no_longer_than_it_must(images: list[str], stems: list[str]) -> None:
    assert [distinct_stems([Path(image) for image in images])[Path(image)] for image in images] == stems


def test_two_links_to_one_picture_have_a_stem_each(tmp_path: Path) -> None:
    (tmp_path / "block.png").write_bytes(b"")
    links = [tmp_path / "monday.png", tmp_path / "tuesday.png"]
    for link in links:
        link.symlink_to("block.png")
    assert distinct_stems(links) == dict(zip(links, ("monday", "tuesday"), strict=True))


def test_a_stem_made_of_folders_is_not_that_of_another_picture() -> None:
    images = [Path("/p/left/a.png"), Path("/p/right/a.png"), Path("/p/left-a.png")]
    assert len(set(distinct_stems(images).values())) == 3
