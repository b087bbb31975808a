"""The live view's endpoints."""

from __future__ import annotations

from collections.abc import Awaitable, Callable

from starlette.requests import Request
from starlette.responses import Response

from service.web.commands import RequestRefused
from service.web.looks.live_looks import LiveLooks
from service.web.looks.models import LiveAnswer
from service.web.openapi import Operation, Parameter
from service.web.requests import whole, whole_number

LARGEST_LOOK = 2**53 - 1

OPERATIONS = (
    Operation(
        "GET",
        "/live",
        "What the camera sees now, and what a job would make of it; who asks keeps it looking for some seconds",
        LiveAnswer,
        {400: "A parameter is not as expected."},
        (Parameter("after", {"type": "integer", "minimum": 1}, "Only a look with a higher number."),),
    ),
    Operation(
        "GET",
        "/live/{look}",
        "A look's frame, made small",
        "image/jpeg",
        {404: "It is not kept: only those of the last looks are."},
        (Parameter("look", {"type": "integer", "minimum": 1}, "Its number.", required=True),),
    ),
)


class LookEndpoints:
    """Looks for whoever may see the page's pictures."""

    def __init__(self, looks: LiveLooks) -> None:
        self._looks = looks

    def routes(self) -> dict[str, Callable[[Request], Awaitable[Response]]]:
        """Endpoints by path."""
        return {"/live": self.live, "/live/{look}": self.picture}

    async def live(self, request: Request) -> Response:
        """The newest look."""
        after = whole_number(request, "after", LARGEST_LOOK, 0) or 0
        return Response(self._looks.answer(after).model_dump_json(), media_type="application/json")

    async def picture(self, request: Request) -> Response:
        """A look's frame."""
        found = self._looks.picture(whole(request.path_params["look"], LARGEST_LOOK) or 0)
        if found is None:
            raise RequestRefused(404, "that look is not kept. Ask /api/v1/live for the newest")
        # A look's number never comes again, so that the page may load it first and draw it then.
        return Response(found, media_type="image/jpeg", headers={"cache-control": "private, max-age=60, immutable"})
