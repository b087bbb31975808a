"""The soak in pieces, each a campaign with a seed of its own, run as a process: a run can be split and resumed."""

from __future__ import annotations

import asyncio
import logging
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path

from tests.soak.cells.disk_cell import DiskCell
from tests.soak.cells.faulted_cell import FaultedCell, Outcome, Terms, Transport
from tests.soak.cells.killed_cell import KilledCell, Killing, Toll
from tests.soak.cells.other_services import ForeignCell, TwinCell
from tests.soak.cells.restored_cell import RestoredCell
from tests.soak.cells.stopped_cell import StoppedCell
from tests.soak.cells.swapped_cell import SettingsCell, SpareCell
from tests.soak.cells.told_cell import ToldCell
from tests.soak.cells.torn_cell import TornCell

LINE: tuple[Transport, ...] = ("tcp", "rtu", "rtu-over-tcp")
# What is done to both sides in one process.
INCIDENTS: dict[str, type[FaultedCell]] = {
    "restored-journals": RestoredCell,
    "copied-journals": TwinCell,
    "foreign-owners": ForeignCell,
    "spare-controllers": SpareCell,
    "changed-settings": SettingsCell,
    "torn-values": TornCell,
}
# What is done to one of two processes, or to its disk.
BLOWS: dict[str, type[KilledCell]] = {
    "service-kills": KilledCell,
    "controller-kills": KilledCell,
    "service-stops": StoppedCell,
    "controller-stops": StoppedCell,
    "small-disks": DiskCell,
    "serial-answers": ToldCell,
}
SIZES = {  # of a piece
    **dict.fromkeys(LINE, 125),
    **dict.fromkeys(BLOWS, 25),
    "small-disks": 10,
    "restored-journals": 150,
    "copied-journals": 5,
    "foreign-owners": 40,
    "spare-controllers": 60,
    "changed-settings": 40,
    "torn-values": 70,
    "fuzz": 25_000,
}
OVER_ALL_LINES = ("service-kills", "service-stops", "serial-answers")
CAPACITIES = (1984, 64, 602, 24)
RISKS = (0.03, 0.06, 0.12)


@dataclass(frozen=True)
class Amounts:
    """How much of each campaign, in jobs, kills and the like; in the order of the report."""

    tcp: int = 5000
    rtu: int = 500
    rtu_over_tcp: int = 500
    service_kills: int = 500
    controller_kills: int = 100
    service_stops: int = 100
    controller_stops: int = 50
    restored_journals: int = 1200
    copied_journals: int = 40
    foreign_owners: int = 240
    spare_controllers: int = 360
    changed_settings: int = 200
    torn_values: int = 350
    small_disks: int = 40
    serial_answers: int = 100
    fuzz: int = 100_000


@dataclass
class Result:
    """What a piece came to. campaign: the row of the report that it counts for; done: jobs, kills or cases."""

    campaign: str
    terms: str
    done: int
    jobs: int = 0
    accepted: int = 0
    acknowledged: int = 0
    restarts: int = 0
    seconds: float = 0.0
    outcomes: dict[str, int] = field(default_factory=dict)
    faults: dict[str, int] = field(default_factory=dict)
    instants: dict[str, int] = field(default_factory=dict)
    findings: dict[str, int] = field(default_factory=dict)
    texts: list[str] = field(default_factory=list)


def all_pieces(amounts: Amounts) -> list[str]:
    """Names of the pieces, each `campaign-seed-amount`, in an order that mixes the campaigns."""
    names: list[list[str]] = []
    for name, amount in asdict(amounts).items():
        campaign = name.replace("_", "-")
        shares = enumerate(_shares(amount, SIZES[campaign]), start=1)
        names.append([f"{campaign}:{number}:{count}" for number, count in shares])
    return [name for row in _round_robin(names) for name in row]


def _shares(amount: int, size: int) -> list[int]:
    return [min(size, amount - start) for start in range(0, amount, size)]


def _round_robin(rows: list[list[str]]) -> Iterator[list[str]]:
    """The rows' items spread evenly over the whole."""
    places = sorted(
        ((index + 0.5) / len(row), number, index) for number, row in enumerate(rows) for index in range(len(row))
    )
    for _, number, index in places:
        yield [rows[number][index]]


def run_piece(name: str, folder: Path | None = None) -> Result:
    """Run one piece in this process. folder: where journals and logs are kept; a temporary one where None."""
    campaign, number, count = name.split(":")
    if campaign == "fuzz":
        from tests.support.controller.wire_fuzz import fuzz  # hypothesis is slow to import

        started = time.monotonic()
        cases = fuzz(int(count), int(number))
        return Result(campaign, f"seed {number}", sum(cases.values()), seconds=time.monotonic() - started)
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        return _run_in(folder, campaign, int(number), int(count))
    with tempfile.TemporaryDirectory(prefix="combtrace-soak-") as temporary:
        return _run_in(Path(temporary), campaign, int(number), int(count))


def _run_in(folder: Path, campaign: str, number: int, count: int) -> Result:
    _log_to(folder / "campaign.log")
    return (_killed if campaign in BLOWS else _faulted)(folder, campaign, number, count)


def faulted_terms(transport: Transport, number: int, jobs: int) -> Terms:
    """The terms of the n-th piece: all of them vary with it, and the seed is n."""
    return Terms(
        seed=number,
        jobs=jobs,
        transport=transport,
        risk=RISKS[number % 3],
        has_clock=number % 10 != 9,
        forgetful=number % 4 == 3,
        word_order="little" if number % 2 == 0 else "big",
        payload_capacity=CAPACITIES[number // 2 % 4],
        slow_program=number % 5 == 2,
    )


def incident_terms(campaign: str, number: int, jobs: int) -> Terms:
    """The terms of the n-th piece of a campaign of incidents: line faults are few, so that it is those that tell."""
    copied, fits = campaign == "copied-journals", campaign in ("spare-controllers", "torn-values")
    return Terms(
        seed=number,
        jobs=jobs,
        transport="rtu-over-tcp" if number % 3 == 0 and not copied else "tcp",
        risk=0.02 if number % 2 == 0 and not copied else 0.0,
        has_clock=number % 5 != 4 or fits,
        word_order="little" if number % 4 in (1, 2) else "big",
        payload_capacity=CAPACITIES[number % 3],
        slow_program=number % 3 == 1,
    )


def killing_terms(campaign: str, number: int, kills: int) -> Killing:
    """The terms of the n-th piece of kills."""
    return Killing(
        seed=number,
        kills=kills,
        victim="controller" if campaign.startswith("controller") else "service",
        word_order="little" if number % 2 == 0 else "big",
        payload_capacity=(1984, 64)[number // 2 % 2],
        forgetful=campaign == "controller-kills" and number % 2 == 1,
        transport={0: "rtu", 3: "rtu-over-tcp"}.get(number % 5, "tcp") if campaign in OVER_ALL_LINES else "tcp",
    )


def _faulted(folder: Path, campaign: str, number: int, jobs: int) -> Result:
    for transport in LINE:
        if transport == campaign:
            terms, cell = faulted_terms(transport, number, jobs), FaultedCell
            break
    else:
        terms, cell = incident_terms(campaign, number, jobs), INCIDENTS[campaign]
    outcome = asyncio.run(cell(folder, terms).run(60 + cell.seconds_a_job * jobs))
    done = outcome.restarts if campaign == "copied-journals" else outcome.outcomes
    return _result(campaign, terms, outcome, sum(done.values()), outcome.restarts)


def _killed(folder: Path, campaign: str, number: int, kills: int) -> Result:
    terms = killing_terms(campaign, number, kills)
    cell = BLOWS[campaign](folder, terms)
    toll = asyncio.run(cell.kill_service() if terms.victim == "service" else cell.kill_controller())
    return _result(campaign, terms, toll, sum(toll.kills.values()), toll.kills)


def _result(
    campaign: str, terms: Terms | Killing, came_to: Outcome | Toll, done: int, instants: Counter[str]
) -> Result:
    return Result(
        campaign=campaign,
        terms=str(terms),
        done=done,
        jobs=sum(came_to.outcomes.values()),
        accepted=came_to.accepted,
        acknowledged=came_to.acknowledged,
        restarts=sum(instants.values()),
        seconds=came_to.seconds,
        outcomes=dict(came_to.outcomes),
        faults=dict(came_to.faults),
        instants=dict(instants),
        findings=dict(came_to.findings.counts),
        texts=came_to.findings.texts,
    )


def _log_to(path: Path) -> None:
    """The service's own log beside the journal, and nothing on the terminal."""
    handler = logging.FileHandler(path)
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(name)s %(message)s"))
    logging.getLogger().handlers[:] = [handler]
    logging.getLogger("combtrace").setLevel(logging.INFO)
    logging.getLogger("pymodbus").setLevel(logging.CRITICAL)
