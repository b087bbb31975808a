"""`combtrace demo`: the whole way once, on embedded defaults, with a simulated controller on a real socket."""

from __future__ import annotations

import argparse
import asyncio
import logging
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING

from service.cli.errors import EXIT_FAILED, EXIT_OK, UserError
from service.cli.file_names import make_folder

if TYPE_CHECKING:
    from drivers.controller.simulated.contour import AcceptedContour
    from service.config.config import Config
    from service.jobs.cycle_terms import Observation
    from service.records.job import Job

HELP = "run the whole way once, with a simulated controller"
DESCRIPTION = """\
Run the daemon's own path once: a shipped picture, the tracing, the journal, and a
simulated controller over Modbus TCP on this machine. Nothing has to be set up.
Writes the picture with the contour over it."""

_WIDTH = 79
"""Columns of a newcomer's terminal, which has 24 rows: everything said is seen at once."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Where the output goes."""
    parser.add_argument("--output", type=Path, default=Path("demo-output"), metavar="DIR", help="default demo-output")


def run(args: argparse.Namespace) -> int:
    """Run the demo."""
    make_folder("--output", args.output)
    _log_to_the_terminal()
    return asyncio.run(_demo(args.output))


async def _demo(output: Path) -> int:
    from drivers.controller.simulated.controller import SimulatedController
    from service.daemon.daemon import Daemon
    from service.jobs.trigger_queue import TriggerRefused
    from service.wiring.daemon import build
    from service.wiring.errors import WiringError

    taken: list[AcceptedContour] = []
    seen: list[Observation] = []
    async with SimulatedController(on_accepted=taken.append) as controller:
        print(f"simulated controller listens on 127.0.0.1:{controller.port} (Modbus TCP)")
        config = demo_config(output, controller.port)
        try:
            parts = build(config, observe=seen.append)
            job = await Daemon(parts).run_once(10.0)
        except (WiringError, TriggerRefused) as error:
            raise UserError(f"the demo did not start: {error}", EXIT_FAILED) from error
    for line in report(job, seen, taken):
        print(line)
    if seen:
        print(f"picture: {_draw(output, seen[-1])}")
    return EXIT_OK if job.outcome == "accepted" and _equal(seen, taken) else EXIT_FAILED


def demo_config(output: Path, port: int) -> Config:
    """The embedded defaults, with the shipped pictures, this controller, and a state of its own."""
    from service.config.config_file import default_config

    config = default_config()
    return config.model_copy(
        update={
            "controller": config.controller.model_copy(update={"host": "127.0.0.1", "port": port}),
            "service": config.service.model_copy(update={"state_dir": output / "state"}),
            "journal": config.journal.model_copy(update={"path": output / "state" / "journal.sqlite"}),
            "archive": config.archive.model_copy(update={"path": output / "state" / "archive"}),
            "triggers": (),
        }
    )


def report(job: Job, seen: list[Observation], taken: list[AcceptedContour]) -> list[str]:
    """What a person wants to know of the job."""
    lines = [f"job {job.job_id}: {job.outcome}" + (f" ({job.reason.label}: {job.detail})" if job.reason else "")]
    if seen:
        measurement = seen[-1].measurement
        lines.append(f"  frame         {Path(seen[-1].frame.source).name}")
        lines.append(f"  method        {measurement.method}, walls {measurement.polarity}")
        if measurement.pitch_px is not None:
            lines.append(f"  cell pitch    {measurement.pitch_px:.1f} px")
        if measurement.millimetres is not None and measurement.size_mm is not None:
            width, height = measurement.size_mm
            lines.append(f"  vertices      {measurement.millimetres.point_count}")
            lines.append(f"  area          {measurement.area_mm2:.1f} mm²")
            lines.append(f"  size          {width:.1f} x {height:.1f} mm")
        stages = ", ".join(f"{name}={value:.1f}" for name, value in measurement.timings_ms.items())
        wrapped = textwrap.wrap(stages, _WIDTH, initial_indent="  stages, ms    ", subsequent_indent=" " * 16)
        lines += [line.replace("=", " ") for line in wrapped]
    if "transfer_ms" in job.report:
        lines.append(f"  transfer      {job.report['transfer_ms']:.1f} ms, to the controller's final answer")
    for contour in taken:
        points = sum(len(ring) for ring in contour.rings)
        verdict = "equal to what was sent" if _equal(seen, taken) else "NOT EQUAL to what was sent"
        lines.append(f"  controller    took job {contour.job_id}: {points} vertices, {contour.area_mm2} mm²: {verdict}")
    return lines


def _equal(seen: list[Observation], taken: list[AcceptedContour]) -> bool:
    """True where the controller's last contour is, to the micrometre, the one that was measured last."""
    if not seen or not taken or seen[-1].measurement.millimetres is None:
        return False
    sent = [
        [(round(x * 1000), round(y * 1000)) for x, y in ring.tolist()]
        for ring in seen[-1].measurement.millimetres.rings
    ]
    received = [[(round(x * 1000), round(y * 1000)) for x, y in ring] for ring in taken[-1].rings]
    return sent == received


def _draw(output: Path, observation: Observation) -> Path:
    from service.records.pictures import write_overlay

    path = output / f"{Path(observation.frame.source).stem}-contour.png"
    write_overlay(path, observation.frame.pixels, observation.measurement)
    return path


def _log_to_the_terminal() -> None:
    """Show the daemon's states and warnings as the demo's running text; what else it says, `report` says shorter."""
    import sys

    handler = logging.StreamHandler(sys.stdout)
    handler.setFormatter(logging.Formatter("  %(message)s"))
    handler.addFilter(lambda record: record.levelno > logging.INFO or record.name == "combtrace.state")
    logger = logging.getLogger("combtrace")
    logger.addHandler(handler)
    logger.setLevel(logging.INFO)
    logger.propagate = False
