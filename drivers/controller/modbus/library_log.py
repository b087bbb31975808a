"""The Modbus library's own log, capped."""

from __future__ import annotations

import logging

LIBRARY_LOGGER = "pymodbus.logging"


def cap_library_log() -> None:
    """Silence the library below CRITICAL, unless somebody has set its level.

    It writes a dump of the last frames at every time-out and every refused request, which floods a log in the very
    hours in which it is read; and all that it knows is raised or answered by the drivers.
    """
    logger = logging.getLogger(LIBRARY_LOGGER)
    if logger.level == logging.NOTSET:
        logger.setLevel(logging.CRITICAL)
