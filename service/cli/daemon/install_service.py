"""`combtrace install-service`: the files that make a systemd service of the daemon."""

from __future__ import annotations

import argparse
import shlex
import shutil
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from service.cli.errors import EXIT_FAILED, EXIT_OK, UserError

if TYPE_CHECKING:
    from service.config.config import Config

UNIT_PATH = Path("etc/systemd/system/combtrace.service")
RULES_PATH = Path("etc/udev/rules.d/70-combtrace.rules")
SYSCTL_PATH = Path("etc/sysctl.d/70-combtrace.conf")

HELP = "write, or print, a systemd unit, udev rules and kernel settings for the daemon"
DESCRIPTION = """\
Write the unit and the rules for this machine, and say what to do next; with
--print show them only. Nothing is enabled or started.
Exit status: 0 done, 1 cannot be written, 2 bad configuration."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What, where, for whom."""
    parser.add_argument(
        "--print",
        nargs="?",
        const="unit",
        choices=("unit", "udev", "sysctl"),
        help="print instead: the unit, the udev rules, or the kernel's settings for GigE Vision cameras",
    )
    parser.add_argument(
        "--config",
        type=Path,
        default=Path("/etc/combtrace/config.yaml"),
        metavar="FILE",
        help="the daemon's; default /etc/combtrace/config.yaml",
    )
    parser.add_argument("--user", default="combtrace", help="who runs it; default combtrace")
    parser.add_argument(
        "--root", type=Path, default=Path("/"), metavar="FOLDER", help="write below this folder; default /"
    )


def run(args: argparse.Namespace) -> int:
    """Print, or write."""
    from service.commissioning.install_files import SYSCTL, UDEV_RULES, InstallError, unit, written_folders

    if args.print in ("udev", "sysctl"):
        print(UDEV_RULES if args.print == "udev" else SYSCTL, end="")
        return EXIT_OK
    config = _config(args.config)
    try:
        text = unit(_executable(), args.config.absolute(), args.user, config)
    except InstallError as error:
        raise UserError(str(error)) from error
    if args.print == "unit":
        print(text, end="")
        return EXIT_OK
    files = [(UNIT_PATH, text), (RULES_PATH, UDEV_RULES)]
    on_genicam = config is not None and config.camera.kind == "genicam"
    for name, content in [*files, (SYSCTL_PATH, SYSCTL)] if on_genicam else files:
        path = args.root / name
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(content, encoding="utf-8")
        except OSError as error:
            raise UserError(f"{path}: {error.strerror}. Run it with sudo, or with --print", EXIT_FAILED) from error
        print(f"written: {path}")
    folders = [] if config is None else written_folders(config)
    steps = _next_steps(_executable(), args.user, args.config.absolute(), folders)
    print("\n".join(("next, as root:", *(f"  {step}" for step in [*(_GENICAM if on_genicam else ()), *steps]))))
    return EXIT_OK


_GENICAM = ("apt install gir1.2-aravis-0.8 python3-gi", "sysctl --system")


def _next_steps(executable: Path, user: str, config: Path, folders: list[Path]) -> list[str]:
    """What is left to do for a person with root's rights."""
    steps = [f"id {user} || useradd --system --home-dir /var/lib/combtrace --shell /usr/sbin/nologin {user}"]
    steps += [f"install -d -o {user} -g {user} -m 0750 {shlex.quote(str(folder))}" for folder in folders]
    steps += ["systemctl daemon-reload && udevadm control --reload && udevadm trigger"]
    steps += [
        f"runuser -u {user} -- {shlex.quote(str(executable))} check --config {shlex.quote(str(config))}",
        "systemctl enable --now combtrace",
    ]
    return steps


def _config(path: Path) -> Config | None:
    """The configuration, None where there is none yet."""
    from service.config.config_file import ConfigError, load_config

    try:
        path.stat()
    except FileNotFoundError:
        print(f"{path} is not there yet: the unit lets the daemon write to /var/lib/combtrace only", file=sys.stderr)
        return None
    except OSError as error:
        raise UserError(f"{path}: cannot be looked at: {error.strerror}. Run it with sudo") from error
    try:
        return load_config(path)
    except ConfigError as error:
        raise UserError(str(error)) from error


def _executable() -> Path:
    """The command that runs now, as the unit is to name it."""
    beside = Path(sys.executable).parent / "combtrace"
    found = shutil.which("combtrace")
    return beside if beside.exists() or found is None else Path(found)
