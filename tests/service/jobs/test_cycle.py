"""One job from trigger to end: each thing that can go wrong on the way has its reason, and every job ends."""

from __future__ import annotations

import asyncio
import threading
import time
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import NoReturn

import numpy as np
import pytest

from contour.acceptance.error_budget import ErrorBudget
from contour.errors import ParameterError, PictureError
from contour.geometry.rings import Contour, area
from drivers.camera import CameraTimeout, CameraUnavailable, Frame, FrameUnusable, SceneMoved
from drivers.controller.mailbox.blocks import Answer
from drivers.controller.mailbox.pages import Page
from service.jobs.cycle_terms import MailboxFormat
from service.reasons import Outcome, Reason
from service.records.job import TriggerStamp
from service.state import State
from tests.support.controller.protocol_decoder import decode_contour
from tests.support.service.cycle_rig import QUICK, RECTANGLE, SETTINGS, decoded, measured, rig
from tests.support.service.scripted_controller import ScriptedController
from tests.support.service.waiting import until


async def test_a_good_job_is_accepted_and_its_page_says_what_the_protocol_says(tmp_path: Path) -> None:
    async with rig(tmp_path) as built:
        job = await built.job(TriggerStamp("controller", 2, 25_000, session=9, counter=5))
        assert (job.outcome, job.reason) == (Outcome.ACCEPTED, None)
        (page,) = built.controller.accepted
        contour = decoded(page)
        assert contour.header.job_id == job.job_id
        assert contour.header.recipe == 2
        assert (contour.header.session, contour.header.trigger) == (9, 5)
        assert contour.header.valid_for == 30_000
        assert contour.header.area == 5000
        assert contour.header.uncertainty == 0xFFFFFFFF
        assert [list(point) for point in contour.rings[0]] == (RECTANGLE * 1000).astype(int).tolist()
        assert built.measurer.calls == [(2, 25.0)], "the controller's thickness goes before the recipe's"
        assert job.report["vertices"] == 4
        assert job.report["transfer_ms"] > 0


async def test_how_sure_a_contour_is_goes_to_the_register_and_to_the_journal(tmp_path: Path) -> None:
    async with rig(tmp_path) as built:
        built.measurer.result = measured(uncertainty=ErrorBudget(picture_mm=0.3, thickness_mm=0.4, calibration_mm=1.2))
        job = await built.job()
        (page,) = built.controller.accepted
        assert decoded(page).header.uncertainty == 1300
        assert job.report["uncertainty_mm"] == 1.3


async def test_captured_at_was_read_before_the_exposure(tmp_path: Path) -> None:
    async with rig(tmp_path) as built:
        await built.job()
        (page,) = built.controller.accepted
        captured = decoded(page).header.captured_at
        exposed_at = built.seen[0].frame.exposed_at_s
        on_the_controllers_clock = (exposed_at - built.controller.started_at) * 1000 + 1000
        assert 0 < captured <= on_the_controllers_clock


async def test_a_trigger_that_is_not_the_controllers_carries_trigger_0(tmp_path: Path) -> None:
    async with rig(tmp_path) as built:
        await built.job(TriggerStamp("interval"))
        (page,) = built.controller.accepted
        assert decoded(page).header.trigger == 0


async def test_without_a_clock_captured_at_and_valid_for_are_0(tmp_path: Path) -> None:
    controller = ScriptedController()
    controller.clock_runs = False
    async with rig(tmp_path, controller=controller) as built:
        await built.job()
        (page,) = controller.accepted
        header = decoded(page).header
        assert (header.captured_at, header.valid_for) == (0, 0)


async def test_the_recipes_thickness_applies_where_the_trigger_names_none(tmp_path: Path) -> None:
    async with rig(tmp_path) as built:
        await built.job(TriggerStamp("serial", recipe=2))
        assert built.measurer.calls == [(2, 35.0)]


async def test_a_trigger_without_a_recipe_gets_the_default(tmp_path: Path) -> None:
    async with rig(tmp_path) as built:
        built.cycle.use(replace(built.cycle._plan, default_recipe=2))
        await built.job()
        assert built.measurer.calls == [(2, 35.0)]


async def test_an_unknown_recipe_is_refused_with_122_and_no_frame_is_grabbed(tmp_path: Path) -> None:
    async with rig(tmp_path) as built:
        job = await built.job(TriggerStamp("serial", recipe=9))
        assert (job.outcome, job.reason) == (Outcome.REFUSED, Reason.UNKNOWN_RECIPE)
        assert job.detail == "recipe 9 is not configured; there are 1, 2"
        assert built.seen == []


@pytest.mark.parametrize(
    ("error", "state"),
    [
        (CameraUnavailable("gone"), State.ERROR),
        (CameraTimeout("silent for 5 s"), State.ERROR),
        (FrameUnusable("half a picture"), State.READY),
    ],
)
async def test_a_camera_that_fails_ends_the_job_with_100(tmp_path: Path, error: Exception, state: State) -> None:
    def fail(_number: int) -> np.ndarray:
        raise error

    async with rig(tmp_path) as built:
        built.camera._make_picture = fail
        job = await built.job()
        assert (job.outcome, job.reason, job.detail) == (Outcome.FAILED, Reason.NO_FRAME, str(error))
        assert built.machine.state is state
        assert built.controller.count("clear") == 0


async def test_a_frame_of_before_the_trigger_is_refused_with_101(tmp_path: Path) -> None:
    async with rig(tmp_path) as built:
        grab = built.camera.grab

        def stale(exposed_after_s: float, timeout_s: float) -> Frame:
            frame = grab(exposed_after_s, timeout_s)
            return replace(frame, exposed_at_s=exposed_after_s - 0.02)

        built.camera.grab = stale  # type: ignore[method-assign]
        job = await built.job()
        assert (job.outcome, job.reason) == (Outcome.REFUSED, Reason.STALE_FRAME)
        assert "20 ms before the trigger" in (job.detail or "")


async def test_a_scene_that_moves_while_frames_are_averaged_is_refused_with_103(tmp_path: Path) -> None:
    async with rig(tmp_path) as built:

        def moved(_number: int) -> NoReturn:
            raise SceneMoved("cam0: the scene moved by 1.0 px")

        built.camera._make_picture = moved
        job = await built.job()
        assert (job.outcome, job.reason) == (Outcome.REFUSED, Reason.SCENE_MOVED)
        assert built.machine.state is State.READY


async def test_findings_refuse_the_job_with_the_lowest_code_and_all_texts(tmp_path: Path) -> None:
    async with rig(tmp_path) as built:
        built.measurer.result = measured(
            findings=((Reason.AREA_OUT_OF_LIMITS, "area 3"), (Reason.TOO_MANY_POINTS, "points 9"))
        )
        job = await built.job()
        assert (job.outcome, job.reason, job.detail) == (
            Outcome.REFUSED,
            Reason.AREA_OUT_OF_LIMITS,
            "area 3; points 9",
        )
        assert built.controller.count("clear") == 0


def large_contour(vertices: int) -> Contour:
    angle = np.linspace(0, 2 * np.pi, vertices, endpoint=False)
    return Contour(1000 * np.column_stack([np.cos(angle), np.sin(angle)]))


async def test_a_contour_of_several_pages_is_sent_page_by_page(tmp_path: Path) -> None:
    contour = large_contour(1300)
    async with rig(tmp_path) as built:
        built.measurer.result = measured(millimetres=contour, pixels=contour, area_mm2=area(contour))
        job = await built.job()
        assert job.outcome is Outcome.ACCEPTED
        pages = [page for name, page in built.controller.requests if name == "write_page"]
        sent = decode_contour([((1, *page.header), page.payload) for page in pages])
        assert (sent.header.page_count, sent.header.job_id) == (3, job.job_id)
        assert [list(point) for point in sent.rings[0]] == np.rint(contour.exterior * 1000).astype(int).tolist()


async def test_without_answers_a_contour_of_several_pages_is_refused_with_130(tmp_path: Path) -> None:
    """Nobody would know when a page was read, so the next one would overwrite it unseen."""
    contour = large_contour(600)
    async with rig(tmp_path, replace(SETTINGS, transfer=replace(QUICK, handshake=False))) as built:
        built.measurer.result = measured(millimetres=contour, pixels=contour)
        job = await built.job()
        assert (job.outcome, job.reason) == (Outcome.REFUSED, Reason.TOO_MANY_POINTS)
        assert "600 vertices need 2 pages" in (job.detail or "")
        assert built.controller.count("write_page") == 0


async def test_more_rings_than_the_first_pages_table_holds_are_refused_with_130(tmp_path: Path) -> None:
    holes = tuple(np.array([[x, 1.0], [x, 2.0], [x + 1, 1.0]]) for x in range(1, 90, 2))
    contour = Contour(RECTANGLE, holes)
    async with rig(tmp_path, replace(SETTINGS, mailbox=MailboxFormat(payload_capacity=88))) as built:
        built.measurer.result = measured(millimetres=contour, pixels=contour)
        job = await built.job()
        assert (job.outcome, job.reason) == (Outcome.REFUSED, Reason.TOO_MANY_POINTS)
        assert "46 rings" in (job.detail or "")


async def test_a_contour_without_millimetres_is_never_sent(tmp_path: Path) -> None:
    async with rig(tmp_path) as built:
        built.measurer.result = measured(millimetres=None, area_mm2=None)
        job = await built.job()
        assert (job.outcome, job.reason) == (Outcome.REFUSED, Reason.CALIBRATION_MISSING)


async def test_a_defect_ends_the_job_with_190_and_not_the_service(tmp_path: Path) -> None:
    async with rig(tmp_path) as built:
        built.measurer.result = ZeroDivisionError("a defect")
        job = await built.job()
        assert (job.outcome, job.reason) == (Outcome.FAILED, Reason.INTERNAL_ERROR)
        assert job.detail == "ZeroDivisionError: a defect"
        built.measurer.result = measured()
        assert (await built.job()).outcome is Outcome.ACCEPTED


async def test_a_defect_after_sending_withdraws_the_job_first(tmp_path: Path) -> None:
    async with rig(tmp_path, controller=ScriptedController([Answer.WITHDRAWN])) as built:
        read_page = built.controller.read_page

        async def broken(*_lengths: int) -> object:
            built.controller.read_page = read_page  # type: ignore[method-assign]
            raise ZeroDivisionError("a defect")

        built.controller.read_page = broken  # type: ignore[method-assign,assignment]
        job = await built.job()
        assert (job.outcome, job.reason) == (Outcome.FAILED, Reason.INTERNAL_ERROR)
        assert built.controller.link.last_result == Answer.WITHDRAWN


async def test_a_trigger_of_another_session_ends_with_153(tmp_path: Path) -> None:
    async with rig(tmp_path) as built:
        job = await built.job(TriggerStamp("controller", session=8, counter=3))
        assert (job.outcome, job.reason) == (Outcome.FAILED, Reason.CONTROLLER_RESTARTED)
        assert built.seen == []


async def test_a_controller_that_has_gone_before_the_exposure_ends_the_job_with_152(tmp_path: Path) -> None:
    async with rig(tmp_path) as built:
        built.controller.reachable = False
        await asyncio.sleep(0.05)
        job = await built.job()
        assert (job.outcome, job.reason) == (Outcome.FAILED, Reason.CONTROLLER_LOST)


async def test_without_a_controller_a_job_is_traced_and_ends_as_written(tmp_path: Path) -> None:
    async with rig(tmp_path, controller=None) as built:
        job = await built.job()
        assert job.outcome is Outcome.WRITTEN
        assert job.report["area_mm2"] == 5000.0


async def test_without_handshake_the_page_carries_neither_session_nor_clock_nor_trigger(tmp_path: Path) -> None:
    settings = replace(SETTINGS, transfer=replace(QUICK, handshake=False))
    async with rig(tmp_path, settings) as built:
        job = await built.job()
        assert job.outcome is Outcome.WRITTEN
        header = decoded(built.controller.page).header
        assert (header.session, header.captured_at, header.trigger) == (0, 0, 0)


async def test_a_stop_before_sending_ends_the_job_with_161(tmp_path: Path) -> None:
    async with rig(tmp_path) as built:
        built.camera._make_picture = lambda _n: time.sleep(0.3) or np.zeros((6, 8), np.uint8)
        taken = built.journal.take(TriggerStamp("serial"))
        task = asyncio.ensure_future(built.cycle.run(taken))
        await asyncio.sleep(0.1)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        job = built.journal.find(taken.job_id)
        assert job is not None
        assert (job.outcome, job.reason) == (Outcome.FAILED, Reason.ABORTED)


async def test_a_stop_after_sending_leaves_the_job_in_flight(tmp_path: Path) -> None:
    async with rig(tmp_path, controller=ScriptedController([None])) as built:
        taken = built.journal.take(TriggerStamp("serial"))
        task = asyncio.ensure_future(built.cycle.run(taken))
        while built.controller.count("commit") == 0:
            await asyncio.sleep(0.01)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        (job,) = built.journal.unsettled()
        assert job.sent


@pytest.mark.parametrize(
    ("error", "reason"),
    [(PictureError("5 x 5 px"), Reason.NO_FRAME), (ParameterError("core_px is 900"), Reason.INTERNAL_ERROR)],
)
async def test_an_unusable_picture_or_recipe_is_told_as_such_and_is_no_defect(
    tmp_path: Path, error: Exception, reason: Reason, caplog: pytest.LogCaptureFixture
) -> None:
    async with rig(tmp_path) as built:
        built.measurer.result = error
        job = await built.job()
    assert (job.outcome, job.reason) == (Outcome.FAILED, reason)
    assert str(error) in (job.detail or "")
    assert [record for record in caplog.records if record.exc_info] == []


async def test_a_defect_without_handshake_ends_the_job_at_once(tmp_path: Path) -> None:
    settings = replace(SETTINGS, transfer=replace(QUICK, handshake=False))
    async with rig(tmp_path, settings) as built:

        async def broken(*_lengths: int) -> object:
            raise ZeroDivisionError("a defect")

        built.controller.read_page = broken  # type: ignore[method-assign,assignment]
        job = await built.job()
        assert (job.outcome, job.reason) == (Outcome.FAILED, Reason.INTERNAL_ERROR)


async def test_a_journal_that_fails_during_a_job_holds_it_up_is_told_once_and_loses_nothing(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("service.records.durable_journal.PAUSE_S", 0.01)
    async with rig(tmp_path) as built:
        taken = built.journal.take(TriggerStamp("serial"))
        built.journal._file.db.execute("PRAGMA query_only = ON")
        task = asyncio.ensure_future(built.cycle.run(taken))
        await asyncio.sleep(0.3)
        assert built.controller.count("write_page") == 0, "nothing is sent that is not durable"
        assert built.health.first().reason is Reason.INTERNAL_ERROR
        built.journal._file.db.execute("PRAGMA query_only = OFF")
        assert (await asyncio.wait_for(task, 60)).outcome is Outcome.ACCEPTED
    assert sum("journal" in record.message for record in caplog.records if record.name == "combtrace.cycle") == 1


async def test_nothing_is_sent_before_measurement_and_evidence_are_durable(tmp_path: Path) -> None:
    async with rig(tmp_path) as built:
        built.keeper.durable = Future()
        task = asyncio.ensure_future(built.job())
        await until(lambda: built.keeper.drafted)
        await asyncio.sleep(0.2)
        assert built.controller.count("write_page") == 0
        (draft,) = built.keeper.drafted
        assert (draft.job.outcome, draft.measurement, draft.frame) == (None, built.measurer.result, built.seen[0].frame)
        assert not built.journal.unsettled()[0].sent, "a restart would send it, with its evidence lost"
        seen, write_page = [], built.controller.write_page

        async def noting(page: Page) -> None:
            seen.extend(built.journal.unsettled())
            await write_page(page)

        built.controller.write_page = noting  # type: ignore[method-assign]
        built.keeper.durable.set_result(None)
        job = await task
        (taken,) = seen
        assert (taken.terms, taken.transfer) == (job.terms, job.transfer)
        assert taken.terms is not None
        assert taken.transfer["crc32"]
        assert taken.report["vertices"] == 4
        assert job.outcome is Outcome.ACCEPTED
        assert (draft.pages, [kept.job for kept in built.keeper.kept]) == (tuple(built.controller.accepted), [job])


async def test_a_disk_that_hangs_holds_no_contour_up_for_long(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("service.jobs.cycle.EVIDENCE_WAIT_S", 0.05)
    async with rig(tmp_path) as built:
        built.keeper.durable = Future()
        assert (await built.job()).outcome is Outcome.ACCEPTED
    assert "job 1 goes on without its evidence: the archive's disk is slow" in caplog.text


async def test_a_job_that_is_stopped_before_it_was_sent_leaves_what_it_came_to(tmp_path: Path) -> None:
    async with rig(tmp_path) as built:
        measuring = threading.Event()
        built.measurer.measure = lambda *_: measuring.set() or time.sleep(0.3)  # type: ignore[assignment,method-assign]
        task = asyncio.ensure_future(built.job())
        await until(measuring.is_set)
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task
        job = built.journal.last_settled()
        assert job is not None
        assert (job.reason, job.report.keys()) == (Reason.ABORTED, {"frame", "frame_ms"})
        (kept,) = built.keeper.kept
        assert kept.job == job
        assert kept.frame is not None


async def test_a_withdrawal_that_drags_on_is_an_error_with_its_reason(tmp_path: Path) -> None:
    settings = replace(SETTINGS, transfer=replace(QUICK, max_repeats=1))
    async with rig(tmp_path, settings, controller=ScriptedController([None])) as built:
        taken = built.journal.take(TriggerStamp("serial"))
        task = asyncio.ensure_future(built.cycle.run(taken))
        while built.machine.state is not State.ERROR:
            await asyncio.sleep(0.01)
        assert "cannot be taken back" in (built.machine.reason or "")
        built.controller.answers = [Answer.WITHDRAWN]
        await asyncio.wait_for(task, 60)
        assert built.machine.state is State.READY


async def test_an_observed_job_is_made_and_not_sent(tmp_path: Path) -> None:
    async with rig(tmp_path, replace(SETTINGS, observe=True)) as built:
        job = await built.job(TriggerStamp("controller", session=9, counter=5))
        assert (job.outcome, job.reason) == (Outcome.WRITTEN, None)
        assert job.detail == "observed only: 1 page(s) made, nothing sent"
        assert job.report["vertices"] == 4
        assert {name for name, _ in built.controller.requests} <= {"write_service"}
        assert built.journal.unsettled() == ()


async def test_a_withdrawal_after_a_defect_that_dragged_on_leaves_no_fault_behind(tmp_path: Path) -> None:
    settings = replace(SETTINGS, transfer=replace(QUICK, max_repeats=1))
    async with rig(tmp_path, settings, controller=ScriptedController([None])) as built:
        read_page = built.controller.read_page

        async def broken(*_lengths: int) -> object:
            built.controller.read_page = read_page  # type: ignore[method-assign]
            raise ZeroDivisionError("a defect")

        built.controller.read_page = broken  # type: ignore[method-assign,assignment]
        taken = built.journal.take(TriggerStamp("serial"))
        task = asyncio.ensure_future(built.cycle.run(taken))
        while built.machine.state is not State.ERROR:
            await asyncio.sleep(0.01)
        built.controller.answers = [Answer.WITHDRAWN]
        assert (await asyncio.wait_for(task, 60)).reason is Reason.INTERNAL_ERROR
        assert built.machine.state is State.READY
