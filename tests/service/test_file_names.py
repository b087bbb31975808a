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
