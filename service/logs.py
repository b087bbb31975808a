"""The log: one line a record on standard error, libraries kept quiet."""

from __future__ import annotations

import logging


def start_logging(level: int) -> None:
    """Log combtrace's own records from `level` up. pymodbus, which dumps frames at each lost reply, from errors up."""
    logging.basicConfig(format="%(asctime)s %(levelname)s %(name)s: %(message)s", level=logging.WARNING)
    logging.getLogger("combtrace").setLevel(level)
    logging.getLogger("pymodbus").setLevel(logging.CRITICAL)
