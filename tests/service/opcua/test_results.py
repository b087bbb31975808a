"""A job's end as the companion specification has it, in the library's own structures."""

from __future__ import annotations

from collections.abc import AsyncIterator
from datetime import UTC, datetime

import pytest
import pytest_asyncio
from asyncua import Server, ua

from service.config.recipes import Recipe
from service.opcua.results import result_fields
from service.opcua.vision_system import StateSeen, VisionSystem, vision_system
from service.reasons import Outcome, Reason
from service.records.job import Job, Terms, TriggerStamp
from service.state import TRANSITIONS, State

pytestmark = pytest.mark.asyncio(loop_scope="module")
AT = "2026-11-23T20:00:00+00:00"
LAST = "ns=1;s=cell.ResultManagement.Results.LastResult"
RECIPES = "ns=1;s=cell.RecipeManagement.Recipes"


def job(outcome: Outcome, reason: Reason | None = None, **report: float) -> Job:
    terms = Terms({"name": "combs", "number": 1}, "sha256:12")
    return Job(7, AT, TriggerStamp("manual"), outcome=outcome, reason=reason, settled_at=AT, report=report, terms=terms)


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def shown() -> AsyncIterator[tuple[Server, VisionSystem]]:
    server = Server()
    await server.init()
    yield server, await vision_system(server)
    await server.iserver.stop()


@pytest.mark.parametrize(
    ("ended", "state", "content"),
    [
        (job(Outcome.ACCEPTED, area_mm2=5.5, vertices=4), 1, ["accepted", 0, "", "", 5.5, None, 4.0, None]),
        (job(Outcome.REFUSED, Reason.NO_BLOCK_FOUND), 1, ["refused", 110, "no_block_found", "", *[None] * 4]),
        (job(Outcome.FAILED, Reason.CONTROLLER_LOST), 4, ["failed", 152, "controller_lost", "", *[None] * 4]),
        (job(Outcome.FAILED, Reason.ABORTED), 3, ["failed", 161, "aborted", "", *[None] * 4]),
    ],
)
async def test_results_are_shown_whole_and_by_field(
    shown: tuple[Server, VisionSystem], ended: Job, state: int, content: list[object]
) -> None:
    server, cell = shown
    await cell.show_result(ended)
    whole = await server.get_node(LAST).read_value()
    assert (whole.JobId.Id, whole.ResultState, whole.InternalRecipeId.Id) == ("7", state, "combs")
    assert [one.Value for one in whole.ResultContent] == content
    assert [one.Value for one in await server.get_node(f"{LAST}.ResultContent").read_value()] == content
    assert await server.get_node(f"{LAST}.ResultState").read_value() == state


async def test_a_job_that_came_to_no_recipe_has_a_result_too(shown: tuple[Server, VisionSystem]) -> None:
    fields = result_fields(Job(8, AT, TriggerStamp("manual"), outcome=Outcome.REFUSED, reason=Reason.UNKNOWN_RECIPE))
    assert (fields["InternalRecipeId"].Id, fields["InternalConfigurationId"].Id) == ("", "")


async def test_every_change_of_state_can_be_shown(shown: tuple[Server, VisionSystem]) -> None:
    server, cell = shown
    machine = "ns=1;s=cell.VisionStateMachine"
    for before, afters in TRANSITIONS.items():
        for after in afters:
            for state in (before, after):
                await cell.show_state(StateSeen(datetime.now(UTC), state, "why", 3))
            outer = (await server.get_node(f"{machine}.CurrentState").read_value()).Text
            inner = server.read_attribute_value(
                ua.NodeId.from_string(f"{machine}.AutomaticModeStateMachine.CurrentState")
            )
            if outer == "Operational":
                assert inner.Value.Value.Text == after.label
            else:
                assert (outer, inner.StatusCode.name) == (after.label, "BadStateNotActive")
    assert (await server.get_node("ns=1;s=cell.SystemState").read_value()).StateDescription == "why"


async def test_recipes_follow_what_the_service_has(shown: tuple[Server, VisionSystem]) -> None:
    server, cell = shown
    for recipes in ({1: Recipe(number=1, name="a"), 2: Recipe(number=2, name="b")}, {2: Recipe(number=2, name="c")}):
        await cell.show_recipes(recipes)
        found = await server.get_node(RECIPES).get_children()
        names = [(await server.get_node(f"{one.nodeid.to_string()}.InternalId").read_value()).Id for one in found]
        assert names == [recipe.name for recipe in recipes.values()]


async def test_the_nodeset_is_the_published_one(shown: tuple[Server, VisionSystem]) -> None:
    server, _ = shown
    namespace = await server.get_namespace_index("http://opcfoundation.org/UA/MachineVision")
    assert namespace == 2
    assert (await server.get_node(ua.NodeId(1003, namespace)).read_browse_name()).Name == "VisionSystemType"
    assert State.SINGLE_EXECUTION.label in [
        (await one.read_browse_name()).Name for one in await server.get_node(ua.NodeId(1021, namespace)).get_children()
    ]
