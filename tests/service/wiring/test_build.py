"""Parts are built in turn; where one cannot be had, those before it are closed again."""

from __future__ import annotations

import socket
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from service.commissioning.given_contours import GivenContours, NoCamera
from service.config.config import Config
from service.config.recipes import PartToCut
from service.jobs.rehearsal import rehearse
from service.records.archive_writer import ArchiveWriter
from service.records.journal_file import JournalError
from service.wiring import daemon as wiring
from service.wiring import triggers
from service.wiring.daemon import StandIns, build, opening_of
from service.wiring.errors import WiringError

IN_TURN = ("_make_link", "_make_archive", "_make_executor", "add_triggers", "add_metrics", "add_opcua", "add_page")


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return int(listener.getsockname()[1])


def configured(folder: Path, **sections: Any) -> Config:
    return Config.model_validate(
        {
            "camera": {"kind": "files", "path": str(folder)},
            "controller": {"kind": "none"},
            "triggers": [{"kind": "serial", "port": "/dev/ttyNone"}],
            "service": {"state_dir": str(folder / "state")},
            "journal": {"path": str(folder / "journal.sqlite")},
            "archive": {"path": str(folder / "archive")},
            "metrics": {"host": "127.0.0.1", "port": free_port()},
            **sections,
        }
    )


class Opened:
    """Thread pools and archives that were made, and which archives were closed."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.pools: list[ThreadPoolExecutor] = []
        self.archives: list[ArchiveWriter] = []
        self.closed: list[ArchiveWriter] = []
        opened = self

        class Pool(ThreadPoolExecutor):
            def __init__(self, *args: Any) -> None:
                super().__init__(*args)
                opened.pools.append(self)

        class Archive(ArchiveWriter):
            def __init__(self, *args: Any) -> None:
                super().__init__(*args)
                opened.archives.append(self)

            def close(self, bound_s: float = 1.0) -> None:
                super().close(bound_s)
                opened.closed.append(self)

        for room in (wiring, triggers):
            monkeypatch.setattr(room, "ThreadPoolExecutor", Pool)
        monkeypatch.setattr(wiring, "ArchiveWriter", Archive)


def shut(pool: ThreadPoolExecutor) -> bool:
    try:
        pool.submit(int).result()
    except RuntimeError:
        return True
    pool.shutdown()
    return False


@pytest.mark.parametrize("failing", IN_TURN)
async def test_what_was_opened_is_closed_when_the_next_part_cannot_be_had(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failing: str
) -> None:
    config = configured(tmp_path)
    opened = Opened(monkeypatch)
    opening = opening_of(config)

    def cannot_be_had(*_: object) -> None:
        raise WiringError(f"{failing} cannot be had")

    with monkeypatch.context() as then:
        then.setattr(wiring, failing, cannot_be_had)
        with pytest.raises(WiringError, match=failing):
            build(config, opening=opening)
    step = IN_TURN.index(failing)
    pools = [0, 1, 1, 1, 2, 2, 2][step]  # the camera's, the serial ports'
    assert [shut(pool) for pool in opened.pools] == [True] * pools
    assert len(opened.archives) == [0, 0, 1, 1, 1, 1, 1][step]
    assert opened.closed == opened.archives
    assert opening._journal is not None
    with pytest.raises(JournalError, match="closed database"):
        opening._journal.last_taken()
    again = build(config)  # locks and port are free
    assert again.metrics is not None
    again.metrics.close()
    again.lock.release()


async def test_a_port_that_is_taken_leaves_nothing_open(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = int(listener.getsockname()[1])
        config = configured(tmp_path, metrics={"host": "127.0.0.1", "port": port})
        with pytest.raises(WiringError, match=f"{port} cannot be listened on"):
            build(config)
    parts = build(config)
    assert parts.metrics is not None
    parts.metrics.close()
    parts.lock.release()


async def test_the_daemon_rehearses_and_one_with_given_contours_does_not(tmp_path: Path) -> None:
    config = configured(tmp_path, metrics=None)
    for stand_ins in (None, StandIns(NoCamera(), GivenContours([], aligned=False))):
        parts = build(config, stand_ins=stand_ins)
        assert (parts.rehearse is rehearse) == (stand_ins is None)
        parts.journal.close()
        parts.lock.release()
        parts.pool.shutdown()
        if parts.archive is not None:
            parts.archive.close()


async def test_a_part_that_cannot_be_read_stops_the_start(tmp_path: Path) -> None:
    config = configured(tmp_path, metrics=None)
    part = PartToCut(file=tmp_path / "none.dxf")
    recipes = tuple(recipe.model_copy(update={"part": part}) for recipe in config.recipes)
    with pytest.raises(WiringError, match=r"recipe 1: part: .*none\.dxf: cannot be read"):
        build(config.model_copy(update={"recipes": recipes}))


async def test_a_page_that_cannot_be_served_leaves_no_metrics_behind(tmp_path: Path) -> None:
    page = {"port": free_port(), "token_file": str(tmp_path / "none")}
    config = configured(tmp_path, page=page)
    with pytest.raises(WiringError, match="page"):
        build(config)
    parts = build(config.model_copy(update={"page": None}))
    assert parts.metrics is not None
    parts.metrics.close()
    parts.lock.release()


async def test_opcua_that_cannot_be_served_as_it_is_configured_stops_the_start(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    config = configured(tmp_path, metrics=None, opcua={"port": free_port(), "users_file": str(tmp_path / "none")})
    with pytest.raises(WiringError, match=r"opcua: .*none: cannot be read"):
        build(config)
    for name in [name for name in sys.modules if name.startswith("service.opcua")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "asyncua", None)
    with pytest.raises(WiringError, match="Install combtrace\\[opcua\\]"):
        build(config)
