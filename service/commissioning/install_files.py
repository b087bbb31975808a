"""The files that make a service of the daemon: a systemd unit, udev rules and kernel settings, as text.

`python -m service.commissioning.install_files packaging` writes those for the usual places, for who makes packages.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable
from pathlib import Path

from service.config.cameras import FilesCamera, GenicamCamera
from service.config.config import Config
from service.config.plant import Tls

USER = re.compile(r"[a-z_][a-z0-9_-]{0,30}")
PLAIN = re.compile(r"[A-Za-z0-9/._:@+,=-]+")

STATE_DIRECTORY = Path("/var/lib/combtrace")
HOMES = (Path("/home"), Path("/root"), Path("/run/user"))
LEAST_WATCHDOG_S = 60.0  # three waits for a camera, and no less: a part beats once a second at rest

UNIT = """\
# Made by `combtrace install-service`.
[Unit]
Description=combtrace: the outline of a honeycomb block, from a camera to a cutting machine
Wants=network-online.target
After=network-online.target
# It is to run a year alone: never give up starting it.
StartLimitIntervalSec=0

[Service]
Type=notify
NotifyAccess=main
ExecStart={executable} run --config {config}
ExecReload=/bin/kill -HUP $MAINPID
User={user}
Group={user}
# Serial ports and cameras.
SupplementaryGroups=dialout video
Restart=always
RestartSec=5
# A stop takes 15 s at most; the running job gets 8 s of them.
TimeoutStopSec=20
# Fed only by work done in every part; where a call hangs, the process is ended with a traceback and started anew.
WatchdogSec={watchdog_s:.0f}
StateDirectory=combtrace
StateDirectoryMode=0750
UMask=0027

# It may write its state, and nothing else of the machine. ProtectClock is left out: it closes all devices, cameras and
# serial ports too, before systemd 253. Without capabilities and with these system calls no clock can be set anyway.
ProtectSystem=strict
ProtectHome={protect_home}
{read_write}PrivateTmp=yes
NoNewPrivileges=yes
CapabilityBoundingSet=
AmbientCapabilities=
ProtectKernelTunables=yes
ProtectKernelModules=yes
ProtectKernelLogs=yes
ProtectControlGroups=yes
ProtectHostname=yes
ProtectProc=invisible
RestrictAddressFamilies=AF_UNIX AF_INET AF_INET6{netlink}
RestrictNamespaces=yes
RestrictRealtime=yes
RestrictSUIDSGID=yes
LockPersonality=yes
RemoveIPC=yes
SystemCallArchitectures=native
SystemCallFilter=@system-service
SystemCallErrorNumber=EPERM
KeyringMode=private
# The machine's own network is enough for it; name the controller's address here to close all others.
#IPAddressDeny=any
#IPAddressAllow=localhost 192.168.0.10

[Install]
WantedBy=multi-user.target
"""

UDEV_RULES = """\
# Made by `combtrace install-service --print udev`; for /etc/udev/rules.d/70-combtrace.rules

# ModemManager must not try serial adapters: its questions would be bytes on the trigger's or the controller's line.
ACTION!="remove", SUBSYSTEM=="tty", SUBSYSTEMS=="usb", ENV{ID_MM_DEVICE_IGNORE}="1", ENV{ID_MM_PORT_IGNORE}="1"

# For the groups of the unit, whatever the distribution's own rules say.
ACTION!="remove", SUBSYSTEM=="tty", SUBSYSTEMS=="usb", GROUP="dialout", MODE="0660"
ACTION!="remove", SUBSYSTEM=="video4linux", GROUP="video", MODE="0660"

# FTDI adapters keep bytes and line changes back for 16 ms unless told otherwise.
ACTION=="add", SUBSYSTEM=="usb-serial", DRIVER=="ftdi_sio", ATTR{latency_timer}="1"

# A camera that sleeps between two jobs wakes with other exposure and stale frames.
ACTION=="add", SUBSYSTEM=="usb", ENV{DEVTYPE}=="usb_device", ENV{ID_USB_INTERFACES}=="*:0e*", ATTR{power/control}="on"

# USB3 Vision cameras, by the class of their interfaces.
ACTION!="remove", SUBSYSTEM=="usb", ENV{ID_USB_INTERFACES}=="*:ef05*", GROUP="video", MODE="0660"

# A name of your own for one device, by its serial number (udevadm info -a -n /dev/video0):
#SUBSYSTEM=="video4linux", ENV{ID_SERIAL_SHORT}=="0123ABCD", ATTR{index}=="0", SYMLINK+="combtrace-camera"
#SUBSYSTEM=="tty", ENV{ID_SERIAL_SHORT}=="AB0CDEFG", SYMLINK+="combtrace-pedal"
"""

SYSCTL = """\
# Made by `combtrace install-service --print sysctl`; for /etc/sysctl.d/70-combtrace.conf

# Frames of GigE Vision cameras come in bursts of thousands of packets; what a socket cannot hold is lost.
net.core.rmem_max = 33554432
net.core.netdev_max_backlog = 5000
"""


class InstallError(ValueError):
    """No unit can be made: seen, expected, next step."""


def unit(executable: Path, config_path: Path, user: str, config: Config | None) -> str:
    """The unit, as text; raise InstallError. config: for the paths that the daemon uses, and its camera's time-out."""
    if not USER.fullmatch(user):
        raise InstallError(f"user {user!r}: expected a name such as combtrace, of lower-case letters and digits")
    written = [] if config is None else written_folders(config)
    used = [executable, config_path, *written, *(() if config is None else _read(config))]
    timeout_s = 0.0 if config is None else config.camera.timeout_s * config.camera.average
    # Aravis asks the kernel which network cards there are, and for USB devices that come and go.
    netlink = " AF_NETLINK" if config is not None and isinstance(config.camera, GenicamCamera) else ""
    return UNIT.format(
        netlink=netlink,
        executable=_quoted(executable),
        config=_quoted(config_path).replace("$", "$$"),
        user=user,
        watchdog_s=max(LEAST_WATCHDOG_S, 3 * timeout_s),
        protect_home="read-only" if any(home in path.parents for path in used for home in HOMES) else "yes",
        read_write="".join(f"ReadWritePaths={_quoted(path)}\n" for path in written),
    )


def written_folders(config: Config) -> list[Path]:
    """Folders to which the daemon writes, each once, but for those that systemd makes and opens by itself."""
    found = [config.service.state_dir, config.journal.path.parent, config.archive.path]
    if isinstance(config.camera, FilesCamera) and config.camera.move_to is not None:
        found += [config.camera.move_to, config.camera.path]
    if config.adopted_recipes is not None:
        found.append(config.adopted_recipes.parent)
    return [path for path in dict.fromkeys(found) if STATE_DIRECTORY not in (path, *path.parents)]


def _read(config: Config) -> Iterable[Path]:
    """What else it reads."""
    if config.calibration is not None:
        yield config.calibration.file
    if config.table is not None:
        yield config.table.file
    if isinstance(config.camera, FilesCamera):
        yield config.camera.path
    if config.page is not None:
        yield from filter(
            None, (config.page.token_file, config.page.people_file, config.page.certificate, config.page.key)
        )
    if config.telemetry is not None:
        tls = config.telemetry.tls or Tls()
        yield from filter(None, (config.telemetry.password_file, tls.ca_file, tls.cert_file, tls.key_file))
    if config.opcua is not None:
        yield from filter(None, (config.opcua.users_file, config.opcua.certificate, config.opcua.key))
    yield from filter(None, (recipe.gcode.template for recipe in config.recipes))
    yield from (part.file for recipe in config.recipes for part in recipe.asked_parts)


def _quoted(path: Path) -> str:
    """A path as a unit names it: systemd.syntax(7), and % by systemd.unit(5)."""
    text = str(path)
    if PLAIN.fullmatch(text):
        return text
    if not text.isprintable():
        raise InstallError(f"{text!r}: has characters that no unit can name. Move it to another path")
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"').replace("%", "%%") + '"'


def packaged() -> dict[str, str]:
    """The files for the usual places, by name."""
    usual = unit(Path("/opt/combtrace/bin/combtrace"), Path("/etc/combtrace/config.yaml"), "combtrace", None)
    return {
        "systemd/combtrace.service": usual,
        "udev/70-combtrace.rules": UDEV_RULES,
        "sysctl/70-combtrace.conf": SYSCTL,
    }


if __name__ == "__main__":
    for name, content in packaged().items():
        (Path(sys.argv[1]) / name).write_text(content, encoding="utf-8")
