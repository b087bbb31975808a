"""Whether metrics, the operator's page and OPC UA could listen where they are configured to, and telemetry has what it
needs.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator

from service.check_result import CheckResult, fault, ok
from service.config.config import Config
from service.config.plant import Telemetry
from service.daemon.listening_socket import bound


def check_listening(config: Config, running: int | None) -> Iterator[CheckResult]:
    """What metrics, telemetry, page and OPC UA need, ports among it. running: the process that listens by rights."""
    if config.metrics is not None:
        if importlib.util.find_spec("prometheus_client") is None:
            yield fault(
                "metrics", "prometheus_client is not installed", "Install combtrace[metrics], or remove metrics"
            )
        elif (why := _why_not(config.metrics.host, config.metrics.port, running)) is not None:
            yield fault("metrics", why, "Set another metrics.host or metrics.port")
        else:
            yield ok("metrics", f"{config.metrics.host}:{config.metrics.port}")
    if config.telemetry is not None:
        yield _telemetry(config.telemetry)
    for name in ("page", "opcua"):
        settings = getattr(config, name)
        why = None if settings is None else _why_not(settings.host, settings.port, running)
        if why is not None:
            yield fault(name, why, f"Set another {name}.host or {name}.port")


def _telemetry(settings: Telemetry) -> CheckResult:
    """Whether it could begin; the broker itself may come and go."""
    if importlib.util.find_spec("paho") is None:
        return fault("telemetry", "paho-mqtt is not installed", "Install combtrace[mqtt], or remove telemetry")
    from service.telemetry.session import password_of, tls_context

    try:
        password_of(settings)
        if settings.tls is not None:
            tls_context(settings)
    except ValueError as error:
        return fault("telemetry", str(error), "Check telemetry.password_file and telemetry.tls")
    return ok("telemetry", f"{settings.group}/{settings.node} to {settings.host}:{settings.port}")


def _why_not(host: str, port: int, running: int | None) -> str | None:
    """Why nobody could listen there; None where one could, or does."""
    if running is not None:
        return None
    try:
        bound(host, port).close()
    except (OSError, UnicodeError) as error:
        return f"{host}:{port} cannot be listened on: {getattr(error, 'strerror', None) or error}"
    return None
