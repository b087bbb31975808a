"""The page on which true outlines are drawn: pictures of a folder out, NAME.json beside them in."""

from __future__ import annotations

import asyncio
import hmac
import secrets
from collections.abc import Callable, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any, Literal

import cv2
import numpy as np
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Mount, Route
from starlette.types import ASGIApp, Receive, Scope, Send

from contour.errors import ContourError
from contour.geometry.rings import Contour
from drivers.camera import CameraError
from drivers.camera.files.decode import read_picture
from drivers.camera.files.folder import shown
from service.judging.truth_file import Truth, TruthFileError, parsed_truth, read_object, save_truth, truth_path
from service.measuring.measurement import Measurement
from service.web.api import problem, with_problems
from service.web.commands import RequestRefused
from service.web.guard import Guard
from service.web.html import TYPES
from service.web.requests import Endpoint, body

LARGEST_BODY = 1_000_000
MOST_VERTICES = 20_000
JPEG_QUALITY = 95
PAGE = "annotate.html"
SHARED = ("dom.js", "icon.svg", "page.css")  # of the operator's page

Measure = Callable[[Path], Measurement]
"""What is traced in a picture file; raises CameraError, ContourError."""

_Ring = Annotated[list[tuple[FiniteFloat, FiniteFloat]], Field(min_length=3, max_length=MOST_VERTICES)]


class DrawnTruth(BaseModel):
    """An outline as the page sends it, in pixels."""

    model_config = ConfigDict(extra="forbid")
    outer: _Ring
    holes: Annotated[list[_Ring], Field(max_length=1000)]
    edge: Literal["cut", "cells", "mixed"]


class Annotation:
    """The page, for the pictures that were in the folder at its start."""

    def __init__(self, images: Sequence[Path], measure: Measure) -> None:
        self._images = images
        self._measure = measure
        self._measuring = asyncio.Lock()  # one at a time: each takes a processor and the picture's memory
        self._token = secrets.token_urlsafe(24)
        own, shared = files("service.judging") / "static", files("service.web") / "static"
        self._files = {entry.name: entry.read_bytes() for entry in own.iterdir()}
        self._files |= {name: (shared / name).read_bytes() for name in SHARED}

    @property
    def path(self) -> str:
        """The page's path, with the token that only who started it knows."""
        return f"/{self._token}/"

    def application(self) -> ASGIApp:
        """All that is served: to this machine's own address, and to whoever has the token."""
        gets: dict[str, Endpoint] = {
            "/": self.page,
            "/static/{name}": self.file,
            "/pictures": self.pictures,
            "/pictures/{number:int}/image": self.image,
            "/pictures/{number:int}/truth": self.truth,
            "/pictures/{number:int}/contour": self.contour,
        }
        routes = [Route(path, with_problems(endpoint), methods=["GET"]) for path, endpoint in gets.items()]
        routes.append(Route("/pictures/{number:int}/truth", with_problems(self.save), methods=["POST"]))

        async def unknown(_request: Request, _error: Exception) -> Response:
            return problem(404, "there is nothing here")

        served = Starlette(
            routes=[Mount(self.path.rstrip("/"), routes=routes)], exception_handlers={404: unknown, 405: unknown}
        )
        return Guard(self._for_holders(served), (), LARGEST_BODY)

    def _for_holders(self, app: ASGIApp) -> ASGIApp:
        """The application for those who have the token; for others there is nothing."""

        async def answer(scope: Scope, receive: Receive, send: Send) -> None:
            asked = scope["path"].split("/")[1:2] if scope["type"] == "http" else []
            if asked and hmac.compare_digest(asked[0].encode(), self._token.encode()):
                await app(scope, receive, send)
            else:
                await problem(404, "there is nothing here: open the whole address")(scope, receive, send)

        return answer

    async def page(self, _request: Request) -> Response:
        """The page itself."""
        return Response(self._files[PAGE], media_type="text/html")

    async def file(self, request: Request) -> Response:
        """A file of the page."""
        name = request.path_params["name"]
        if name not in self._files:
            raise RequestRefused(404, "there is no such file")
        return Response(self._files[name], media_type=TYPES.get(name.rpartition(".")[2], "text/html"))

    async def pictures(self, _request: Request) -> Response:
        """Names, and of which the truth is there."""
        told = [{"name": shown(image.name), "drawn": truth_path(image).exists()} for image in self._images]
        return JSONResponse(told)

    async def image(self, request: Request) -> Response:
        """Its pixels, as they are stored: a browser would turn a JPEG that says so, and knows no TIFF."""
        image = self._image(request)
        try:
            data = await asyncio.to_thread(_jpeg, image)
        except CameraError as error:
            raise RequestRefused(422, str(error)) from error
        return Response(data, media_type="image/jpeg")

    async def truth(self, request: Request) -> Response:
        """The truth that was saved, whatever way its rings run: they are mended here."""
        path = truth_path(self._image(request))
        if not path.exists():
            return JSONResponse({"outer": [], "holes": [], "edge": None})
        try:
            truth = parsed_truth(read_object(path), path)
        except TruthFileError as error:
            raise RequestRefused(422, str(error)) from error
        return JSONResponse({**_rings(truth.outline), "edge": truth.edge})

    async def contour(self, request: Request) -> Response:
        """What is traced in the picture, and what speaks against it."""
        image = self._image(request)
        try:
            async with self._measuring:
                found = await asyncio.to_thread(self._measure, image)
        except (CameraError, ContourError) as error:
            raise RequestRefused(422, str(error)) from error
        if found.pixels is None:
            raise RequestRefused(422, "; ".join(found.texts) or "nothing was traced")
        return JSONResponse({**_rings(found.pixels), "findings": list(found.texts)})

    async def save(self, request: Request) -> Response:
        """Keep what was drawn."""
        image = self._image(request)
        drawn = await body(request, DrawnTruth)
        outline = Contour(np.array(drawn.outer), tuple(np.array(hole) for hole in drawn.holes))
        try:
            await asyncio.to_thread(save_truth, image, Truth(outline, drawn.edge))
        except TruthFileError as error:
            raise RequestRefused(422, str(error)) from error
        return JSONResponse({"saved": shown(truth_path(image).name)})

    def _image(self, request: Request) -> Path:
        number: int = request.path_params["number"]
        if number >= len(self._images):
            raise RequestRefused(404, f"there is no picture {number}, there are {len(self._images)}")
        return self._images[number]


def _rings(contour: Contour) -> dict[str, Any]:
    return {"outer": contour.exterior.tolist(), "holes": [hole.tolist() for hole in contour.holes]}


def _jpeg(image: Path) -> bytes:
    _, data = cv2.imencode(".jpg", read_picture(image), [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return data.tobytes()
