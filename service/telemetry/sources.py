"""What may be looked at of the running daemon from any thread; nothing in the daemon waits for whoever looks."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from service.config.recipes import Recipe
from service.daemon.storage_watch import StorageWatch
from service.jobs.executor import Executor
from service.jobs.health import Health
from service.link.link import Link
from service.measuring.calibration_guard import CalibrationGuard
from service.records.archive_writer import ArchiveWriter


@dataclass(frozen=True)
class DaemonSources:
    """The daemon's parts; None where it has no such part. recipes: those in force, by number."""

    version: str
    health: Health
    executor: Executor
    link: Link | None = None
    archive: ArchiveWriter | None = None
    storage: StorageWatch | None = None
    guard: Callable[[], CalibrationGuard | None] = lambda: None
    recipes: Callable[[], Mapping[int, Recipe]] = dict
