"""What a replay of archives cannot go on from."""

from __future__ import annotations

from typing import Final

INSTALL: Final = "Install: pip install 'combtrace[cluster]'"


class ReplayError(Exception):
    """Nothing can be replayed, or not so: seen, expected, next step. Rows that were written stay."""
