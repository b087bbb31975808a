"""What is told beside the jobs: metrics, telemetry, page and OPC UA, which have to be installed only then."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Awaitable
from contextlib import ExitStack
from typing import TYPE_CHECKING

from service.config.config import Config
from service.config.controllers import NoController
from service.daemon.daemon import Parts
from service.jobs.cycle import Cycle
from service.probing.probe import ProbeFindings, probed
from service.telemetry.sources import DaemonSources
from service.wiring.devices import controller_words, make_controller, single_frames
from service.wiring.errors import WiringError

if TYPE_CHECKING:
    from service.web.daemon_access import CommissionSources


def add_metrics(config: Config, parts: Parts, cycle: Cycle, opened: ExitStack) -> None:
    """Serve metrics where the configuration asks for them; raise WiringError."""
    if config.metrics is None:
        return
    try:
        from service.telemetry.metrics import MetricsError, serve
    except ImportError as error:
        raise WiringError(
            f"metrics: {error.name} is not installed. Install combtrace[metrics], or remove metrics"
        ) from error
    try:
        metrics, parts.metrics = serve(config.metrics, daemon_sources(parts, cycle))
    except MetricsError as error:
        raise WiringError(str(error)) from error
    opened.callback(parts.metrics.close)
    parts.executor.on_settled.append(metrics.job_ended)


def add_telemetry(config: Config, parts: Parts, cycle: Cycle, opened: ExitStack) -> None:
    """Tell a broker where the configuration asks for it; raise WiringError."""
    if config.telemetry is None or parts.opening is not None:
        return
    try:
        from service.telemetry.sender import Sender
    except ModuleNotFoundError as error:
        raise WiringError(
            f"telemetry: {error.name} is not installed. Install combtrace[mqtt], or remove telemetry"
        ) from error
    sources = daemon_sources(parts, cycle)
    parts.telemetry = Sender(config.telemetry, sources, config.journal.path, config.service.state_dir)
    opened.callback(parts.telemetry.close)


def daemon_sources(parts: Parts, cycle: Cycle) -> DaemonSources:
    """What may be looked at of these parts from any thread."""
    return DaemonSources(
        importlib.metadata.version("combtrace"),
        parts.health,
        parts.executor,
        parts.link,
        parts.archive,
        parts.storage,
        lambda: cycle.measurer.guard,
        lambda: cycle.recipes,
    )


def add_page(config: Config, parts: Parts, cycle: Cycle) -> None:
    """Serve the operator's page where the configuration asks for it; raise WiringError."""
    if config.page is None:
        return
    try:
        from service.daemon.recipe_book import RecipeBook
        from service.jobs.spare_camera import LookSources
        from service.web.daemon_access import PageSources
        from service.web.server import PageError, make_page
    except ModuleNotFoundError as error:
        raise WiringError(f"page: {error.name} is not installed. Install combtrace[page], or remove page") from error
    looks = LookSources(
        single_frames(parts.camera),
        parts.pool,
        idle=lambda: parts.executor.idle,
        works=lambda: parts.health.fault("camera") is None,
        plan=lambda: cycle.plan,
        timeout_s=config.camera.timeout_s,
        spare=config.camera.has_spare_frames,
    )
    sources = PageSources(
        parts.health,
        parts.executor,
        parts.journal,
        config.journal.path,
        config.archive.path,
        config.archive.max_bytes,
        lambda: tuple((number, recipe.name) for number, recipe in sorted(cycle.recipes.items())),
        lambda: cycle.measurer.guard,
        looks,
        _commission_sources(config, parts),
        camera=config.camera.kind,
        controller=controller_words(config),
        link=parts.link,
        archive=parts.archive,
        storage=parts.storage,
        book=None if parts.reloader is None else RecipeBook(parts.reloader),
    )
    try:
        parts.page = make_page(config.page, sources)
    except PageError as error:
        raise WiringError(str(error)) from error


def add_opcua(config: Config, parts: Parts, cycle: Cycle, opened: ExitStack) -> None:
    """Serve OPC UA where the configuration asks for it; raise WiringError."""
    if config.opcua is None:
        return
    try:
        from service.opcua.server import OpcuaServer, OpcuaSources
        from service.opcua.trust import OpcuaError
    except ModuleNotFoundError as error:
        raise WiringError(f"opcua: {error.name} is not installed. Install combtrace[opcua], or remove opcua") from error
    folder = config.service.state_dir / "opcua"
    sources = OpcuaSources(parts.health, parts.executor, parts.journal, lambda: cycle.recipes, folder)
    try:
        server = parts.opcua = OpcuaServer(config.opcua, sources)
    except OpcuaError as error:
        raise WiringError(f"opcua: {error}") from error
    opened.callback(server.close)


def _commission_sources(config: Config, parts: Parts) -> CommissionSources:
    from service.web.daemon_access import CommissionSources

    reloader = parts.reloader

    async def no_reload() -> str | None:
        return "the daemon was started without a file of its configuration. Restart it"

    def probe(write: bool) -> Awaitable[ProbeFindings]:
        controller, settings = make_controller(config), config.controller
        assert controller is not None
        assert not isinstance(settings, NoController)
        return probed(controller, settings.timeout_s, write=write)

    return CommissionSources(
        config.service.state_dir / "commission",
        lambda: config if reloader is None else reloader.config,
        None if reloader is None else reloader.path,
        no_reload if reloader is None else reloader.reload,
        None if parts.link is None else probe,
    )
