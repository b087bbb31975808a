"""Which command each step is, as it would be typed at the service's computer."""

from __future__ import annotations

import shlex
from pathlib import Path

from service.config.config import Config
from service.measuring.board_svg import arguments
from service.web.commission.board_shots import board_of
from service.web.commission.session import Session

UNTOLD_BOARD = "--board charuco --squares 11x8 --square-mm 25"


class Shell:
    """The commands, with what has been told so far."""

    def __init__(self, config: Config, path: Path | None, session: Session) -> None:
        """path: of the configuration."""
        self._config = config
        self._at = f"--config {path or 'config.yaml'}"
        self._session = session

    @property
    def commands(self) -> dict[str, str]:
        """By step."""
        folder, height_mm = self._session.folder, self._session.notes.thickness_mm
        at_height, calibrate = f" --thickness-mm {height_mm:g}" if height_mm else "", self._calibrate()
        told = {
            "camera": f"focus {self._at}",
            "board": f"grab {self._at} --output {folder}/view-001.png",
            "calibration": calibrate,
            "height": f"trigger {self._at}{at_height}",
            "alignment": f"align --points {self._session.points_file} --calibration {self._calibration_file}",
            "table": f"teach-table {self._at}",
            "marks": f"{calibrate} --sentinels DICT_4X4_50",
            "controller": f"probe {self._at} --write",
            "job": f"trigger {self._at}{at_height}",
        }
        return {step: f"combtrace {command}" for step, command in told.items()}

    @property
    def _calibration_file(self) -> Path:
        settings = self._config.calibration
        return Path("calibration.yaml") if settings is None else settings.file

    def _calibrate(self) -> str:
        notes, flat = self._session.notes, self._session.flat
        words = ["calibrate", UNTOLD_BOARD if notes.board is None else arguments(board_of(notes.board))]
        words.append(f"--plane {'flat.png' if flat is None else flat.path} --block-mm {notes.setup.block_mm:g}")
        words.append(f"--accept-mm {notes.setup.accept_mm:g}")
        if notes.setup.camera_height_mm is not None:
            words.append(f"--camera-height-mm {notes.setup.camera_height_mm:g}")
        if notes.board is not None and notes.board.thickness_mm:
            words.append(f"--board-thickness-mm {notes.board.thickness_mm:g}")
        if notes.camera:
            words.append(f"--camera-name {shlex.quote(notes.camera)}")
        return " ".join([*words, f"--output {self._calibration_file} {self._session.folder}"])
