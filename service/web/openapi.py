"""The OpenAPI document of the REST interface, from the table of its operations and their models."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel
from pydantic.json_schema import models_json_schema

from service.web.models import Problem

REFERENCES = "#/components/schemas/{model}"
PREFIX = "/api/v1"
EVERYWHERE = {
    403: "Another site's page asks.",
    421: "Called by a name that is not the service's: see page.names.",
}
WITH_BODY = {413: "The body is larger than 4096 bytes.", 415: "The body is not application/json."}


@dataclass(frozen=True)
class Parameter:
    """In the path where it is required, else in the query."""

    name: str
    schema: dict[str, Any]
    text: str
    required: bool = False


@dataclass(frozen=True)
class Operation:
    """One method at one path. answer: a model, or a media type. problems: status to text."""

    method: str
    path: str
    text: str
    answer: type[BaseModel] | str
    problems: dict[int, str]
    parameters: tuple[Parameter, ...] = ()
    request: type[BaseModel] | None = None
    status: int = 200
    token: bool = False


def document(operations: Sequence[Operation], version: str) -> dict[str, Any]:
    """OpenAPI 3.1, JSON's types only."""
    models: list[type[BaseModel]] = [Problem]
    for operation in operations:
        models += [model for model in (operation.answer, operation.request) if isinstance(model, type)]
    names, definitions = models_json_schema(
        [(model, "serialization") for model in dict.fromkeys(models)], ref_template=REFERENCES
    )
    schemas = {model: reference for (model, _), reference in names.items()}
    paths: dict[str, dict[str, Any]] = {}
    for operation in operations:
        paths.setdefault(PREFIX + operation.path, {})[operation.method.lower()] = _operation(operation, schemas)
    return {
        "openapi": "3.1.0",
        "info": {"title": "combtrace", "version": version, "description": "The service's state, its jobs, and orders."},
        "paths": paths,
        "components": {
            "schemas": definitions.get("$defs", {}),
            "securitySchemes": {"token": {"type": "http", "scheme": "bearer"}},
        },
    }


def _operation(operation: Operation, schemas: dict[Any, Any]) -> dict[str, Any]:
    answer = operation.answer
    content = {answer: {}} if isinstance(answer, str) else {"application/json": {"schema": schemas[answer]}}
    responses: dict[str, Any] = {str(operation.status): {"description": operation.text, "content": content}}
    problem = {"application/json": {"schema": schemas[Problem]}}
    problems = {**EVERYWHERE, **({} if operation.request is None else WITH_BODY), **operation.problems}
    for status, text in sorted(problems.items()):
        responses[str(status)] = {"description": text, "content": problem}
    described: dict[str, Any] = {"summary": operation.text, "responses": responses}
    if operation.parameters:
        described["parameters"] = [_parameter(one) for one in operation.parameters]
    if operation.request is not None:
        described["requestBody"] = {"content": {"application/json": {"schema": schemas[operation.request]}}}
    if operation.token:
        described["security"] = [{"token": []}]
    return described


def _parameter(one: Parameter) -> dict[str, Any]:
    return {
        "name": one.name,
        "in": "path" if one.required else "query",
        "required": one.required,
        "description": one.text,
        "schema": one.schema,
    }
