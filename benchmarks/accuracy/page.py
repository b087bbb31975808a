"""docs/reports/accuracy.md from the tables of one run."""

from __future__ import annotations

import os
import platform
import shlex
import sys
from collections.abc import Sequence

import cv2
import numpy as np

from benchmarks.accuracy.pictures import Gallery
from benchmarks.page_section import PAGE, kept_sections

_HEAD = """# Accuracy and speed

This page is written by `make accuracy`; do not edit it by hand. This one came from
`python -m benchmarks.accuracy {arguments}`.

Every scene is rendered by `contour.synthetic` from an outline in millimetres through a camera with a lens, so the truth
is known exactly: material ends at the outline to 0.02 px before the lens blurs it. Scenes are
defined in `tests/support/scenes/bench_scenes.py`; those called `tuned-…` are for building methods, the others for
measuring. Random scenes come from `tests/support/scenes/random_scenes.py`, one a seed.

Not all definitions are older than the first results. After wall-tips had run once, `foam` went from `edge: cells` to
`cut` (it is a cut block, and did badly as `cells`), `lattice-closed-dark` got another outline, shop and random scenes
got cells that wobble and a softer border of glare under the block, and tears in random scenes were kept away from
corners. The faults that `fine-6px`, `fine-8px`, `lattice-closed`, `lattice-closed-dark`, `vacuum-table`,
`holes-shop`, `broken-off`, `blob-easy` and `foam` showed were known while wall-tips was built: those are not unseen.
Random scenes of fresh seeds are the stricter test.

- Distances run along all rings, exterior and holes, both ways (found to true, true to found); the worse way counts.
- Bias is signed, positive = the found contour lies outside the block.
- Ready-made ways (findContours, closing, concave hull, GrabCut) are given the true cell pitch and polarity; ours find
  both. Ours are given the lens, as the service is by its calibration.
- The paper's methods run through pixel centres and stay there: half a pixel of their bias is that.
"""


def write_page(blocks: Sequence[tuple[str, str]], gallery: Gallery, left_out: Sequence[str]) -> list[str]:
    """Write the page and its pictures; their names. Sections that other commands wrote are kept.

    `left_out` are the methods that this run did not measure.
    """
    kept = kept_sections(PAGE)
    paths = gallery.write()
    machine = (
        f"{os.cpu_count()} cores, Python {platform.python_version()}, numpy {np.__version__}, OpenCV {cv2.__version__}"
    )
    parts = [_HEAD.format(arguments=shlex.join(sys.argv[1:])), f"Measured on {machine}.\n"]
    if left_out:
        parts.append(f"Not measured in this run, to keep it short: {', '.join(left_out)}.\n")
    *tables, last = blocks
    parts += [f"## {title}\n\n{text}\n" for title, text in tables]
    parts += [f"{section}\n" for section in kept]
    parts.append(f"## The scenes, with the contour of {gallery.method}\n")
    parts += [f"![{path.stem}](../pictures/{path.name})\n" for path in paths]
    parts.append("In the close-ups the truth is red and the found contour green.\n")
    parts.append(f"## {last[0]}\n\n{last[1]}\n")
    PAGE.write_text("\n".join(parts), encoding="utf-8")
    return [str(path) for path in (PAGE, *paths)]
