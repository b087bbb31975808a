"""Camera, board and calibration: pictures of the board become the file that `combtrace calibrate` writes."""

from __future__ import annotations

from datetime import UTC, datetime

from contour.camera_calibration.calibrate import Setup
from contour.errors import CalibrationFailed
from contour.image.picture_figures import picture_figures
from service.calibrating.from_board import BoardCalibration, calibrate_board
from service.measuring.board_pictures import PlaneViewError
from service.measuring.calibration_file import CalibrationFileError, load_record, save_record
from service.web.commission import models
from service.web.commission.bench import Bench, not_writable
from service.web.commission.board_shots import board_of
from service.web.commission.session import KeptCalibration, KeptLook, StepRefused


class BoardActions:
    """Each gives what the journal is to say; raises StepRefused."""

    def __init__(self, bench: Bench) -> None:
        self.bench = bench

    async def look(self, asked: models.LookRequest) -> str:
        """Note what the camera shows."""

        def work() -> str:
            frame = self.bench.frame()
            figures = picture_figures(frame.pixels)
            notes = self.bench.session.notes
            before = None if asked.anew else notes.look
            height, width = frame.pixels.shape[:2]
            best = before.best if before is not None and (before.width, before.height) == (width, height) else 0.0
            notes.camera = frame.camera
            notes.look = KeptLook(
                width=width,
                height=height,
                colour=frame.pixels.ndim == 3,
                format=str(getattr(self.bench.daemon.sources.looks.camera, "opened", None) or frame.source),
                sharpness=figures.sharpness,
                best=max(best, figures.sharpness),
                white_share=figures.bright_share,
                black_share=figures.dark_share,
            )
            return str(figures)

        return await self.bench.in_thread(work)

    async def board(self, asked: models.BoardRequest) -> str:
        """Take the board for this one; all pictures are looked at anew."""

        def work() -> str:
            board = board_of(asked)
            self.bench.session.notes.board = asked.model_copy(update={"take_over": ""})
            self.bench.judge()
            return f"{board.kind} {board.name_of_size}, {board.square_mm:g} mm"

        return await self.bench.in_thread(work)

    async def shoot(self, asked: models.ShootRequest) -> str:
        """A picture of the board."""

        def work() -> str:
            if self.bench.session.notes.board is None:
                raise StepRefused("which board it is has not been told. Tell it first")
            self.bench.session.add(self.bench.frame(), flat=asked.flat)
            self.bench.judge()
            shot = self.bench.judged.shots[-1]
            return f"picture {shot.number}: {shot.why or f'{shot.corners} corners'}"

        return await self.bench.in_thread(work)

    async def remove(self, asked: models.RemoveRequest) -> str:
        """One picture less."""

        def work() -> str:
            self.bench.session.remove(asked.shot)
            self.bench.judge()
            return f"picture {asked.shot} removed"

        return await self.bench.in_thread(work)

    async def calibrate(self, asked: models.CalibrateRequest) -> str:
        """A calibration of the pictures, with its report; it is not used before it is adopted."""

        def work() -> str:
            notes, flat = self.bench.session.notes, self.bench.session.flat
            if notes.board is None or flat is None:
                raise StepRefused("there is no picture of the board flat on the table. Take one, `flat`")
            self.bench.session.candidate.unlink(missing_ok=True)
            notes.calibration = None
            setup = Setup(
                plane=str(flat.path),
                board_thickness_mm=notes.board.thickness_mm,
                block_mm=asked.block_mm,
                accept_mm=asked.accept_mm,
                camera_height_mm=asked.camera_height_mm,
                camera_name=notes.camera,
            )
            notes.setup = models.CalibrateRequest(**{**asked.model_dump(), "take_over": ""})
            paths = [shot.path for shot in self.bench.session.shots]
            try:
                made = calibrate_board(
                    flat.path,
                    paths,
                    board_of(notes.board),
                    setup,
                    lambda _: None,
                    lambda: datetime.now(UTC),
                    self.bench.go_on,
                )
                made.report(self.bench.session.report)
                if made.result.verdict.good:
                    save_record(self.bench.session.candidate, made.record)
            except (PlaneViewError, CalibrationFailed, CalibrationFileError) as error:
                raise StepRefused(self.bench.without_folder(error)) from error
            except OSError as error:
                raise StepRefused(f"{self.bench.session.report}: cannot be written: {error.strerror}") from error
            notes.calibration = _kept(made)
            return made.result.verdict.sentence

        return await self.bench.in_thread(work)

    async def adopt(self, _asked: models.ActionRequest) -> str:
        """The calibration where the configuration has it, in force for the next job."""
        settings = self.bench.config.calibration
        calibration = self.bench.session.notes.calibration
        if settings is None:
            raise StepRefused("the configuration names no calibration.file. Name one")
        if calibration is None or not self.bench.session.candidate.is_file():
            raise StepRefused("there is no calibration to adopt. Calibrate first")

        def work() -> str:
            try:
                record = load_record(self.bench.session.candidate)
                save_record(settings.file, record)
            except CalibrationFileError as error:
                raise StepRefused(not_writable(error)) from error
            calibration.adopted = True
            self.bench.session.notes.alignment = []  # the file that stood there had it
            return load_record(settings.file).digest

        digest = await self.bench.in_thread(work)
        await self.bench.take_effect()
        return digest


def _kept(made: BoardCalibration) -> KeptCalibration:
    verdict = made.result.verdict
    sure = verdict.uncertainty
    return KeptCalibration(
        good=verdict.good,
        sentence=verdict.sentence,
        figure_mm=max(sure.figure_mm(0.0), sure.figure_mm(made.setup.block_mm)),
        accept_mm=made.setup.accept_mm,
        views=len(made.result.views),
        options=" ".join(verdict.overrides),
    )
