"""The operations on recipes, as the OpenAPI document tells them."""

from __future__ import annotations

from service.web.models import Drawing
from service.web.openapi import Operation, Parameter
from service.web.recipes import models

_RECIPE = Parameter("recipe", {"type": "integer", "minimum": 1, "maximum": 65_535}, "Its number.", required=True)
_JOB = Parameter("job", {"type": "integer", "minimum": 1}, "Its number.", required=True)
_NO_RECIPE = {404: "There is no such recipe."}


def operations(silent: dict[int, str], order: dict[int, str]) -> tuple[Operation, ...]:
    """All of them. silent, order: what looking and orders are refused for."""
    of_recipe = {**order, **_NO_RECIPE}
    return (
        Operation("GET", "/recipes", "Recipes in force, and what was adopted", models.RecipeList, silent),
        Operation("GET", "/recipes/schema", "The JSON schema of a recipe", "application/schema+json", {}),
        Operation("GET", "/recipes/trial", "How far the last try is, and what it found", models.TrialAnswer, {}),
        Operation(
            "GET",
            "/recipes/trial/{job}/drawing",
            "What the tried recipe would have drawn over a job's frame",
            Drawing,
            {404: "The job was not tried, or its drawing was too large to be kept."},
            (_JOB,),
        ),
        Operation(
            "POST",
            "/recipes/{recipe}/trial",
            "Try a changed recipe on its last archived jobs, newest first; one try at a time",
            models.TrialBegun,
            of_recipe,
            (_RECIPE,),
            models.TrialRequest,
            202,
            token=True,
        ),
        Operation(
            "POST",
            "/recipes/trial/stop",
            "End the try that runs",
            models.TrialAnswer,
            order,
            request=models.StopRequest,
            token=True,
        ),
        Operation(
            "POST",
            "/recipes/{recipe}/adopt",
            "Have the recipe in force that was tried, over restarts too",
            models.Adopted,
            of_recipe,
            (_RECIPE,),
            models.AdoptRequest,
            token=True,
        ),
        Operation(
            "POST",
            "/recipes/{recipe}/back",
            "Have a former recipe in force again",
            models.Adopted,
            of_recipe,
            (_RECIPE,),
            models.BackRequest,
            token=True,
        ),
    )
