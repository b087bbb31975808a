"""Shell completion, asked for as a person does: by the shells themselves, at a terminal where they need one."""

from __future__ import annotations

import os
import pty
import re
import select
import shutil
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from service.cli.main import COMMANDS
from tests.support.processes.processes import called

MARK = "@end@"
DONE = "@done@"
PROMPT = "=> "


def need(shell: str) -> None:
    """Skip where the shell is not there, but never where nobody would notice."""
    if shutil.which(shell) is None:
        assert not os.environ.get("CI"), f"{shell} is missing: apt-get install {shell}"
        pytest.skip(f"apt-get install {shell}")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Where the shell stands: a picture, a configuration, and the scripts."""
    for shell in ("bash", "zsh", "fish"):
        done = called("completion", shell)
        assert done.returncode == 0, done.stderr
        (tmp_path / f"combtrace.{shell}").write_text(done.stdout)
    (tmp_path / "block-7.png").write_text("")
    return tmp_path


class Typed:
    """An interactive shell at a pseudo-terminal."""

    def __init__(self, folder: Path, command: list[str], begin: str) -> None:
        self._master, slave = pty.openpty()
        environment = {"PATH": os.environ["PATH"], "HOME": str(folder), "TERM": "dumb", "PS1": PROMPT, "COLUMNS": "400"}
        self._process = subprocess.Popen(
            command, stdin=slave, stdout=slave, stderr=slave, cwd=folder, env=environment, start_new_session=True
        )
        os.close(slave)
        self._seen = ""
        self._do(begin)

    def completed(self, line: str) -> str:
        """The line as the shell completes it, once Tab was pressed."""
        # Ctrl-A and Ctrl-E, to the line's begin and end: it is told and not run.
        told = self._do(f"{line}\t{MARK}\x01echo '\x05'")
        return re.findall(rf"(combtrace .*?){MARK}", told)[-1]

    def _do(self, line: str) -> str:
        """What the terminal shows until the line was run."""
        self._seen = ""
        self._write(f"{line}; echo {DONE[:2]}''{DONE[2:]}\n")
        self._until(lambda: DONE in self._seen)
        return self._seen

    def _write(self, text: str) -> None:
        os.write(self._master, text.encode())

    def _until(self, condition) -> None:
        give_up_at = time.monotonic() + 60
        while not condition():
            assert time.monotonic() < give_up_at, self._seen
            if select.select([self._master], [], [], 0.2)[0]:
                self._seen += os.read(self._master, 65536).decode(errors="replace")

    def close(self) -> None:
        self._process.kill()
        self._process.wait()
        os.close(self._master)


@pytest.fixture
def bash(folder: Path) -> Iterator[Typed]:
    need("bash")
    typed = Typed(folder, ["bash", "--norc", "--noprofile", "-i"], "bind 'set bell-style none'; source combtrace.bash")
    yield typed
    typed.close()


@pytest.fixture
def zsh(folder: Path) -> Iterator[Typed]:
    need("zsh")
    begin = "unsetopt zle_bracketed_paste; bindkey -e; autoload -Uz compinit; compinit -u -D; source combtrace.zsh"
    typed = Typed(folder, ["zsh", "-f", "-i"], begin)
    yield typed
    typed.close()


CASES = [
    ("combtrace tra", "combtrace trace "),
    ("combtrace trace --over", "combtrace trace --overlay"),
    ("combtrace trace --method slid", "combtrace trace --method sliding-matrix "),
    ("combtrace trace --method=slid", "combtrace trace --method=sliding-matrix "),
    ("combtrace trace blo", "combtrace trace block-7.png "),
    ("combtrace trace block-7.png --polar", "combtrace trace block-7.png --polarity"),
    ("combtrace status --wat", "combtrace status --watch "),
    ("combtrace check --config combtrace.ba", "combtrace check --config combtrace.bash "),
    ("combtrace jobs sh", "combtrace jobs show "),
    ("combtrace halt --reason blo", "combtrace halt --reason blo"),
]


@pytest.mark.parametrize("shell", ["bash", "zsh"])
def test_tab_completes_commands_options_values_and_files(shell: str, request: pytest.FixtureRequest) -> None:
    typed = request.getfixturevalue(shell)
    for line, expected in CASES:
        assert typed.completed(line).rstrip(" =") == expected.rstrip(" ="), (shell, line)


def fish(folder: Path, line: str) -> list[str]:
    done = subprocess.run(
        ["fish", "--no-config", "-c", f"source combtrace.fish; complete -C '{line}'"],
        capture_output=True,
        text=True,
        cwd=folder,
        check=True,
        timeout=30,
        env={"PATH": os.environ["PATH"], "HOME": str(folder)},
    )
    return [entry.split("\t")[0] for entry in done.stdout.splitlines()]


def test_fish_offers_commands_options_values_and_files(folder: Path) -> None:
    need("fish")
    assert set(fish(folder, "combtrace ")) == set(COMMANDS)
    for line, expected in CASES[:-1]:
        word = expected.split(" ")[-2] if expected.endswith(" ") else expected.split(" ")[-1]
        assert word in fish(folder, line), line
    assert fish(folder, "combtrace halt --reason blo") == []


def test_every_command_and_option_is_in_each_script(folder: Path) -> None:
    for shell in ("bash", "zsh", "fish"):
        script = (folder / f"combtrace.{shell}").read_text()
        assert all(command in script for command in COMMANDS)
        assert "sliding-matrix" in script


def test_another_shell_is_a_usage_error() -> None:
    done = called("completion", "csh")
    assert (done.returncode, "bash" in done.stderr) == (2, True)
