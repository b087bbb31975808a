"""The REST interface under /api/v1. The page uses nothing else; `openapi.json` tells it to programs."""

from __future__ import annotations

import asyncio
import json
import logging
import math
from pathlib import Path
from typing import Any

import cv2
from pydantic import BaseModel
from starlette.requests import Request
from starlette.responses import FileResponse, Response
from starlette.routing import Route

from service.link.job_numbers import LARGEST_JOB
from service.reasons import Language, Reason
from service.records.archived_job import load_archived
from service.records.evidence import FRAME, Evidence, EvidenceError, job_fields
from service.records.job import Job
from service.records.journal_reader import JobFilter, JournalUnreadable, reading
from service.web import models
from service.web.commands import Commands, RequestRefused
from service.web.commission.endpoints import CommissionEndpoints
from service.web.daemon_access import DaemonAccess, DaemonSilent
from service.web.drawing import drawing
from service.web.evidence_files import FILES, WIDTHS_PX, NoPicture, Pictures, file_of, files_kept, tag_of
from service.web.guard import BodyTooLarge
from service.web.live import MOST_VIEWERS, PERIOD_S, EventStream, Live
from service.web.looks.endpoints import LookEndpoints
from service.web.looks.live_looks import LiveLooks
from service.web.openapi import PREFIX, document
from service.web.operations_table import MOST_JOBS, MOST_NOTES, OPERATIONS
from service.web.recipes.endpoints import RecipeEndpoints
from service.web.requests import Endpoint, address_of, body, holder_of, job_number, truth, whole_number

log = logging.getLogger("combtrace.page")


class Api:
    """The endpoints."""

    def __init__(self, daemon: DaemonAccess, commands: Commands, version: str) -> None:
        self._daemon = daemon
        self._commands = commands
        self._archive = daemon.sources.archive_path
        self._journal = daemon.sources.journal_path
        self._pictures = Pictures()
        self.live = Live(daemon)
        self._looks = LiveLooks(daemon.sources.looks)
        self._recipes = RecipeEndpoints(daemon, commands)
        self._commission = CommissionEndpoints(daemon, commands, self._pictures)
        if daemon.sources.archive is not None:
            daemon.sources.archive.on_stored = self._stored
        self._document = json.dumps(document(OPERATIONS, version), ensure_ascii=False).encode()
        self._reasons = _encoded(_reasons())

    def close(self) -> None:
        """Let go of threads."""
        self.live.close()
        self._looks.close()
        self._recipes.close()
        self._commission.close()
        if self._daemon.sources.archive is not None:
            self._daemon.sources.archive.on_stored = lambda _evidence: None
        self._pictures.close()

    def _stored(self, evidence: Evidence) -> None:
        """In the archive's thread: have the pictures ready for those who watch, and tell them."""
        if evidence.frame is None or not self.live.watched:
            return
        try:
            frame = file_of(self._archive, evidence.job, FRAME)
            if frame is not None:
                self._pictures.prepare(frame, evidence.frame.pixels)
        except (OSError, cv2.error) as error:  # it is read back then, if it is asked for
            log.warning("page: job %d: %s", evidence.job.job_id, error)
        self.live.look_soon()

    def routes(self) -> list[Route]:
        """All of them."""
        gets = {
            "/state": self.state,
            "/jobs": self.jobs,
            "/jobs/{job}": self.job,
            "/jobs/{job}/files/{name}": self.file,
            "/jobs/{job}/drawing": self.drawing,
            "/frames/{job}": self.frame,
            "/events": self.events,
            "/reasons": self.reasons,
            "/audit": self.audit,
            "/people": self.people,
            "/openapi.json": self.openapi,
            **LookEndpoints(self._looks).routes(),
            **self._recipes.gets(),
            **self._commission.gets(),
        }
        posts = {
            "/trigger": self.trigger,
            "/halt": self.halt,
            "/resume": self.resume,
            **self._recipes.posts(),
            **self._commission.posts(),
        }
        return [
            *(Route(PREFIX + path, with_problems(endpoint), methods=["GET"]) for path, endpoint in gets.items()),
            *(Route(PREFIX + path, with_problems(endpoint), methods=["POST"]) for path, endpoint in posts.items()),
        ]

    # --- looking ------------------------------------------------------------------------------------------------

    async def state(self, _request: Request) -> Response:
        """The service now."""
        return _answer(models.ServiceState.model_validate(await self._daemon.state()))

    async def jobs(self, request: Request) -> Response:
        """The newest jobs."""
        wanted = JobFilter(
            below=whole_number(request, "before", LARGEST_JOB, None), faulty=truth(request, "only_refused")
        )
        limit = whole_number(request, "limit", MOST_JOBS, 24)
        return _answer(await asyncio.to_thread(self._found_jobs, wanted, limit))

    def _found_jobs(self, wanted: JobFilter, limit: int | None) -> models.Jobs:
        with reading(self._journal) as journal:
            found = journal.jobs(wanted, limit)
        return models.Jobs(jobs=[self._described(job) for job in reversed(found)])

    async def job(self, request: Request) -> Response:
        """One job."""
        return _answer(await asyncio.to_thread(lambda: self._described(self._found(job_number(request)))))

    def _found(self, number: int) -> Job:
        with reading(self._journal) as journal:
            job = journal.find(number)
        if job is None:
            raise RequestRefused(404, f"the journal has no job {number}")
        return job

    def _described(self, job: Job) -> models.Job:
        return models.Job(**job_fields(job), files=files_kept(self._archive, job))

    async def file(self, request: Request) -> Response:
        """A file of a job's evidence, to be saved."""
        number, name = job_number(request), request.path_params["name"]
        path = await asyncio.to_thread(self._kept, number, name)
        return FileResponse(path, media_type=FILES[name], filename=f"job-{number}-{name}")

    async def frame(self, request: Request) -> Response:
        """A job's frame, made small."""
        number = job_number(request)
        width_px = whole_number(request, "width", WIDTHS_PX[-1], WIDTHS_PX[-1])
        if width_px is None or width_px not in WIDTHS_PX:
            raise RequestRefused(400, f"width is {width_px}, expected one of {', '.join(map(str, WIDTHS_PX))}")
        path = await asyncio.to_thread(self._kept, number, FRAME)
        tag = tag_of(path)
        etag = f'"{tag}-{width_px}"'
        headers = {"etag": etag, "cache-control": "no-cache"}  # kept by the browser, and asked about each time
        if request.headers.get("if-none-match") == etag:
            return Response(status_code=304, headers=headers)
        try:
            picture = await self._pictures.small(path, tag, width_px)
        except NoPicture as error:
            raise RequestRefused(404, f"job {number}: {error}") from error
        return Response(picture, media_type="image/jpeg", headers=headers)

    def _kept(self, number: int, name: str) -> Path:
        try:
            path = file_of(self._archive, self._found(number), name)
        except KeyError as error:
            raise RequestRefused(404, f"there are only {', '.join(FILES)}") from error
        if path is None:
            raise RequestRefused(404, f"{name} of job {number} is not kept. See archive.max_bytes")
        return path

    async def drawing(self, request: Request) -> Response:
        """What is drawn over a job's frame."""
        number = job_number(request)
        return _answer(await asyncio.to_thread(lambda: drawing(load_archived(self._archive, number))))

    async def events(self, _request: Request) -> Response:
        """The state, as it changes."""
        if self.live.full:
            raise RequestRefused(503, f"{MOST_VIEWERS} viewers watch already", again_s=PERIOD_S)
        return EventStream(self.live)

    async def reasons(self, _request: Request) -> Response:
        """The table of reasons."""
        return Response(self._reasons, media_type="application/json")

    async def openapi(self, _request: Request) -> Response:
        """This interface."""
        return Response(self._document, media_type="application/json")

    async def people(self, _request: Request) -> Response:
        """Who may give orders by a PIN: to be chosen from, with gloves on."""
        return _answer(models.PeopleNames(names=await self._commands.people()))

    async def audit(self, request: Request) -> Response:
        """Who asked for what; only for those who may ask too."""
        await holder_of(request, self._commands, by_pin=False)
        limit = whole_number(request, "limit", MOST_NOTES, 100)
        return _answer(await asyncio.to_thread(self._notes, limit or 0))

    def _notes(self, limit: int) -> models.Notes:
        with reading(self._journal) as journal:
            return models.Notes(notes=[models.NoteEntry(**vars(note)) for note in journal.notes(limit)])

    # --- asking -------------------------------------------------------------------------------------------------

    async def trigger(self, request: Request) -> Response:
        """One job."""
        who, address = await holder_of(request, self._commands), address_of(request)
        asked = await body(request, models.TriggerRequest)
        job = await self._commands.trigger(who, address, asked)
        return _answer(models.Triggered(job=job), 202)

    async def halt(self, request: Request) -> Response:
        """No trigger from now on."""
        who, address = await holder_of(request, self._commands), address_of(request)
        asked = await body(request, models.HaltRequest)
        return _answer(models.StateAfter(state=await self._commands.halt(who, address, asked.reason)))

    async def resume(self, request: Request) -> Response:
        """The end of a halt."""
        who, address = await holder_of(request, self._commands), address_of(request)
        asked = await body(request, models.ResumeRequest)
        return _answer(models.StateAfter(state=await self._commands.resume(who, address, asked.take_over)))


def with_problems(endpoint: Endpoint) -> Endpoint:
    """The endpoint, with what it refuses told as a Problem."""

    async def answered(request: Request) -> Response:
        try:
            return await endpoint(request)
        except RequestRefused as refusal:
            return problem(refusal.status, str(refusal), refusal.reason, refusal.again_s, refusal.holder)
        except (DaemonSilent, JournalUnreadable) as error:
            return problem(503, str(error))
        except EvidenceError as error:
            return problem(404, str(error))
        except BodyTooLarge:
            return problem(413, "the body is too large")

    return answered


def problem(
    status: int,
    text: str,
    reason: Reason | None = None,
    again_s: float | None = None,
    holder: str | None = None,
) -> Response:
    """An error as every error is told."""
    headers = {"www-authenticate": "Bearer"} if status == 401 else {}
    if again_s is not None:
        headers["retry-after"] = str(math.ceil(again_s))
    said = models.Problem(
        error=text,
        code=None if reason is None else int(reason),
        name=None if reason is None else reason.label,
        holder=holder,
    )
    return _answer(said, status, headers)


def _answer(model: BaseModel, status: int = 200, headers: dict[str, str] | None = None) -> Response:
    return Response(_encoded(model), status, headers, "application/json")


def _encoded(model: BaseModel) -> bytes:
    return model.model_dump_json().encode()


def _reasons() -> models.Reasons:
    def text(reason: Reason, language: Language) -> Any:
        told = reason.explained(language)
        return models.ReasonText(sentence=told.sentence, next_action=told.next_action)

    entries = [
        models.ReasonEntry(
            code=int(reason),
            name=reason.label,
            outcome=str(reason.outcome),
            en=text(reason, Language.ENGLISH),
            ru=text(reason, Language.RUSSIAN),
        )
        for reason in Reason
    ]
    return models.Reasons(reasons=entries)
