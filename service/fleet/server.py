"""The fleet's process: its listener in a thread, its page in another's stead, both until a signal."""

from __future__ import annotations

import importlib.metadata
import logging

from service.fleet.listener import Listener
from service.fleet.page import Pages
from service.fleet.settings import Fleet
from service.fleet.store import Store, StoreError
from service.fleet.views import FleetView, compared, viewer
from service.web.http_server import certificate_mistake, http_server, listening

log = logging.getLogger("combtrace.fleet")


class FleetError(Exception):
    """The fleet cannot be served: why, what to do."""


def serve(settings: Fleet) -> None:
    """Until SIGTERM or Ctrl-C; raise FleetError."""
    page = settings.page
    why_not = certificate_mistake(page.certificate, page.key)
    if why_not is not None:
        raise FleetError(why_not)
    try:
        listener_socket = listening(page.host, page.port)
    except OSError as error:
        raise FleetError(
            f"page: {page.host}:{page.port} cannot be listened on: {error.strerror or error}. Set another page.port"
        ) from error
    with listener_socket:
        try:
            listener = Listener(settings, Store(settings.store))
        except StoreError as error:
            raise FleetError(str(error)) from error
        see = viewer(settings)

        def look() -> FleetView:
            return FleetView(connected=listener.connected, cells=compared(listener.look(see)))

        pages = Pages(page, look, importlib.metadata.version("combtrace"))
        listener.start()
        try:
            log.info("fleet: http%s://%s:%d/", "s" if page.certificate else "", page.host, page.port)
            http_server(pages.application(), page.certificate, page.key).run([listener_socket])
        finally:
            listener.close()
