"""Journals as another hand left them."""

from __future__ import annotations

import sqlite3
from pathlib import Path


def changed(path: Path, *statements: str) -> None:
    """Do the statements to the database; it is committed and closed."""
    database = sqlite3.connect(path)
    for statement in statements:
        database.execute(statement)
    database.commit()
    database.close()
