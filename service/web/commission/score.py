"""How far each step is: scores and sentences, of what is kept and of what the daemon knows. It measures nothing."""

from __future__ import annotations

from contour.image.picture_figures import MOST_CLIPPED
from service.config.controllers import NoController
from service.reasons import Outcome
from service.state import State
from service.web.commission.board_shots import GOOD_VIEWS, Judged
from service.web.commission.models import Commission, Step, StepName
from service.web.commission.session import MOST_SHOTS, Session, StepRefused
from service.web.commission.shell import Shell
from service.web.daemon_access import PageSources

SHARP_SHARE = 0.9
"""Of the sharpest picture so far: a lens that is turned past its best is turned back."""
CLIPPED_SCORE = 50


def commission_of(
    sources: PageSources, session: Session, judged: Judged, running: str | None, progress: str
) -> Commission:
    """All steps, as they stand."""
    notes = session.notes
    return Commission(
        halted=sources.health.state is State.HALTED and sources.executor.idle,
        running=running,
        progress=progress,
        steps=_Steps(sources, session, judged).all(),
        board=notes.board,
        setup=notes.setup,
        shots=judged.shots,
        most_shots=MOST_SHOTS,
        zones=judged.zones,
        raised=[] if judged.so_far is None else sorted(judged.so_far.raised),
        wanted_views=GOOD_VIEWS,
        thickness_mm=notes.thickness_mm,
        points=_points(session),
        adoptable=notes.calibration is not None and notes.calibration.good and not notes.calibration.adopted,
        reported=notes.calibration is not None and session.report.is_file(),
        changes=notes.changes,
    )


def _points(session: Session) -> list[list[float]]:
    try:
        return session.points
    except StepRefused:  # told when they are used
        return []


class _Steps:
    """Each step, of what is known now."""

    def __init__(self, sources: PageSources, session: Session, judged: Judged) -> None:
        self._sources = sources
        self._notes = session.notes
        self._flat = session.flat
        self._judged = judged
        self._config = sources.commission.config()
        self._commands = Shell(self._config, sources.commission.path, session).commands

    def all(self) -> list[Step]:
        """In the order in which they are done."""
        return [
            *(self._camera(), self._board(), self._calibration(), self._height(), self._alignment()),
            *(self._table(), self._marks(), self._controller(), self._job()),
        ]

    def _step(self, name: StepName, score: int, lines: list[str], *, well: bool) -> Step:
        fault = self._notes.faults.get(name)
        return Step(name=name, score=score, well=well, command=self._commands[name], lines=lines, fault=fault)

    def _camera(self) -> Step:
        look = self._notes.look
        if look is None:
            return self._step("camera", 0, [], well=False)
        share = look.sharpness / look.best if look.best > 0 else 0.0
        clipped = max(look.white_share, look.black_share) > MOST_CLIPPED
        kind = "colour" if look.colour else "grey"
        lines = [
            f"{look.width} x {look.height} px, {kind}, {look.format}",
            f"sharpness {look.sharpness:.1f} %, {share:.0%} of the best",
        ]
        if look.white_share > MOST_CLIPPED:
            lines.append(f"{look.white_share:.1%} white, clipped: less light or exposure")
        if look.black_share > MOST_CLIPPED:
            lines.append(f"{look.black_share:.1%} black, clipped: more light or exposure")
        score = min(round(100 * share), CLIPPED_SCORE if clipped else 100)
        return self._step("camera", score, lines, well=share >= SHARP_SHARE and not clipped)

    def _board(self) -> Step:
        so_far = self._judged.so_far
        lines = [] if so_far is None or so_far.fault is None else [so_far.fault]
        return self._step("board", self._judged.score, lines, well=self._judged.sound and self._flat is not None)

    def _calibration(self) -> Step:
        made, guard = self._notes.calibration, self._sources.guard()
        lines, score = [], 0 if guard is None else 100
        if made is not None:
            lines.append(made.sentence)
            if made.options:
                lines.append(f"To take it nevertheless, use the command with {made.options}.")
            score = 100 if made.adopted else 90 if made.good else round(80 * min(made.accept_mm / made.figure_mm, 1))
        if guard is not None:
            expired = guard.expired()
            lines.append(f"In force: {guard.record.digest}." if expired is None else expired[1])
        well = guard is not None and guard.expired() is None and (made is None or made.adopted)
        return self._step("calibration", score, lines, well=well)

    def _height(self) -> Step:
        height_mm, guard = self._notes.thickness_mm, self._sources.guard()
        if height_mm is None:
            return self._step("height", 0, [], well=False)
        plan = self._sources.looks.plan()
        recipe = plan.recipes[plan.default_recipe]
        lines = []
        if recipe.thickness_mm != height_mm:
            lines.append(
                f"Recipe {recipe.number} says {recipe.thickness_mm:g} mm: set its thickness_mm to {height_mm:g}, or "
                "have the controller tell it. The first job takes what is told here."
            )
        if guard is None or not guard.record.calibration.height_known(height_mm):
            lines.append("No calibration in force holds at that height.")
            return self._step("height", 50, lines, well=False)
        sure = guard.record.calibration.uncertainty
        figure_mm = None if sure is None else sure.figure_mm(height_mm)
        if figure_mm is not None:
            lines.append(f"95 % of positions at {height_mm:g} mm are within {figure_mm:.3f} mm.")
        share = 1.0 if figure_mm is None else min(self._notes.setup.accept_mm / figure_mm, 1.0)
        return self._step("height", round(100 * share), lines, well=share == 1.0)

    def _alignment(self) -> Step:
        guard = self._sources.guard()
        is_aligned = guard is not None and guard.record.calibration.aligned
        return self._step("alignment", 100 * is_aligned, self._notes.alignment, well=is_aligned)

    def _marks(self) -> Step:
        guard = self._sources.guard()
        sentinels = None if guard is None else guard.record.sentinels
        if sentinels is None:
            return self._step("marks", 0, [], well=False)
        seen = ", ".join(str(mark.id) for mark in sentinels.marks)
        return self._step("marks", 100, [f"Marks {seen} of {sentinels.dictionary} are kept."], well=True)

    def _table(self) -> Step:
        taught = self._sources.looks.plan().measurer.table
        if self._config.table is None:
            return self._step(
                "table", 0, ["The configuration names no table.file: this step may be left out."], well=False
            )
        if taught is None:
            return self._step("table", 0, [], well=False)
        line = (
            f"Taught at {taught.taught_at} of {taught.pictures} pictures, noise {taught.table.noise:.1f} grey levels."
        )
        return self._step("table", 100, [line], well=True)

    def _controller(self) -> Step:
        if isinstance(self._config.controller, NoController):
            return self._step("controller", 100, ["controller.kind is none: contours are only archived."], well=True)
        lines = self._notes.probe
        score = round(100 * sum(line.well for line in lines) / len(lines)) if lines else 0
        told = [f"{'ok' if line.well else 'FAULT'} {line.part}: {line.text}" for line in lines]
        return self._step("controller", score, told, well=bool(lines) and score == 100)

    def _job(self) -> Step:
        job = self._sources.executor.last_settled
        if job is None or job.outcome is None:
            return self._step("job", 0, [], well=False)
        accepted = job.outcome in (Outcome.ACCEPTED, Outcome.WRITTEN)
        lines = [job.detail] if job.detail else []
        return self._step("job", 100 if accepted else 0, lines, well=accepted)
