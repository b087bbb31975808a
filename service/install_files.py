"""The files that make a service of the daemon: a systemd unit and udev rules, as text."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from service.config import Config, FilesCamera

STATE_DIRECTORY = Path("/var/lib/combtrace")
HOMES = (Path("/home"), Path("/root"), Path("/run/user"))

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

# It may write its state, and nothing else of the machine.
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
ProtectClock=yes
ProtectHostname=yes
ProtectProc=invisible
RestrictAddressFamilies=AF_UNIX AF_INET AF_INET6
RestrictNamespaces=yes
RestrictRealtime=yes
RestrictSUIDSGID=yes
LockPersonality=yes
RemoveIPC=yes
SystemCallArchitectures=native
SystemCallFilter=@system-service
SystemCallErrorNumber=EPERM
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

# A name of your own for one device, by its serial number (udevadm info -a -n /dev/video0):
#SUBSYSTEM=="video4linux", ENV{ID_SERIAL_SHORT}=="0123ABCD", ATTR{index}=="0", SYMLINK+="combtrace-camera"
#SUBSYSTEM=="tty", ENV{ID_SERIAL_SHORT}=="AB0CDEFG", SYMLINK+="combtrace-pedal"
"""


def unit(executable: Path, config_path: Path, user: str, config: Config | None) -> str:
    """The unit's text. config: for the paths that the daemon writes to, and for its camera's time-out."""
    written = [] if config is None else list(_outside(_written(config)))
    in_homes = any(home in path.parents for path in (executable, config_path, *written) for home in HOMES)
    timeout_s = 0.0 if config is None else config.camera.timeout_s * config.camera.average
    return UNIT.format(
        executable=executable,
        config=config_path,
        user=user,
        watchdog_s=max(60.0, 3 * timeout_s),
        protect_home="no" if in_homes else "yes",
        read_write="".join(f"ReadWritePaths={path}\n" for path in written),
    )


def _written(config: Config) -> Iterable[Path]:
    """Folders to which the daemon writes."""
    yield config.service.state_dir
    yield config.journal.path.parent
    yield config.archive.path
    if isinstance(config.camera, FilesCamera) and config.camera.move_to is not None:
        yield config.camera.move_to
        yield config.camera.path


def _outside(folders: Iterable[Path]) -> Iterable[Path]:
    """Each once, but for those that systemd makes writable anyway."""
    seen: set[Path] = set()
    for folder in folders:
        if folder != STATE_DIRECTORY and STATE_DIRECTORY not in folder.parents and folder not in seen:
            seen.add(folder)
            yield folder
