"""`combtrace judge --annotate FOLDER`: the page on which true outlines are drawn."""

from __future__ import annotations

import argparse
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from service.cli.errors import EXIT_OK, UserError
from service.cli.options.tracing import Tracing
from service.cli.pictures.given_pictures import pictures_in

if TYPE_CHECKING:
    from service.measuring.measurement import Measurement

HOST = "127.0.0.1"


def annotate(args: argparse.Namespace) -> int:
    """Serve the page until Ctrl-C; raise UserError."""
    for option in ("json", "page"):
        if getattr(args, option) is not None:
            raise UserError(f"--{option}: nothing is judged with --annotate. Leave one of them out")
    if args.port is not None and not 0 < args.port < 65536:
        raise UserError(f"--port {args.port}: expected 1 to 65535")
    try:
        from service.judging.annotation import Annotation
        from service.web.http_server import http_server, listening
    except ModuleNotFoundError as error:
        raise UserError(f"--annotate: {error.name} is not installed. Install combtrace[page]") from error
    images, _ = pictures_in(args.folder)
    tracing = Tracing.of(args)

    def measured(image: Path) -> Measurement:
        return tracing.traced(image)[1]

    page = Annotation(images, measured)
    try:
        listener = listening(HOST, args.port or 0)
    except OSError as error:
        raise UserError(
            f"--port {args.port}: cannot be listened on: {error.strerror}. Name another, or none"
        ) from error
    with listener, suppress(KeyboardInterrupt):
        address = f"http://{HOST}:{listener.getsockname()[1]}{page.path}"
        print(f"{len(images)} pictures to draw outlines on, until Ctrl-C: {address}", flush=True)
        http_server(page.application()).run([listener])
    return EXIT_OK
