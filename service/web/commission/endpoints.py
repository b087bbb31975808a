"""The endpoints of commissioning. Actions come one at a time and end by themselves, whoever watches."""

from __future__ import annotations

import asyncio
import base64
import hashlib
import logging
from functools import partial

from starlette.requests import Request
from starlette.responses import Response

from service.measuring.calibration_report import STYLE
from service.state import State
from service.web.commands import Commands, Order, RequestRefused
from service.web.commission import models
from service.web.commission.actions import Action, actions
from service.web.commission.bench import Bench
from service.web.commission.score import commission_of
from service.web.commission.session import StepRefused
from service.web.daemon_access import DaemonAccess
from service.web.evidence_files import NoPicture, Pictures, tag_of
from service.web.openapi import Operation, Parameter
from service.web.requests import Endpoint, address_of, body, holder_of, whole

log = logging.getLogger("combtrace.page")

WIDTH_PX = 320
LARGEST_SHOT = 1_000_000
STYLE_DIGEST = base64.b64encode(hashlib.sha256(STYLE.encode()).digest()).decode()
REPORT_POLICY = (
    f"default-src 'none'; style-src 'sha256-{STYLE_DIGEST}'; img-src data:; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'"
)
"""A report is one file, with its style and pictures in it: these and nothing else may apply."""

_NOT_NOW = {
    401: "No token, or a wrong one; a PIN is not enough.",
    403: "No token file is configured, or another site's page asks.",
    409: "Something else is under way, or the service is not halted; `holder` has the word.",
    422: "The body is not as expected.",
    429: "Too many wrong tokens, or too many commands: see Retry-After.",
    503: "The service does not answer, or the journal cannot keep who asked.",
}


def _done(name: str, text: str, asked: type[models.ActionRequest] = models.ActionRequest) -> Operation:
    return Operation(
        "POST", f"/commission/{name}", text, models.Commission, _NOT_NOW, request=asked, status=202, token=True
    )


OPERATIONS = (
    Operation("GET", "/commission", "How far each step of commissioning is", models.Commission, {}),
    Operation("GET", "/commission/report", "The last calibration's report", "text/html", {404: "There is none."}),
    Operation(
        "GET",
        "/commission/shots/{shot}",
        "A picture of the board, made small",
        "image/jpeg",
        {404: "There is no such picture."},
        (Parameter("shot", {"type": "integer", "minimum": 1}, "Its number.", required=True),),
    ),
    _done("look", "Note what the camera shows", models.LookRequest),
    _done("board", "Which board it is; its pictures are looked at anew", models.BoardRequest),
    _done("shoot", "Take a picture of the board", models.ShootRequest),
    _done("remove", "Let go of a picture", models.RemoveRequest),
    _done("calibrate", "Make a calibration and its report; halted only", models.CalibrateRequest),
    _done("adopt", "Write that calibration to its file and use it; halted only"),
    _done("height", "Note how high the block is", models.HeightRequest),
    _done("point", "Note a place that was jogged to", models.PointRequest),
    _done("forget", "Let go of such a place", models.ForgetRequest),
    _done("align", "Tie the calibration to the machine by these places; halted only", models.AlignRequest),
    _done("marks", "Keep the fixed marks that the camera sees with the calibration; halted only", models.MarksRequest),
    _done("teach", "Teach the empty table; halted only"),
    _done("probe", "See what the controller can do; halted only", models.ProbeRequest),
    _done("apply", "Put what the probe would change into the configuration; halted only"),
)


async def _nothing(_asked: models.ActionRequest) -> str:
    return ""


BEGIN = Action("board", models.ActionRequest, False, _nothing)


class CommissionEndpoints:
    """The endpoints."""

    def __init__(self, daemon: DaemonAccess, commands: Commands, pictures: Pictures) -> None:
        self._daemon = daemon
        self._commands = commands
        self._bench = Bench(daemon)
        self._actions = actions(self._bench)
        self._pictures = pictures
        self._running: str | None = None
        self._task: asyncio.Task[None] | None = None

    def close(self) -> None:
        """Let go of threads; an action ends at its next step."""
        self._bench.close()

    def gets(self) -> dict[str, Endpoint]:
        """What is looked at, by path."""
        return {"/commission": self.state, "/commission/report": self.report, "/commission/shots/{shot}": self.shot}

    def posts(self) -> dict[str, Endpoint]:
        """What is done, by path."""
        return {f"/commission/{name}": partial(self.act, name, action) for name, action in self._actions.items()}

    async def report(self, _request: Request) -> Response:
        """The report of the last calibration."""
        try:
            text = await asyncio.to_thread(self._bench.session.report.read_bytes)
        except OSError as error:
            raise RequestRefused(404, "there is no report. Calibrate first") from error
        return Response(text, media_type="text/html", headers={"content-security-policy": REPORT_POLICY})

    async def state(self, _request: Request) -> Response:
        """All steps, as they stand."""
        if self._task is None:  # pictures of before a restart are looked at when somebody asks for the first time
            self._running = "begin"
            self._task = asyncio.create_task(self._carry_out(BEGIN, models.ActionRequest(), None))
        return await self._told()

    async def _told(self, status: int = 200) -> Response:
        bench = self._bench
        told = await asyncio.to_thread(
            commission_of, self._daemon.sources, bench.session, bench.judged, self._running, bench.progress
        )
        return Response(told.model_dump_json(), status, media_type="application/json")

    async def shot(self, request: Request) -> Response:
        """A picture of the board, made small."""
        number = whole(request.path_params["shot"], LARGEST_SHOT)
        found = next((one for one in self._bench.session.shots if one.number == number), None)
        if found is None:
            raise RequestRefused(404, "there is no such picture of a board")
        try:
            picture = await self._pictures.small(found.path, tag_of(found.path), WIDTH_PX)
        except (NoPicture, OSError) as error:
            raise RequestRefused(404, f"picture {number}: {error}") from error
        return Response(picture, media_type="image/jpeg")

    async def act(self, name: str, action: Action, request: Request) -> Response:
        """Begin an action; what becomes of it is asked for."""
        address = address_of(request)
        who = await holder_of(request, self._commands, by_pin=False)
        asked = await body(request, action.asked)
        self._check_free(action)
        self._running = name
        try:
            detail = asked.model_dump_json(exclude={"take_over"}, exclude_defaults=True)
            order = Order(f"commission {name}", detail, "nothing is begun", asked.take_over)
            note = await self._commands.begun(who, address, order)
        except RequestRefused:
            self._running = None
            raise
        self._task = asyncio.create_task(self._carry_out(action, asked, note))
        return await self._told(202)

    def _check_free(self, action: Action) -> None:
        sources = self._daemon.sources
        if self._running is not None:
            raise RequestRefused(409, f"{self._running} is under way. Wait for its end")
        if action.halted and not (sources.health.state is State.HALTED and sources.executor.idle):
            raise RequestRefused(409, "this is done only while the service is halted and idle. Halt it first")

    async def _carry_out(self, action: Action, asked: models.ActionRequest, note: int | None) -> None:
        """To its end, which notes and journal tell; a defect of ours ends it alone. note None: nobody asked for it."""
        faults = self._bench.session.notes.faults
        if note is not None:
            faults.pop(action.step, None)
        try:
            await self._bench.begun()
            result = await action.do(asked)
        except StepRefused as refused:
            result = f"refused: {refused}"
            faults[action.step] = str(refused)
        except Exception as error:  # the one owner of its defects: the page goes on
            log.exception("page: commission: internal error")
            result = faults[action.step] = f"internal error: {type(error).__name__}: {error}. Report it with the log"
        try:
            if note is not None:
                await asyncio.to_thread(self._bench.session.save)
        except StepRefused as refused:
            faults[action.step] = str(refused)
        await self._commands.note_result(note, result)
        self._running, self._bench.progress = None, ""
