"""The operations of the REST interface, as the OpenAPI document tells them."""

from __future__ import annotations

from service.web import models
from service.web.commission import endpoints as commission
from service.web.evidence_files import FILES, WIDTHS_PX
from service.web.looks import endpoints as looks
from service.web.openapi import Operation, Parameter
from service.web.recipes.operations import operations as of_recipes
from service.web.trend_models import Trends

MOST_JOBS = 200
MOST_NOTES = 1000

_SILENT = {503: "The service does not answer, or its journal cannot be read."}
_PARAMETER = "A parameter is not as expected."
_NO_JOB = {404: "There is no such job, or nothing is kept of it.", **_SILENT}
_ORDER = {
    401: "No token or PIN, or a wrong one.",
    403: "Neither token file nor people file is configured, or another site's page asks.",
    409: "Not at this moment: `error`, and where the table has it, `code` and `name` say why; `holder` has the word.",
    422: "The body is not as expected.",
    429: "Too many wrong tokens or PINs, or too many commands: see Retry-After.",
    503: "The service does not answer, or the journal cannot keep who asked.",
}
_JOB = Parameter("job", {"type": "integer", "minimum": 1}, "Its number.", required=True)

OPERATIONS = (
    Operation("GET", "/state", "The service now", models.ServiceState, _SILENT),
    Operation(
        "GET",
        "/jobs",
        "The newest jobs, newest first",
        models.Jobs,
        {400: _PARAMETER, **_SILENT},
        (
            Parameter("limit", {"type": "integer", "minimum": 1, "maximum": MOST_JOBS, "default": 24}, "Most of them."),
            Parameter("before", {"type": "integer", "minimum": 1}, "Only jobs with numbers below."),
            Parameter("only_refused", {"type": "boolean", "default": False}, "Only those refused or failed."),
        ),
    ),
    Operation("GET", "/jobs/{job}", "One job", models.Job, _NO_JOB, (_JOB,)),
    Operation(
        "GET",
        "/jobs/{job}/files/{name}",
        "A file of a job's evidence",
        "application/octet-stream",
        _NO_JOB,
        (_JOB, Parameter("name", {"type": "string", "enum": list(FILES)}, "Which.", required=True)),
    ),
    Operation(
        "GET",
        "/frames/{job}",
        "A job's frame, made small",
        "image/jpeg",
        {400: _PARAMETER, **_NO_JOB},
        (_JOB, Parameter("width", {"type": "integer", "enum": list(WIDTHS_PX)}, "At most so wide, px.")),
    ),
    Operation("GET", "/jobs/{job}/drawing", "What is drawn over its frame", models.Drawing, _NO_JOB, (_JOB,)),
    Operation(
        "GET", "/events", "The service's state, again each second and after each change", "text/event-stream", _SILENT
    ),
    *looks.OPERATIONS,
    Operation(
        "GET",
        "/trends",
        "How jobs fared over a time, in at most 200 buckets",
        Trends,
        {400: _PARAMETER, **_SILENT},
        (
            Parameter("from", {"type": "string", "format": "date-time"}, "Jobs taken then or later."),
            Parameter("to", {"type": "string", "format": "date-time"}, "Jobs taken before; now where left out."),
            Parameter("hours", {"type": "integer", "minimum": 1, "default": 168}, "Without `from`: so long before."),
            Parameter("recipe", {"type": "integer", "minimum": 1, "maximum": 65_535}, "Jobs of this recipe only."),
        ),
    ),
    Operation("GET", "/reasons", "Why jobs are not accepted, in words", models.Reasons, {}),
    Operation("GET", "/people", "Who may give orders by a PIN", models.PeopleNames, _SILENT),
    Operation(
        "GET",
        "/audit",
        "Who asked for what, newest first",
        models.Notes,
        {400: _PARAMETER, **{code: text for code, text in _ORDER.items() if code not in (409, 422)}},
        (Parameter("limit", {"type": "integer", "minimum": 1, "maximum": MOST_NOTES, "default": 100}, "Most."),),
        token=True,
    ),
    Operation(
        "POST",
        "/trigger",
        "One job: taken, or, with job null, waiting for its turn",
        models.Triggered,
        _ORDER,
        request=models.TriggerRequest,
        status=202,
        token=True,
    ),
    Operation(
        "POST",
        "/halt",
        "No trigger is taken until the halt is ended, over restarts too",
        models.StateAfter,
        _ORDER,
        request=models.HaltRequest,
        token=True,
    ),
    Operation("POST", "/resume", "End a halt", models.StateAfter, _ORDER, request=models.ResumeRequest, token=True),
    *of_recipes(_SILENT, _ORDER),
    *commission.OPERATIONS,
)
