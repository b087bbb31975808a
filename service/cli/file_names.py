"""Names for files that are made of pictures, one each, though pictures of several folders be called alike."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path


def distinct_stems(images: Sequence[Path]) -> dict[Path, str]:
    """A stem for each picture: its own where no other has it, else with as many of its folders as tell it apart.

    Pictures of one folder that differ in their suffix only keep it: `left-a`, `right-a`, `b.png`, `b.jpg`.
    """
    whole = {image: image.resolve() for image in images}
    alike: dict[str, set[Path]] = {}
    for path in whole.values():
        alike.setdefault(path.stem, set()).add(path)
    stems = {}
    for image, path in whole.items():
        group = alike[path.stem]
        stems[image] = path.stem if len(group) == 1 else _distinct(path, group)
    return stems


def _distinct(path: Path, group: set[Path]) -> str:
    """The name of a path that no other of the group has, with as few folders as possible."""
    with_suffix = Counter(other.with_suffix("") for other in group)[path.with_suffix("")] > 1
    own = path if with_suffix else path.with_suffix("")
    for depth in range(1, len(own.parts)):
        tail = own.parts[-depth:]
        others = (other if with_suffix else other.with_suffix("") for other in group if other != path)
        if all(other.parts[-depth:] != tail for other in others):
            return "-".join(tail)
    return "-".join(own.parts[1:])
