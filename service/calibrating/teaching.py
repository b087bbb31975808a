"""The empty table, taught by pictures of it: averaged where nothing lies there and nothing moves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from contour.errors import EdgeContradicted, NoBlockFound, PictureError
from contour.image.taught_table import TaughtTable, teach
from contour.tracing.trace import TraceSettings
from contour.tracing.tracing import trace


class TableRefused(Exception):
    """The pictures show no empty table that is still: what was seen, and what to do."""


def taught_table(pictures: Sequence[NDArray[np.uint8]]) -> TaughtTable:
    """The table of pictures of it; raise TableRefused."""
    try:
        table = teach(pictures)
        found = trace(table.picture, TraceSettings())
    except NoBlockFound:
        return table
    except PictureError as error:
        raise TableRefused(str(error)) from error
    except EdgeContradicted as error:
        raise TableRefused(f"a block seems to lie on the table: {error}. Clear the table") from error
    if not found.reaches_frame:
        x, y = found.contour.exterior.mean(axis=0)
        raise TableRefused(
            f"a block seems to lie on the table, around ({x:.0f}, {y:.0f}) px. Clear the table and teach it again"
        )
    return table
