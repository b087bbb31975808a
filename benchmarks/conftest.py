"""Tests of benchmarks lie beside them, and may leave as little open as all others."""

from tests.support.leaks import no_task_is_left, nothing_is_left, pytest_collection_modifyitems

__all__ = ["no_task_is_left", "nothing_is_left", "pytest_collection_modifyitems"]
