"""The soak in pieces, each a campaign with a seed of its own, run as a process: a run can be split and resumed."""

from __future__ import annotations

import asyncio
import logging
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tests.soak.faulted_cell import FaultedCell, Outcome, Terms, Transport
from tests.soak.killed_cell import KilledCell, Killing, Toll

JOBS_A_PIECE = 125
KILLS_A_PIECE = 25
FUZZ_A_PIECE = 25_000
SECONDS_A_JOB = 3.0  # far more than a job takes on a busy machine: what comes to this hangs
CAPACITIES = (1984, 64, 602, 24)
RISKS = (0.03, 0.06, 0.12)


@dataclass(frozen=True)
class Amounts:
    """How much of each campaign; as the issue of the link asks for."""

    tcp_jobs: int = 5000
    rtu_jobs: int = 500
    rtu_over_tcp_jobs: int = 500
    service_kills: int = 500
    controller_kills: int = 100
    fuzz_cases: int = 100_000


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
    for campaign, amount, size in (
        ("tcp", amounts.tcp_jobs, JOBS_A_PIECE),
        ("rtu", amounts.rtu_jobs, JOBS_A_PIECE),
        ("rtu-over-tcp", amounts.rtu_over_tcp_jobs, JOBS_A_PIECE),
        ("service-kills", amounts.service_kills, KILLS_A_PIECE),
        ("controller-kills", amounts.controller_kills, KILLS_A_PIECE),
        ("fuzz", amounts.fuzz_cases, FUZZ_A_PIECE),
    ):
        names.append([f"{campaign}:{number}:{count}" for number, count in enumerate(_shares(amount, size), start=1)])
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
        from tests.drivers.controller.wire_fuzz import fuzz  # hypothesis is slow to import

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
    if campaign in ("tcp", "rtu", "rtu-over-tcp"):
        return _faulted(folder, campaign, number, count)  # type: ignore[arg-type]
    return _killed(folder, campaign, number, count)


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


def killing_terms(campaign: str, number: int, kills: int) -> Killing:
    """The terms of the n-th piece of kills."""
    return Killing(
        seed=number,
        kills=kills,
        victim="service" if campaign == "service-kills" else "controller",
        word_order="little" if number % 2 == 0 else "big",
        payload_capacity=(1984, 64)[number // 2 % 2],
        forgetful=campaign == "controller-kills" and number % 2 == 1,
        transport={0: "rtu", 3: "rtu-over-tcp"}.get(number % 5, "tcp") if campaign == "service-kills" else "tcp",
    )


def _faulted(folder: Path, transport: Transport, number: int, jobs: int) -> Result:
    terms = faulted_terms(transport, number, jobs)
    outcome = asyncio.run(FaultedCell(folder, terms).run(60 + SECONDS_A_JOB * jobs))
    return _result(transport, terms, outcome, sum(outcome.outcomes.values()), outcome.restarts)


def _killed(folder: Path, campaign: str, number: int, kills: int) -> Result:
    terms = killing_terms(campaign, number, kills)
    cell = KilledCell(folder, terms)
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


def total(results: list[dict[str, Any]], key: str) -> Counter[str]:
    """The sum of one of the results' tables."""
    found: Counter[str] = Counter()
    for result in results:
        found.update(result[key])
    return found
