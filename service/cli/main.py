"""The command `combtrace`: what there is to do, each command in a file of its own, imported when it runs."""

from __future__ import annotations

import argparse
import importlib
import io
import sys
from collections.abc import Iterable, Sequence

from service.cli.colour import Colour, painted
from service.cli.errors import EXIT_UNUSABLE, UserError
from service.cli.examples import examples_of

MODULES = (  # of this package, in the order of `--help`
    *(
        "daemon.run",
        "pictures.trace",
        "pictures.fit",
        "pictures.judge",
        "daemon.demo",
        "daemon.check",
        "daemon.trigger",
    ),
    *("controller.simulate_controller", "controller.simulate_service"),
    *("pictures.cameras", "pictures.grab", "pictures.focus", "pictures.live"),
    *("calibration.board", "calibration.calibrate", "calibration.align", "calibration.verify", "calibration.repeat"),
    "calibration.accept",
    *("pictures.teach_table", "controller.probe"),
    *("records.jobs", "records.replay", "records.report", "records.remnants"),
    *("daemon.status", "daemon.halt", "daemon.resume", "daemon.confirm", "daemon.reset", "daemon.pin"),
    *("daemon.install_service", "fleet"),
    *("completion", "schema", "reasons", "controller.register_map"),
)
COMMANDS = {module.rpartition(".")[2].replace("_", "-"): f"service.cli.{module}" for module in MODULES}

DESCRIPTION = """\
NAME
    combtrace - the outline of a honeycomb block, from a camera to a cutting machine

DESCRIPTION
    combtrace grabs frames, traces the contour of the honeycomb block that lies
    under the camera, turns pixels into millimetres by a calibration file, and
    writes the polygon to the cutting machine's controller through Modbus
    registers. What it is not sure of it refuses, with a reason.

    A job begins with a trigger: by hand over a serial line, by the controller,
    or by time. It ends accepted, written, refused or failed, and the journal
    says which and why.
"""

EPILOG = """\
FILES
    config.yaml         the configuration; `combtrace schema` prints its JSON schema
    calibration.yaml    pixels to millimetres, named by the configuration
    var/                journal and lock, unless the configuration says otherwise

EXIT STATUS
    0   done; for `run --once`: accepted or written; for `trace`: traced and accepted
    1   failed: something did not work
    2   bad configuration, unusable input, or wrong usage
    3   refused: the block or the picture was not good enough

EXAMPLES
    combtrace demo
        Run the whole way once, with a simulated controller, and draw the result.
    combtrace trace block.png --overlay seen.png
        Trace one picture; no controller and no configuration needed.
    combtrace calibrate --board charuco --squares 11x8 --square-mm 25 --plane flat.png --output calibration.yaml *.png
        Make the calibration file from pictures of a board; `combtrace board` draws one.
    combtrace check --config config.yaml
        Say what is wrong with the configuration and every device it names.
    combtrace run --config config.yaml
        Run the daemon.
    combtrace jobs --since 1d --outcome refused
        Say what was refused since yesterday, and why.
"""


def build_parser(names: Iterable[str] = COMMANDS) -> argparse.ArgumentParser:
    """The parser of these commands; imports nothing heavy."""
    parser = argparse.ArgumentParser(
        prog="combtrace", description=DESCRIPTION, epilog=EPILOG, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--version", action="store_true", help="print the version and end")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", title="COMMANDS")
    parser.set_defaults(parser=parser)  # for the command that tells of all others
    for name in names:
        # A command module: HELP, DESCRIPTION, add_arguments, run.
        module = importlib.import_module(COMMANDS[name])
        command = commands.add_parser(
            name,
            help=module.HELP,
            description=module.DESCRIPTION,
            epilog=examples_of(name),
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        module.add_arguments(command)
        command.add_argument("--debug", action="store_true", help="show a traceback with an error")
        command.set_defaults(handler=module.run)
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command; its exit status."""
    if isinstance(sys.stdout, io.TextIOWrapper):  # a file's name may hold what the terminal's encoding cannot
        sys.stdout.reconfigure(errors="backslashreplace")
    words = sys.argv[1:] if argv is None else argv
    # All commands take a fifth of a second to load; beside one, only completion tells of the others.
    alone = bool(words) and words[0] in COMMANDS and words[0] != "completion"
    parser = build_parser(words[:1] if alone else COMMANDS)
    args = parser.parse_args(words)
    if args.version:
        from service.cli.daemon.run import version

        print(version())
        return 0
    if args.command is None:
        parser.print_help()
        return EXIT_UNUSABLE
    try:
        return int(args.handler(args))
    except UserError as error:
        if args.debug:
            raise
        print(f"{painted(f'combtrace {args.command}:', Colour.BAD, sys.stderr)} {error}", file=sys.stderr)
        return error.exit_status
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:  # the reader of our output has gone; that is no error of ours
        sys.stderr.close()
        return 141


if __name__ == "__main__":
    sys.exit(main())
