"""The command line: reads like a manual page, loads nothing heavy for it, and says what is wrong in one line."""

from __future__ import annotations

import argparse
import io
import re
import shlex
import subprocess
import sys
from contextlib import redirect_stdout
from pathlib import Path

import pytest

from service.cli.examples import EXAMPLES, examples_of
from service.cli.main import COMMANDS, EPILOG, build_parser, main
from tests.support.pictures.combs import write_combs
from tests.support.processes.processes import called, combtrace


def test_help_reads_like_a_manual_page() -> None:
    done = called("--help")
    assert done.returncode == 0
    for heading in ("NAME", "DESCRIPTION", "COMMANDS", "FILES", "EXIT STATUS", "EXAMPLES"):
        assert f"\n{heading}" in f"\n{done.stdout}"
    for command in COMMANDS:
        assert f"\n    {command}" in done.stdout


@pytest.mark.parametrize("command", COMMANDS)
def test_each_command_has_its_own_help(command: str) -> None:
    done = called(command, "--help")
    assert done.returncode == 0
    assert len(done.stdout) > 100


def test_every_command_shows_examples_in_its_help() -> None:
    assert set(EXAMPLES) == set(COMMANDS)
    help_text = called("jobs", "--help").stdout
    assert f"\n{examples_of('jobs')}\n" in help_text


@pytest.mark.parametrize("line", [line for lines in EXAMPLES.values() for line, _ in lines])
def test_every_example_is_a_command_as_the_parser_takes_it(line: str) -> None:
    program, command, *rest = shlex.split(line.partition(" > ")[0])
    assert (program, line in examples_of(command)) == ("combtrace", True)
    assert build_parser().parse_args([command, *rest]).command == command


def test_every_example_of_the_main_help_is_too() -> None:
    lines = re.findall(r"^ +combtrace (.+)$", EPILOG, re.MULTILINE)
    assert len(lines) >= 6
    for line in lines:
        build_parser().parse_args(shlex.split(line))


def loaded(*arguments: str | Path) -> set[str]:
    """The modules that a process of the command has loaded at its end."""
    code = (
        "import sys\nfrom service.cli.main import main\n"
        "try:\n    main(sys.argv[1:])\nexcept SystemExit:\n    pass\n"
        "print(*sys.modules, file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=True)
    return set(done.stderr.split())


@pytest.mark.parametrize("arguments", [["--help"], ["trace", "--help"], ["run", "--help"], ["--version"]])
def test_help_loads_neither_numpy_nor_cv2_nor_pydantic_nor_pymodbus(arguments: list[str]) -> None:
    assert not loaded(*arguments) & {"numpy", "cv2", "pydantic", "pymodbus", "yaml", "serial"}


def test_a_trace_loads_nothing_of_configurations_controllers_and_the_daemon(tmp_path: Path) -> None:
    """They would take longer than the tracing does."""
    modules = loaded("trace", write_combs(tmp_path / "combs") / "0.png")
    assert {"cv2", "contour.tracing.wall_tips"} <= modules
    assert not modules & {"asyncio", "http", "pydantic", "pymodbus", "serial", "socket", "sqlite3", "ssl", "yaml"}
    parts = {tuple(name.split(".")[:2]) for name in modules}
    assert {room for part, *rooms in parts for room in rooms if part == "drivers"} == {"camera"}
    assert {room for part, *rooms in parts for room in rooms if part == "service"} == {
        *("cli", "config", "export", "measuring", "atomic_file", "reasons")
    }
    assert {name for name in modules if name.startswith("service.config.")} == {"service.config.plain_recipe"}


def test_a_parser_of_one_command_says_what_the_parser_of_all_says() -> None:
    every = build_parser()
    for command in COMMANDS:
        alone = build_parser([command])
        assert alone.format_usage() == every.format_usage()
        assert _help(alone, command) == _help(every, command)


def _help(parser: argparse.ArgumentParser, command: str) -> str:
    with redirect_stdout(io.StringIO()) as out, pytest.raises(SystemExit):
        parser.parse_args([command, "--help"])
    return out.getvalue()


def test_without_a_command_help_is_shown_and_the_status_is_2() -> None:
    done = called()
    assert done.returncode == 2
    assert "COMMANDS" in done.stdout


def test_an_unknown_command_is_a_usage_error() -> None:
    done = called("tarce")
    assert done.returncode == 2
    assert "tarce" in done.stderr


def test_an_error_is_one_line_without_a_traceback(tmp_path: Path) -> None:
    done = called("run", "--config", tmp_path / "nowhere.yaml")
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "nowhere.yaml: cannot be read" in done.stderr


def test_debug_shows_the_traceback(tmp_path: Path) -> None:
    done = combtrace("run", "--config", tmp_path / "nowhere.yaml", "--debug")
    assert "Traceback" in done.stderr


@pytest.mark.parametrize("address", ["5020", "127.0.0.1:", "127.0.0.1:99999", ":5020", "127.0.0.1:x"])
def test_a_bad_address_is_a_usage_error(address: str) -> None:
    done = called("simulate-controller", "--tcp", address)
    assert done.returncode == 2
    assert "expected HOST:PORT" in done.stderr


@pytest.mark.parametrize(
    "arguments",
    [
        ["--trigger-every", "-1"],
        ["--scan-ms", "0"],
        ["--scan-ms", "nan"],
        ["--recipe", "70000"],
        ["--device-id", "300"],
        ["--baudrate", "0"],
    ],
)
def test_a_number_that_no_controller_has_is_refused_with_what_is_expected(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["simulate-controller", "--tcp", "127.0.0.1:0", *arguments]) == 2
    assert f"{arguments[0]} {arguments[1]}: expected" in capsys.readouterr().err


def test_an_address_in_use_is_an_error_that_names_it() -> None:
    import socket

    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        done = called("simulate-controller", "--tcp", f"127.0.0.1:{port}")
    assert done.returncode == 2
    assert str(port) in done.stderr
    assert done.stderr.count("\n") == 1


def test_a_missing_serial_port_is_an_error_that_names_it() -> None:
    done = called("trigger", "--port", "/dev/nowhere")
    assert done.returncode == 2
    assert "/dev/nowhere" in done.stderr
    assert done.stderr.count("\n") == 1
