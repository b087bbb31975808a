"""A controller that was configured wrongly: the page finds what to change and writes it; a restart sets it right."""

from __future__ import annotations

from pathlib import Path

from tests.support.processes.cell import Cell
from tests.support.processes.page_client import Client, token_file
from tests.support.processes.processes import free_port, until


def test_what_the_probe_would_change_goes_into_the_configuration_and_its_comments_stay(tmp_path: Path) -> None:
    port = free_port()
    token_file(tmp_path)
    more = f"page: {{port: {port}, token_file: tokens}}  # for the panel\n"
    link = ", word_order: little"
    cell = Cell(tmp_path, triggers="[]", trigger_every_s=None, link=link, more=more)
    client, config = Client(port), tmp_path / "config.yaml"
    try:
        until(lambda: "page: http" in cell.service.text, what="the page")
        assert client.order("/api/v1/halt").status == 200
        until(lambda: client.get("/api/v1/state").json["state"] == "Halted", what="the halt")
        assert client.order("/api/v1/commission/probe", content={"write": True}).status == 202
        told = until(lambda: (now := client.get("/api/v1/commission").json)["running"] is None and now, what="its end")
        assert told["changes"] == {"word_order": "big"}
        assert next(step["well"] for step in told["steps"] if step["name"] == "controller") is False
        assert client.order("/api/v1/commission/apply").status == 202
        until(lambda: "word_order: big" in config.read_text(), what="the configuration")
        assert "# for the panel" in config.read_text()
        assert cell.service.stop() == 0
        cell.service = cell.start_service()
        until(lambda: cell.service.text.count("page: http") == 2, what="the page")
        until(lambda: client.order("/api/v1/resume").status == 200, what="the end of the halt", pause_s=2)
        cell.ready()
    finally:
        cell.stop()
