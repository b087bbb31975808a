"""One service and one simulated controller, as processes, on a folder of their own."""

from __future__ import annotations

from pathlib import Path

from tests.support.pictures.combs import write_combs
from tests.support.processes.processes import Process, free_port, jobs, lines, until

SAMPLES = Path(__file__).parents[3] / "service" / "samples"
ON_SAMPLES = f"{{kind: files, path: {SAMPLES}, loop: true}}"  # a camera


class Cell:
    """A service and a controller, each of which may be killed and started again.

    camera, calibration: without either it sees drawn combs, small ones; where only the camera is told, the calibration
    is that of the samples. A reply may take three seconds, as a busy machine's processes may be still for one.
    """

    def __init__(
        self,
        folder: Path,
        *,
        triggers: str = "[{kind: controller}]",
        trigger_every_s: float | None = 0.2,
        camera: str = "",
        service: str = "{state_dir: state}",
        calibration: Path | None = None,
        link: str = "",
        journal: str = "{path: journal.sqlite}",
        more: str = "",
        recipe: int = 0,
        scenario: str = "",
    ) -> None:
        self._trigger_every = () if trigger_every_s is None else ("--trigger-every", str(trigger_every_s))
        self._trigger_every += ("--recipe", str(recipe))
        if not camera:
            combs = write_combs(folder / "combs")
            camera, calibration = f"{{kind: files, path: {combs}, loop: true}}", calibration or folder / "combs.yaml"
        self.folder = folder
        self.scenario = scenario  # the controller's, from its next start on
        self.port = free_port()
        self.journal = folder / "journal.sqlite"
        self.accepted = folder / "accepted.jsonl"
        (folder / "config.yaml").write_text(
            f"camera: {camera}\n"
            f"calibration: {{file: {calibration or SAMPLES / 'calibration.yaml'}}}\n"
            f"controller: {{kind: modbus-tcp, port: {self.port}, timeout_s: 3, ack_timeout_s: 1{link}}}\n"
            f"triggers: {triggers}\n"
            f"service: {service}\n"
            f"journal: {journal}\n"
            f"{more}"
        )
        self.service = self.start_service()
        self.controller = self.start_controller()

    def start_service(self) -> Process:
        return Process(self.folder / "service.log", "run", "--config", self.folder / "config.yaml")

    def start_controller(self) -> Process:
        (self.folder / "scenario.yaml").write_text(self.scenario or "{}")
        return Process(
            self.folder / "controller.log",
            *("simulate-controller", "--tcp", f"127.0.0.1:{self.port}", *self._trigger_every),
            *("--scenario", self.folder / "scenario.yaml"),
            *(
                "--log",
                self.accepted,
                "--memory",
                self.folder / "memory.json",
                "--verdict",
                self.folder / "verdict.json",
            ),
        )

    def settled(self) -> list[dict[str, object]]:
        """Jobs that have ended."""
        return [job for job in jobs(self.journal) if job["outcome"] is not None]

    def number(self, nth: int) -> int:
        """The number of the n-th job, from 1; the first one's is drawn at the service's start."""
        return int(jobs(self.journal)[0]["job_id"]) + nth - 1

    def ready(self) -> None:
        """Wait until the service says Ready."""
        until(lambda: "-> Ready" in self.service.text, what="Ready")

    def in_error(self) -> None:
        """Wait until the service says Error, after it was Ready last: it may say so of its start, too."""
        until(lambda: "-> Error" in self.service.text.rpartition("-> Ready")[2], what="Error")

    def goes_on(self, count: int) -> None:
        """Wait until `count` more jobs have been accepted."""
        before = len(lines(self.accepted))
        until(lambda: len(lines(self.accepted)) >= before + count, 90, f"{count} more accepted jobs")

    def stop(self) -> None:
        for process in (self.service, self.controller):
            if process.running:
                process.stop()
