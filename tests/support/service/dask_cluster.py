"""A Dask cluster on loopback, of processes of its own, as `dask scheduler` and `dask worker` start them."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from tests.support.processes.processes import ROOT, free_port, until
from tests.support.real_parts import CLUSTER, need_module

ANOTHER_OPENCV = 'import cv2; cv2.__version__ = "4.13.0"'  # what a worker with it would say


class DaskCluster:
    """A scheduler, and the workers of one thread each that are added to it."""

    def __init__(self, folder: Path, variables: Mapping[str, str]) -> None:
        port = free_port()
        self.url = f"tcp://127.0.0.1:{port}"
        self._folder = folder
        self._environment = {**os.environ, "PYTHONPATH": str(ROOT), **variables}
        self._started: list[subprocess.Popen[bytes]] = []
        command = ("distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", str(port))
        self.scheduler = self._start(*command).pid

    def add_worker(self, *, another_opencv: bool = False) -> subprocess.Popen[bytes]:
        """One more worker, which nobody starts again when it ends."""
        preload = self._folder / "another_opencv.py"
        preload.write_text(ANOTHER_OPENCV)
        more = ("--preload", str(preload)) if another_opencv else ()
        return self._start("distributed.cli.dask_worker", self.url, "--nthreads", "1", "--no-nanny", *more)

    def wait_for(self, workers: int) -> None:
        """Return once so many have made themselves known."""
        logs = [self._folder / f"dask-{number}.log" for number in range(1, len(self._started))]
        until(lambda: sum("Registered to" in log.read_text() for log in logs) >= workers, 60, f"{workers} workers")

    def _start(self, *command: str) -> subprocess.Popen[bytes]:
        with (self._folder / f"dask-{len(self._started)}.log").open("wb") as log:
            words = [sys.executable, "-m", *command, "--no-dashboard"]
            process = subprocess.Popen(words, stdout=log, stderr=log, env=self._environment, cwd=self._folder)
        self._started.append(process)
        return process

    def stop(self) -> None:
        """End all of it."""
        for process in self._started:
            process.kill()
            process.wait()


@contextmanager
def cluster(folder: Path, variables: Mapping[str, str] | None = None) -> Iterator[DaskCluster]:
    """A cluster without workers, its logs in the folder."""
    need_module("distributed", CLUSTER)
    started = DaskCluster(folder, variables or {})
    try:
        yield started
    finally:
        started.stop()
