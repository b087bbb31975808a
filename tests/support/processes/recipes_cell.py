"""A daemon with recipes that may be changed on its page, and who changes them."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.support.processes.cell import ON_SAMPLES, Cell
from tests.support.processes.page_client import Client, Reply, people_file
from tests.support.processes.processes import free_port, until

SHEET = "{number: 1, name: sheet, max_area_mm2: 200000}"
OTHER = "{number: 2, name: other, exports: [dxf], parts: [{file: plate.geojson, units: mm, quantity: 2}]}"
PLATE = {"type": "Polygon", "coordinates": [[[0, 0], [60, 0], [60, 40], [0, 40], [0, 0]]]}
PICTURES = 4  # whose blocks are 68 to 101 thousand mm²
BETWEEN = 90_000  # mm²: one of them is larger
PINS = {"maria": "4711", "oleg": "0815"}


def token(who: str) -> str:
    return f"{who}-has-a-token-of-her-own"


@dataclass
class RecipesCell:
    """A daemon with recipes, and who asks it. Each person may give thirty orders a minute: tests have their own."""

    cell: Cell
    client: Client

    def order(self, path: str, who: str, content: dict[str, Any]) -> Reply:
        body = {"take_over": "her own test", **content}
        return self.client.order(f"/api/v1/recipes/{path}", token(who), body)

    def jobs(self, count: int, who: str, recipe: int = 1) -> list[dict[str, Any]]:
        """So many more jobs, once their evidence is kept."""
        found = []
        for _ in range(count):
            content = {"recipe": recipe, "take_over": "her own test"}
            asked = until(
                lambda c=content: (r := self.client.order("/api/v1/trigger", token(who), c)).status == 202 and r,  # type: ignore[misc]
                what="a trigger that is taken",
                pause_s=0.3,
            )
            path = f"/api/v1/jobs/{asked.json['job']}"
            found.append(until(lambda p=path: (j := self.client.get(p).json)["files"] and j, what="evidence"))  # type: ignore[misc]
        return found

    def recipe(self, number: int = 1) -> dict[str, Any]:
        told = self.client.get("/api/v1/recipes").json
        return dict(next(one for one in told["recipes"] if one["number"] == number))

    def trial(self) -> dict[str, Any]:
        return dict(self.client.get("/api/v1/recipes/trial").json["trial"])

    def tried(self, who: str, changes: dict[str, Any], jobs: int = PICTURES) -> dict[str, Any]:
        """A try, come to its end."""
        begun = self.order("1/trial", who, {"changes": changes, "jobs": jobs})
        assert begun.status == 202, begun.body
        found = dict(until(lambda: (t := self.trial())["state"] != "running" and t, what="the end of a try"))
        assert found["number"] == begun.json["trial"]
        return found

    def adopted(self, who: str, changes: dict[str, Any]) -> int:
        trial = self.tried(who, changes, jobs=1)
        reply = self.order("1/adopt", who, {"trial": trial["number"], "note": "to begin with"})
        assert reply.status == 200, reply.body
        return int(reply.json["adoption"])

    def notes(self, who: str) -> list[dict[str, Any]]:
        """Newest first."""
        told = self.client.get("/api/v1/audit?limit=200", Authorization=f"Bearer {token(who)}").json["notes"]
        return [note for note in told if note["who"] == who]


def started(folder: Path, *names: str) -> RecipesCell:
    """A daemon with these people."""
    lines = "".join(f"{name} {token(name)}\n" for name in names)
    (folder / "tokens").touch(0o600)
    (folder / "tokens").write_text(lines)
    people_file(folder, PINS)
    (folder / "plate.geojson").write_text(json.dumps(PLATE))
    port = free_port()
    page = f"page: {{port: {port}, token_file: tokens, people_file: people}}\n"
    kept = "adopted_recipes: state/adopted.json\n"
    cell = Cell(
        folder,
        triggers="[]",
        camera=ON_SAMPLES,
        trigger_every_s=None,
        more=f"{page}{kept}recipes: [{SHEET}, {OTHER}]\n",
    )
    cell.ready()
    return RecipesCell(cell, Client(port))


WHO = [f"person{number}" for number in range(12)]


@contextmanager
def served_recipes(folder: Path) -> Iterator[RecipesCell]:
    """The same, after a job of each picture."""
    built = started(folder, *WHO)
    try:
        ended = built.jobs(PICTURES, WHO[0])
        assert [job["outcome"] for job in ended] == ["accepted"] * PICTURES
        yield built
    finally:
        built.cell.stop()
