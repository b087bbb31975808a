"""A pytest plugin for hardware-in-loop tests: the fixture `hil` is a service's hands on a real controller's mailbox.
Needs the extra `combtrace[hil]`.

Load it with `-p service.commissioning.hil`, or name it in `pytest_plugins` of the topmost conftest.py. Without
`--hil-controller` and `--hil-config` the fixture works on a simulated controller; more in
docs/how-to/hardware-in-loop.md.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

try:
    import pytest
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(
        f"hardware in loop: {error.name} is not installed, the fixture `hil` needs it. "
        "Install it: pip install 'combtrace[hil]'",
        name=error.name,
    ) from error

from service.commissioning.hil.bench import Bench, open_bench
from service.commissioning.hil.presence import HilError

__all__ = ["Bench", "HilError", "hil", "hil_moves"]


def pytest_addoption(parser: pytest.Parser) -> None:
    """Which controller, and whether it may be made to move."""
    group = parser.getgroup("combtrace", "combtrace hardware-in-loop")
    group.addoption(
        "--hil-controller",
        metavar="URL",
        help="tcp://HOST:PORT, rtu-over-tcp://HOST:PORT or rtu:///dev/PORT?baudrate=N, with the default layout; "
        "device_id, word_order, payload_capacity and the addresses may follow as ?key=value&...",
    )
    group.addoption("--hil-config", metavar="FILE", type=Path, help="the controller of this config.yaml instead")
    group.addoption("--hil-move", action="store_true", help="whole contours are sent, so the machine may move")


@pytest.fixture(scope="session")
def hil(request: pytest.FixtureRequest) -> Iterator[Bench]:
    """A connected bench, its heartbeat beating; at the end `transfer` is cleared and the service says Halted."""
    options = request.config.option
    with ExitStack() as opened:
        try:
            bench = opened.enter_context(open_bench(options.hil_controller, options.hil_config))
        except HilError as error:
            pytest.exit(f"hardware in loop: {error}", returncode=2)
        yield bench


@pytest.fixture(scope="session")
def hil_moves(request: pytest.FixtureRequest, hil: Bench) -> Bench:
    """The bench, where whole contours may be sent; skips where the machine must not move."""
    if not (request.config.option.hil_move or hil.simulated):
        pytest.skip("the machine may move: run with MOVE=yes (--hil-move) when it is clear")
    return hil
