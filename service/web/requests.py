"""What a request holds, checked: from where it comes, the job it names, its parameters, its body."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import TypeVar

from pydantic import BaseModel, ValidationError
from starlette.requests import Request
from starlette.responses import Response

from service.link.job_numbers import LARGEST_JOB
from service.web.commands import Commands, RequestRefused
from service.web.guard import plain_address

Endpoint = Callable[[Request], Awaitable[Response]]

M = TypeVar("M", bound=BaseModel)


def address_of(request: Request) -> str:
    """Whose it is, for notes and bounds."""
    return "unknown" if request.client is None else plain_address(request.client.host)


async def holder_of(request: Request, commands: Commands, *, by_pin: bool = True) -> str:
    """Who gives the order that it is, by token, or where that is enough by PIN; raise RequestRefused."""
    return await commands.holder(request.headers.get("authorization"), address_of(request), by_pin=by_pin)


def job_number(request: Request) -> int:
    """The job of its path; raise RequestRefused."""
    number = whole(request.path_params["job"], LARGEST_JOB, digits=10)
    if number is None:
        raise RequestRefused(404, "a job is a number from 1 on")
    return number


def whole(text: str, most: int, digits: int = 16) -> int | None:
    """The whole number from 1 to `most` that a text of so many digits at most is, None where it is none."""
    fits = text.isascii() and text.isdecimal() and len(text) <= digits and 1 <= int(text) <= most
    return int(text) if fits else None


def whole_number(request: Request, name: str, most: int, otherwise: int | None) -> int | None:
    """A parameter from 1 to `most`, `otherwise` where it is left out; raise RequestRefused."""
    text = request.query_params.get(name)
    if text is None:
        return otherwise
    number = whole(text, most)
    if number is None:
        raise RequestRefused(400, f"{name} is {text[:20]!r}, expected a whole number from 1 to {most}")
    return number


def truth(request: Request, name: str) -> bool:
    """A parameter that is true or false, false where it is left out; raise RequestRefused."""
    text = request.query_params.get(name, "false")
    if text not in ("true", "false"):
        raise RequestRefused(400, f"{name} is {text[:20]!r}, expected true or false")
    return text == "true"


async def body(request: Request, model: type[M]) -> M:
    """What it carries; raise RequestRefused where that is not of the model."""
    try:
        return model.model_validate_json(await request.body() or b"{}")
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        where = ".".join(map(str, first["loc"])) or "the body"
        raise RequestRefused(422, f"{where}: {first['msg']}") from error
