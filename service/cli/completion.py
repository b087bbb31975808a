"""`combtrace completion SHELL`: a script by which a shell completes commands, options and their values."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass

from service.cli.errors import EXIT_OK

HELP = "print what makes a shell complete combtrace's words"
DESCRIPTION = """\
Print a script for bash, zsh or fish, made from the commands as they are. It is complete
in itself: nothing is started while you type. After an update print it anew.

  bash   combtrace completion bash > /etc/bash_completion.d/combtrace
         or, for yourself: > ~/.local/share/bash-completion/completions/combtrace
  zsh    combtrace completion zsh > /usr/local/share/zsh/site-functions/_combtrace
  fish   combtrace completion fish > ~/.config/fish/completions/combtrace.fish

Then open a new shell. For one session: `source <(combtrace completion bash)`.

Exit status: 0."""

FILES = ("FILE", "IMAGE", "FOLDER", "DIR", "DEVICE", "PORT")  # the metavars of what lies in the file system


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The shell."""
    parser.add_argument("shell", choices=("bash", "zsh", "fish"))


def run(args: argparse.Namespace) -> int:
    """Print the script."""
    script = {"bash": bash, "zsh": zsh, "fish": fish}[args.shell]
    print(script(commands_of(args.parser)), end="")
    return EXIT_OK


@dataclass(frozen=True)
class Argument:
    """An option or, without names, a positional: what it is for, and what follows it or stands there."""

    names: tuple[str, ...]
    help: str
    choices: tuple[str, ...]
    takes_value: bool
    is_file: bool


@dataclass(frozen=True)
class Command:
    """A command with its options and positionals."""

    name: str
    help: str
    arguments: tuple[Argument, ...]

    @property
    def options(self) -> tuple[Argument, ...]:
        """Those that begin with a hyphen."""
        return tuple(one for one in self.arguments if one.names)

    @property
    def option_names(self) -> str:
        """All of them, for a list of words."""
        return " ".join(name for one in self.options for name in one.names)

    @property
    def choices(self) -> str:
        """The values of positionals that are chosen from."""
        return " ".join(choice for one in self.arguments if not one.names for choice in one.choices)

    @property
    def takes_files(self) -> bool:
        """Whether files are named without an option."""
        return any(one.is_file for one in self.arguments if not one.names)


def commands_of(parser: argparse.ArgumentParser) -> list[Command]:
    """All commands of the parser."""
    (subparsers,) = (one for one in parser._actions if isinstance(one, argparse._SubParsersAction))
    helps = {one.dest: one.help or "" for one in subparsers._choices_actions}
    return [
        Command(name, helps[name], tuple(_argument(action) for action in command._actions))
        for name, command in subparsers.choices.items()
    ]


def _argument(action: argparse.Action) -> Argument:
    return Argument(
        tuple(action.option_strings),
        (action.help or "").replace("%%", "%"),
        tuple(str(choice) for choice in action.choices or ()),
        action.nargs != 0,
        action.metavar in FILES,
    )


# --- bash -------------------------------------------------------------------------------------------------------------

_BASH = """\
# Completion of combtrace for bash, made by `combtrace completion bash`.
_combtrace() {
    local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]} command= words= files= i
    if [[ $word == = ]]; then word=
    elif [[ $before == = ]]; then before=${COMP_WORDS[COMP_CWORD-2]}
    fi
    for ((i = 1; i < COMP_CWORD; i++)); do
        if [[ ${COMP_WORDS[i]} != -* ]]; then command=${COMP_WORDS[i]}; break; fi
    done
    COMPREPLY=()
    case $command:$before in
%s    esac
    case $command in
        '') words=%s ;;
%s    esac
    [[ $word == -* || -z $command ]] || words=${words##*|}
    COMPREPLY=($(compgen -W "${words/|/ }" -- "$word"))
    [[ -z $files || $word == -* ]] || compopt -o default
}
complete -F _combtrace combtrace
"""


def bash(commands: list[Command]) -> str:
    """The script for bash."""
    values, words = "", ""
    for command in commands:
        for option in command.options:
            if option.takes_value:
                places = " | ".join(f"{command.name}:{name}" for name in option.names)
                values += f"        {places}) {_bash_value(option)}return ;;\n"
        files = "files=yes " if command.takes_files else ""
        words += f"        {command.name}) words={_quoted(f'{command.option_names}|{command.choices}')} {files};;\n"
    names = " ".join(command.name for command in commands)
    return _BASH % (values, _quoted(f"{names} --help --version"), words)


def _bash_value(option: Argument) -> str:
    if option.choices:
        return f'COMPREPLY=($(compgen -W {_quoted(" ".join(option.choices))} -- "$word")); '
    return "compopt -o default; " if option.is_file else ""


def _quoted(text: str) -> str:
    """For a shell, whatever it holds; the three quote alike."""
    return "'" + text.replace("'", "'\\''") + "'"


# --- zsh --------------------------------------------------------------------------------------------------------------

_ZSH = """\
#compdef combtrace
# Completion of combtrace for zsh, made by `combtrace completion zsh`.
_combtrace() {
    local -a commands
    if (( CURRENT == 2 )); then
        commands=(
%s        )
        _describe command commands
        return
    fi
    local command=$words[2]
    shift words
    (( CURRENT-- ))
    case $command in
%s    esac
}
if [[ $funcstack[1] == _combtrace ]]; then _combtrace "$@"; else compdef _combtrace combtrace; fi
"""


def zsh(commands: list[Command]) -> str:
    """The script for zsh."""
    names = "".join(f"            {_quoted(f'{one.name}:{one.help}')}\n" for one in commands)
    cases = "".join(f"        {one.name}) _arguments {' '.join(_zsh_arguments(one))} ;;\n" for one in commands)
    return _ZSH % (names, cases)


def _zsh_arguments(command: Command) -> Iterator[str]:
    if command.choices or command.takes_files:
        yield _quoted("*:value:" + (f"({command.choices})" if command.choices else "_files"))
    for option in command.options:
        action = f"({' '.join(option.choices)})" if option.choices else "_files" if option.is_file else " "
        text = "".join(f"\\{one}" if one in "[]:\\" else one for one in option.help)
        value = f":value:{action}" if option.takes_value else ""
        for name in option.names:
            yield _quoted(f"*{name}{'=' if option.takes_value and name.startswith('--') else ''}[{text}]{value}")


# --- fish -------------------------------------------------------------------------------------------------------------


def fish(commands: list[Command]) -> str:
    """The script for fish."""
    return "# Completion of combtrace for fish, made by `combtrace completion fish`.\n" + "".join(
        f"complete -c combtrace {line}\n" for line in _fish_lines(commands)
    )


def _fish_lines(commands: list[Command]) -> Iterator[str]:
    yield "-f"
    for command in commands:
        yield f"-n __fish_use_subcommand -a {command.name} -d {_fish_quoted(command.help)}"
    for command in commands:
        here = f"-n '__fish_seen_subcommand_from {command.name}'"
        if command.takes_files:
            yield f"{here} -F"
        if command.choices:
            yield f"{here} -a {_fish_quoted(command.choices)}"
        for option in command.options:
            names = " ".join(f"-l {one[2:]}" if one.startswith("--") else f"-s {one[1:]}" for one in option.names)
            value = f" -x -a {_fish_quoted(' '.join(option.choices))}" if option.choices else " -r"
            value += " -F" if option.is_file else " -f"
            yield f"{here} {names}{value if option.takes_value else ''} -d {_fish_quoted(option.help)}"


def _fish_quoted(text: str) -> str:
    return "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"
