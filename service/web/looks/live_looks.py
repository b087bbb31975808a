"""One loop of looks for all who watch: it begins with the first who asks, and ends soon after the last has asked."""

from __future__ import annotations

import logging
import threading
import time
from collections import OrderedDict
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

from contour.errors import ParameterError
from contour.image.picture_figures import PictureFigures
from service.jobs.cycle_terms import Plan
from service.jobs.live_view import LiveView, Look, Sight
from service.jobs.spare_camera import LookSources, NobodyLooks, SpareCamera
from service.low_priority import go_last
from service.records.archived_job import ArchivedJob
from service.records.evidence import calibration_fields, measurement_fields
from service.records.journal_file import stamp
from service.web.drawing import drawing
from service.web.evidence_files import made_small
from service.web.looks.models import LiveAnswer, LiveLook, LookFigures, LookFinding
from service.web.models import Drawing, RecipeName
from service.worker import WorkerEnded

log = logging.getLogger("combtrace.page")

MOST_HZ = 2.0  # a person moves a block, turns a lens; and a job that comes finds the camera free most of the time
WANTED_S = 4.0  # so long after somebody has asked; pages ask more than once a second
AGAIN_S = 2.0  # after a loop that broke
LONGEST_GRAB_S = 1.0  # a job would wait for a camera that is silent
PICTURES_KEPT = 4  # who has just been told of one may still ask for it
WIDTH_PX = 1280


class LiveLooks:
    """The newest look. May be called from any thread; none of the calls blocks."""

    def __init__(self, sources: LookSources, *, now: Callable[[], float] = time.monotonic) -> None:
        self._sources = sources
        self._now = now
        self._wanted_until_s = 0.0
        self._closed = False
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None
        self._camera = SpareCamera(sources, self._wanted)
        self._latest: LiveLook | None = None
        self._pictures: OrderedDict[int, bytes] = OrderedDict()
        self._number = 0

    def close(self) -> None:
        """Look no more; the loop ends by itself."""
        self._closed = True

    @property
    def looking(self) -> bool:
        """True while the loop runs."""
        return self._thread is not None

    def answer(self, after: int) -> LiveAnswer:
        """The newest look after that number; who asks keeps the loop going."""
        if not self._sources.spare:
            return LiveAnswer(waits_for="source", detail=None, look=None)
        with self._lock:
            self._wanted_until_s = self._now() + WANTED_S
            if self._thread is None and not self._closed:
                self._thread = threading.Thread(target=self._run, name="live view", daemon=True)
                self._thread.start()
            latest = self._latest
        look = latest if latest is not None and latest.number > after else None
        if self._camera.trouble is not None or not self._sources.works():
            return LiveAnswer(waits_for="camera", detail=self._camera.trouble, look=look)
        if not self._sources.idle():
            return LiveAnswer(waits_for="job", detail=None, look=look)
        return LiveAnswer(waits_for="start" if latest is None else None, detail=None, look=look)

    def picture(self, number: int) -> bytes | None:
        """A look's frame as JPEG, made small; None where it is not kept."""
        with self._lock:
            return self._pictures.get(number)

    def _wanted(self) -> bool:
        return not self._closed and self._now() < self._wanted_until_s

    # --- the loop, in a thread of its own -----------------------------------------------------------------------------

    def _run(self) -> None:
        go_last()
        try:
            while self._wanted():
                self._look(self._sources.plan())
        except NobodyLooks:
            pass
        except (WorkerEnded, ParameterError) as error:
            log.warning("live view: %s", error)
            time.sleep(AGAIN_S)
        except Exception:  # the one owner of its defects: they must not come back with every question
            log.exception("live view: internal error")
            time.sleep(AGAIN_S)
        finally:
            with self._lock:
                self._thread = self._latest = None
                self._pictures.clear()

    def _look(self, plan: Plan) -> None:
        """Look by this plan, as long as jobs are measured by it and somebody wants to see."""
        recipe = plan.recipes[plan.default_recipe]
        sight = Sight(plan.measurer, recipe, recipe.thickness_mm)
        timeout_s = min(self._sources.timeout_s, LONGEST_GRAB_S)
        with LiveView(sight, processes=1, gives_way=True) as view:
            for look in view.looks(self._camera, timeout_s, MOST_HZ):
                self._show(look, plan)
                if not self._wanted() or self._sources.plan() is not plan:
                    return

    def _show(self, look: Look, plan: Plan) -> None:
        recipe = plan.recipes[plan.default_recipe]
        picture = None if look.frame is None else made_small(look.frame.pixels, (WIDTH_PX,))[WIDTH_PX]
        number = max(self._number + 1, time.time_ns() // 1_000_000)  # none of before a restart comes again
        shown = LiveLook(
            number=number,
            at=stamp(datetime.now(UTC)),
            recipe=RecipeName(number=recipe.number, name=recipe.name),
            findings=[
                LookFinding(code=int(reason), name=reason.label, text=text)
                for reason, text in look.measurement.findings
            ],
            figures=_figures(look.figures),
            drawing=_drawing(look, plan, recipe.thickness_mm),
        )
        with self._lock:
            self._number, self._latest = number, shown
            if picture is not None:
                self._pictures[number] = picture
            while len(self._pictures) > PICTURES_KEPT:
                self._pictures.popitem(last=False)


def _figures(figures: PictureFigures | None) -> LookFigures | None:
    if figures is None:
        return None
    return LookFigures(
        sharpness=figures.sharpness,
        mean_grey=figures.mean,
        black_share=figures.dark_share,
        white_share=figures.bright_share,
    )


def _drawing(look: Look, plan: Plan, thickness_mm: float) -> Drawing | None:
    """As of a job that was archived, so that both look the same; job 0 is none."""
    if look.frame is None:
        return None
    document = {
        "job": {"outcome": "refused" if look.measurement.findings else "accepted"},
        "frame": {"shape": list(look.frame.pixels.shape)},
        "thickness_mm": thickness_mm,
        "calibration": calibration_fields(plan.measurer),
        "measurement": measurement_fields(look.measurement),
    }
    return drawing(ArchivedJob(0, Path(), document))
