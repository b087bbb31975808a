"""Figures for Prometheus: what the daemon counts, and what it is like at the moment of a scrape.

Off unless the configuration has `metrics`; needs the extra `combtrace[metrics]`. Names and meanings:
docs/reference/metrics.md.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, ProcessCollector, start_http_server
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from service.jobs.health import PARTS
from service.link.link import Link
from service.records.job import Job
from service.state import State
from service.telemetry.sources import DaemonSources

if TYPE_CHECKING:
    from wsgiref.simple_server import WSGIServer

SECONDS_A_DAY = 86_400.0
BUCKETS = (0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 60.0)
STAGES = {"frame_ms": "frame", "pages_ms": "pages", "transfer_ms": "transfer", "total_ms": "job"}
PICTURE = {
    "level": ("combtrace_picture_level", "Grey level of the block's brightest parts in the last picture, 0 to 255"),
    "contrast": ("combtrace_picture_contrast", "Grey levels from cells to walls in the last picture"),
    "noise": ("combtrace_picture_noise", "Standard deviation of a pixel in the last picture, grey levels"),
    "blur_px": ("combtrace_picture_blur_pixels", "Standard deviation of the blur in the last picture, px"),
    "clipped_share": ("combtrace_picture_clipped_ratio", "Share of the block's pixels at full scale, last picture"),
}
UNCERTAINTY = ("combtrace_contour_uncertainty_metres", "95 % bound on the last contour's position, m")


class MetricsError(Exception):
    """Metrics cannot be served: where, why, what to do."""


class Metrics:
    """The daemon's registry; `job_ended` counts, all else is looked up in `DaemonSources`."""

    def __init__(self, sources: DaemonSources, *, now: Callable[[], float] = time.time) -> None:
        self.registry = CollectorRegistry()
        self._now = now
        self._jobs = self._counter("combtrace_jobs", "Jobs that have ended", ("outcome", "reason"))
        text = "Time of a stage, or of the whole job"
        self._stages = Histogram("combtrace_stage_seconds", text, ("stage",), buckets=BUCKETS, registry=self.registry)
        self._ended_at = self._gauge("combtrace_job_last_ended_timestamp_seconds", "Unix time of the last job's end")
        self._picture = {name: self._gauge(*described) for name, described in PICTURE.items()}
        self._uncertainty = self._gauge(*UNCERTAINTY)
        self.registry.register(_Moment(sources))
        ProcessCollector(registry=self.registry)

    def _counter(self, name: str, text: str, labels: tuple[str, ...]) -> Counter:
        return Counter(name, text, labels, registry=self.registry)

    def _gauge(self, name: str, text: str) -> Gauge:
        gauge = Gauge(name, text, registry=self.registry)
        gauge.set(float("nan"))  # not known yet is not zero
        return gauge

    def job_ended(self, job: Job) -> None:
        """Count a settled job, with its stages and its picture."""
        self._jobs.labels(str(job.outcome), "none" if job.reason is None else job.reason.label).inc()
        self._ended_at.set(self._now())
        report = job.report
        times = {stage: report.get(key) for key, stage in STAGES.items()}
        times |= {name: value for name, value in report.get("timings_ms", {}).items() if name != "total"}
        for stage, milliseconds in times.items():
            if milliseconds is not None:
                self._stages.labels(stage).observe(milliseconds / 1000)
        sure_mm = report.get("uncertainty_mm")
        _set(self._uncertainty, None if sure_mm is None else sure_mm / 1000)
        quality = report.get("quality") or {}
        for name, gauge in self._picture.items():
            _set(gauge, quality.get(name))


def _set(gauge: Gauge, value: float | None) -> None:
    gauge.set(float("nan") if value is None else value)


class _Moment(Collector):
    """Gauges that are read when they are asked for; called in the server's thread, so it only reads."""

    def __init__(self, sources: DaemonSources) -> None:
        self._sources = sources

    def collect(self) -> Iterator[Metric]:
        """All of them."""
        yield _one("combtrace_info", "Always 1; its label is the version", 1, version=self._sources.version)
        yield from self._service()
        yield from self._triggers()
        if self._sources.link is not None:
            yield from self._controller(self._sources.link)
        yield from self._storage()
        guard = self._sources.guard()
        if guard is not None and guard.age_days is not None:
            text = "Time since the calibration was made"
            yield _one("combtrace_calibration_age_seconds", text, guard.age_days * SECONDS_A_DAY)

    def _service(self) -> Iterator[Metric]:
        health = self._sources.health
        states = GaugeMetricFamily("combtrace_state", "1 for the state the service is in", labels=("state",))
        for state in State:
            states.add_metric([state.label], float(health.state is state))
        yield states
        found = health.faults()
        faults = GaugeMetricFamily("combtrace_fault", "1 for each part that does not work", labels=("part", "reason"))
        for part, fault in found.items():
            faults.add_metric([part, fault.reason.label], 1)
        yield faults
        up = GaugeMetricFamily("combtrace_part_up", "1 where a part works, 0 where it does not", labels=("part",))
        for part in dict.fromkeys([*PARTS, *found]):
            up.add_metric([part], float(part not in found))
        yield up

    def _triggers(self) -> Iterator[Metric]:
        executor = self._sources.executor
        triggers = CounterMetricFamily(
            "combtrace_triggers", "Triggers by what became of them", labels=("kind", "result")
        )
        for (kind, result), count in dict(executor.counts).items():
            triggers.add_metric([kind, result], count)
        yield triggers
        text = "Triggers not taken, as the register says: from 65535 on it begins anew"
        yield CounterMetricFamily("combtrace_missed_triggers", text, value=executor.missed)

    def _controller(self, link: Link) -> Iterator[Metric]:
        yield _one("combtrace_controller_up", "1 where the controller is reached and runs", link.fault() is None)
        yield CounterMetricFamily(
            "combtrace_controller_connections", "Connections opened", value=link.connection.opened
        )
        text = "Time of the last read of the controller's block"
        yield _one("combtrace_controller_round_trip_seconds", text, link.reading.round_trip_s)

    def _storage(self) -> Iterator[Metric]:
        storage, archive = self._sources.storage, self._sources.archive
        if storage is not None and storage.free_bytes is not None:
            yield _one("combtrace_journal_disk_free_bytes", "Free bytes of the journal's disk", storage.free_bytes)
        if archive is None:
            return
        figures = archive.figures
        yield _one("combtrace_archive_bytes", "Bytes of evidence that are kept", figures.bytes)
        yield _one("combtrace_archive_jobs", "Jobs of which evidence is kept", figures.jobs)
        evidence = CounterMetricFamily(
            "combtrace_evidence", "Evidence of jobs by what became of it", labels=("result",)
        )
        for result in ("stored", "dropped", "failed"):
            evidence.add_metric([result], getattr(figures, result))
        yield evidence


def _one(name: str, text: str, value: float | None, **labels: str) -> Metric:
    gauge = GaugeMetricFamily(name, text, labels=list(labels))
    gauge.add_metric(list(labels.values()), float("nan") if value is None else float(value))
    return gauge


class MetricsServer:
    """Serves a registry over HTTP in a thread of its own until `close`; raise MetricsError."""

    def __init__(self, metrics: Metrics, host: str, port: int) -> None:
        self._server: WSGIServer
        self._thread: threading.Thread
        try:
            self._server, self._thread = start_http_server(port, host, metrics.registry)
        except OSError as error:
            raise MetricsError(
                f"metrics: {host}:{port} cannot be listened on: {error.strerror or error}. Set another metrics.port"
            ) from error

    @property
    def port(self) -> int:
        """The port listened on."""
        return int(self._server.server_port)

    def close(self) -> None:
        """End it."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()


def serve(settings: Any, sources: DaemonSources) -> tuple[Metrics, MetricsServer]:
    """Metrics of a daemon, served as `config.Metrics` says."""
    metrics = Metrics(sources)
    return metrics, MetricsServer(metrics, settings.host, settings.port)
