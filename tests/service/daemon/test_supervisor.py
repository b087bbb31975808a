"""Parts that fail are started again with growing pauses, are told as faults meanwhile, and keep their last error."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager, suppress

import pytest

from service.daemon import supervisor
from service.daemon.supervisor import RESTART_PAUSES_S, Supervisor
from service.jobs.health import Health
from service.state import State, StateMachine
from tests.support.service.waiting import until


@asynccontextmanager
async def keeping(**parts: Callable[[], Awaitable[None]]) -> AsyncIterator[tuple[Supervisor, Health]]:
    health = Health(StateMachine())
    health.start()
    kept = Supervisor(health)
    for name, run in parts.items():
        kept.add(name, run)
    task = asyncio.ensure_future(kept.run())
    try:
        yield kept, health
    finally:
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task


async def for_ever() -> None:
    await asyncio.Event().wait()


async def test_a_part_that_fails_leaves_the_others_alone_and_is_sound_again_later(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(supervisor, "SOUND_AFTER_S", 0.05)
    begun: list[str] = []

    async def good() -> None:
        begun.append("good")
        await for_ever()

    async def fails_once() -> None:
        begun.append("bad")
        if begun.count("bad") == 1:
            raise KeyError("a defect")
        await for_ever()

    async with keeping(good=good, bad=fails_once) as (kept, health):
        await until(lambda: health.state is State.ERROR)
        assert "part bad has failed" in str(health.reason)
        await until(lambda: health.state is State.READY)
        assert begun.count("good") == 1
        good_part, bad_part = kept.parts
        assert (good_part.restarts, good_part.last_error) == (0, None)
        assert (bad_part.restarts, bad_part.last_error) == (1, "KeyError: 'a defect'")
        assert bad_part.failed_at is not None


async def test_the_pauses_grow_up_to_a_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    pauses: list[float] = []
    sleep, loop = asyncio.sleep, asyncio.get_running_loop()

    async def noted(seconds: float) -> None:
        if asyncio.get_running_loop() is loop:  # threads of other tests may still have theirs
            pauses.append(seconds)
        await sleep(0)

    monkeypatch.setattr("service.daemon.supervisor.asyncio.sleep", noted)

    async def broken() -> None:
        raise ZeroDivisionError

    async with keeping(broken=broken):
        while len(pauses) < 8:
            await sleep(0.001)
    assert pauses[:8] == [*RESTART_PAUSES_S, *[RESTART_PAUSES_S[-1]] * 3]


async def test_a_part_that_just_ends_is_a_defect_too() -> None:
    async def ends() -> None:
        return

    async with keeping(ends=ends) as (kept, health):
        await until(lambda: health.state is State.ERROR)
        assert kept.parts[0].last_error == "it ended, expected it to run for ever"


async def test_restart_begins_all_parts_anew_also_one_that_waits_for_its_next_attempt(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(supervisor, "RESTART_PAUSES_S", (3600.0,))
    begun: list[str] = []

    async def good() -> None:
        begun.append("good")
        await for_ever()

    async def bad() -> None:
        begun.append("bad")
        raise ValueError("again")

    async with keeping(good=good, bad=bad) as (kept, health):
        await until(lambda: health.state is State.ERROR)
        kept.restart()
        await until(lambda: begun.count("bad") == 2 and begun.count("good") == 2)
        assert kept.parts[0].last_error is None, "to be asked to start anew is no error"


async def test_the_end_of_the_supervisor_ends_its_parts() -> None:
    ended: list[str] = []

    async def part() -> None:
        try:
            await for_ever()
        finally:
            ended.append("part")

    async with keeping(part=part):
        await asyncio.sleep(0.01)
    assert ended == ["part"]


async def test_a_part_rests_while_other_work_is_done_and_begins_anew_after_it() -> None:
    begun: list[str] = []

    async def part() -> None:
        begun.append("part")
        try:
            await for_ever()
        finally:
            begun.append("end")

    async def work() -> str:
        begun.append("work")
        await asyncio.sleep(0.05)
        return "done"

    async def fails() -> str:
        raise KeyError("a defect")

    async with keeping(part=part) as (kept, health):
        await until(lambda: begun == ["part"])
        assert await kept.without("part", work()) == "done"
        assert begun[:3] == ["part", "end", "work"]
        await until(lambda: begun == ["part", "end", "work", "part"])
        with pytest.raises(KeyError):
            await kept.without("part", fails())
        await until(lambda: begun.count("part") == 3)
        assert health.state is State.READY
        assert kept.kept()[0].restarts == 0
