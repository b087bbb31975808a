"""The cell in the address space: a `VisionSystem` of OPC 40100-1 with its state machines, recipes and last result."""

from __future__ import annotations

import gzip
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib import resources
from typing import Any

from asyncua import Node, Server, ua

from service.config.recipes import Recipe
from service.opcua.events import FAULT, NOTICE, REFUSAL, Events, variant
from service.opcua.results import made, recipe_id, result_fields
from service.reasons import Outcome
from service.records.job import Job
from service.state import State

MACHINE_VISION = "http://opcfoundation.org/UA/MachineVision"
NODESET = "Opc.Ua.MachineVision.NodeSet2.xml.gz"
OWN = 1  # the namespace of what is the server's own
CELL = "cell"
OPERATIONAL = "Operational"
# Numbers of the specification's types in its nodeset.
RECIPE, VISION_SYSTEM, RECIPES, RESULTS, RECIPE_FOLDER, RESULT_FOLDER = 1002, 1003, 1004, 1007, 1008, 1016
STATE_MACHINE, AUTOMATIC_MODE = 1017, 1021
RESULT, SYSTEM_STATE = 3006, 3024
# SystemState, by SEMI E10: production, stand by, engineering, scheduled and unscheduled downtime.
SYSTEM_STATES = {
    State.PREOPERATIONAL: 3,
    State.HALTED: 4,
    State.ERROR: 5,
    State.INITIALIZED: 3,
    State.READY: 2,
    State.SINGLE_EXECUTION: 1,
    State.CONTINUOUS_EXECUTION: 1,
}


@dataclass(frozen=True)
class StateSeen:
    """The service's state from a moment on, why, and which job it was executing."""

    at: datetime
    state: State
    reason: str | None
    job: int | None


@dataclass(frozen=True)
class _Machines:
    """CurrentState and its Id, of the vision system and of its automatic mode."""

    outer: tuple[Node, Node]
    automatic: tuple[Node, Node]


class VisionSystem:
    """Shows state, recipes and results to clients; `build` before anything else."""

    _machines: _Machines
    _system_state: Node
    _recipe_folder: Node
    _result_folder: Node
    _events: Events

    def __init__(self, server: Server, namespace: int) -> None:
        self._server = server
        self._namespace = namespace
        self._states: dict[str, ua.NodeId] = {}  # and transitions, by name
        self._last_result: dict[str, Node] = {}
        self._seen: StateSeen | None = None
        self._recipes: Mapping[int, Recipe] = {}

    async def build(self) -> None:
        """Make the nodes. Their ids are their paths, and stay over restarts."""
        server = self._server
        cell = await self._added(server.nodes.objects, ua.QualifiedName(CELL, OWN), VISION_SYSTEM, CELL)
        machine = await cell.get_child([self._named("VisionStateMachine")])
        automatic = await self._added(machine, self._named("AutomaticModeStateMachine"), AUTOMATIC_MODE)
        recipes = await self._added(cell, self._named("RecipeManagement"), RECIPES)
        results = await self._added(cell, self._named("ResultManagement"), RESULTS)
        self._machines = _Machines(await _current(machine), await _current(automatic))
        self._recipe_folder = await self._added(recipes, self._named("Recipes"), RECIPE_FOLDER)
        self._result_folder = await self._added(results, self._named("Results"), RESULT_FOLDER)
        where, kind = ua.NodeId(f"{CELL}.SystemState", OWN), self._of(SYSTEM_STATE)
        nothing = made("SystemStateDescriptionDataType")
        self._system_state = await cell.add_variable(where, self._named("SystemState"), nothing, datatype=kind)
        self._events = Events(server, cell, self._namespace)
        await self._events.open()
        for number in (STATE_MACHINE, AUTOMATIC_MODE):
            for child in await server.get_node(self._of(number)).get_children():
                self._states[(await child.read_browse_name()).Name] = child.nodeid

    def _of(self, number: int) -> ua.NodeId:
        return ua.NodeId(number, self._namespace)

    def _named(self, name: str) -> ua.QualifiedName:
        return ua.QualifiedName(name, self._namespace)

    async def _added(self, parent: Node, name: ua.QualifiedName, number: int, where: str = "") -> Node:
        """An object of the specification's type with what every one of that type has."""
        node_id = ua.NodeId(where or f"{parent.nodeid.Identifier}.{name.Name}", OWN)
        return await parent.add_object(node_id, name, objecttype=self._of(number), instantiate_optional=False)

    async def _write(self, node: Node, value: Any, at: datetime) -> None:
        await self._server.write_attribute_value(node.nodeid, ua.DataValue(variant(value), SourceTimestamp=at))

    # --- state --------------------------------------------------------------------------------------------------

    async def show_state(self, seen: StateSeen) -> None:
        """The state, with an event where it is another one than before."""
        before, self._seen = self._seen, seen
        top, inner = _places(seen.state)
        await self._write_state(self._machines.outer, top, seen.at)
        await self._write_state(self._machines.automatic, inner, seen.at)
        number, reason = SYSTEM_STATES[seen.state], seen.reason or ""
        described = made("SystemStateDescriptionDataType", State=number, StateDescription=reason)
        await self._write(self._system_state, described, seen.at)
        if before is None or before.state is seen.state:
            return
        failed, resolved = seen.state is State.ERROR, before.state is State.ERROR
        name = "Error" if failed else "ErrorResolved" if resolved else "StateChanged"
        message = f"{before.state.label} -> {seen.state.label}" + (f": {seen.reason}" if seen.reason else "")
        transition = self._transition(before.state, seen.state)
        await self._events.tell(name, message, FAULT if failed else NOTICE, seen.at, transition)
        if seen.state is State.SINGLE_EXECUTION and seen.job is not None:
            job_id = {"JobId": made("JobIdDataType", Id=str(seen.job))}
            await self._events.tell("JobStarted", f"job {seen.job}", NOTICE, seen.at, job_id)

    async def _write_state(self, nodes: tuple[Node, Node], name: str | None, at: datetime) -> None:
        """name: None where the machine is in no state."""
        if name is None:
            inactive = ua.DataValue(StatusCode=ua.StatusCode(ua.StatusCodes.BadStateNotActive), SourceTimestamp=at)
            for node in nodes:
                await self._server.write_attribute_value(node.nodeid, inactive)
            return
        current, state_id = nodes
        await self._write(state_id, self._states[name], at)
        await self._write(current, ua.LocalizedText(name), at)

    def _transition(self, before: State, after: State) -> dict[str, Any]:
        """From, to, and which of the specification's transitions it is, where it is one."""
        (top, inner), (new_top, new_inner) = _places(before), _places(after)
        old, new = (inner or top, new_inner or new_top) if top == new_top else (top, new_top)
        names = (f"{old}To{new}Auto", f"{old}To{new}")
        return {
            "FromState": ua.LocalizedText(old),
            "FromState/Id": self._states[old],
            "ToState": ua.LocalizedText(new),
            "ToState/Id": self._states[new],
            "Transition": ua.LocalizedText(names[1]),
            "Transition/Id": next((self._states[name] for name in names if name in self._states), ua.NodeId()),
        }

    # --- results and recipes ------------------------------------------------------------------------------------

    async def show_result(self, job: Job, *, tell: bool = True) -> None:
        """A settled job as the last result. tell: with its event, and one more where the job was not accepted."""
        fields = result_fields(job)
        await self._write_result(fields)
        if not tell:
            return
        ending = "" if job.reason is None else f": {int(job.reason)} {job.reason.label}: {job.detail}"
        message, at = f"job {job.job_id} {job.outcome}{ending}", fields["CreationTime"]
        accepted = job.outcome in (Outcome.ACCEPTED, Outcome.WRITTEN)
        severity = NOTICE if accepted else REFUSAL
        await self._events.tell("ResultReady", message, severity, at, fields)
        if not accepted:
            same = {name: fields[name] for name in ("JobId", "ResultId", "InternalRecipeId")}
            cause = {"CausePath": "" if job.reason is None else job.reason.label}
            await self._events.tell("VisionInformation", message, severity, at, same | cause)

    async def _write_result(self, fields: Mapping[str, Any]) -> None:
        """Into the variable of the last result, which is there from the first one on, and into one for each field."""
        whole = made("ResultDataType", **fields)
        if not self._last_result:
            where, kind = f"{self._result_folder.nodeid.Identifier}.LastResult", self._of(RESULT)
            last = await self._result_folder.add_variable(
                ua.NodeId(where, OWN), self._named("LastResult"), whole, datatype=kind
            )
            self._last_result[""] = last
            for name, value in fields.items():
                part, kept = ua.NodeId(f"{where}.{name}", OWN), variant(value)
                anything = ua.NodeId(ua.ObjectIds.BaseDataType) if isinstance(value, list) else None
                self._last_result[name] = await last.add_variable(
                    part, self._named(name), kept.Value, kept.VariantType, anything
                )
        for name, value in ({"": whole} | dict(fields)).items():
            await self._write(self._last_result[name], value, fields["CreationTime"])

    async def show_recipes(self, recipes: Mapping[int, Recipe]) -> None:
        """The recipes as they are now; nothing is done where they are the same as before."""
        if recipes is self._recipes:
            return
        self._recipes, now = recipes, datetime.now(UTC)
        await self._server.delete_nodes(await self._recipe_folder.get_children(), recursive=True)
        for number, recipe in sorted(recipes.items()):
            node = await self._added(self._recipe_folder, self._named(str(number)), RECIPE)
            values = {"InternalId": recipe_id(recipe.model_dump(mode="json")), "IsPrepared": True, "LastModified": now}
            for name, value in values.items():
                await self._write(await node.get_child([self._named(name)]), value, now)


def _places(state: State) -> tuple[str, str | None]:
    """The state of the vision system, and of its automatic mode where that is what it is in."""
    outer = state in (State.PREOPERATIONAL, State.HALTED, State.ERROR)
    return (state.label, None) if outer else (OPERATIONAL, state.label)


async def _current(machine: Node) -> tuple[Node, Node]:
    state = await machine.get_child("0:CurrentState")
    return state, await state.get_child("0:Id")


def method_id(path: str) -> ua.NodeId:
    """Which method of the cell lies there."""
    return ua.NodeId(f"{CELL}.{path}", OWN)


async def vision_system(server: Server) -> VisionSystem:
    """The companion nodeset loaded, and a cell in it."""
    packed = resources.files("service.opcua").joinpath(NODESET).read_bytes()
    await server.import_xml(xmlstring=gzip.decompress(packed).decode())
    found = VisionSystem(server, await server.get_namespace_index(MACHINE_VISION))
    await found.build()
    return found
