"""Whether a service runs on a configuration, found without taking a lock that it might want."""

from __future__ import annotations

import os
from pathlib import Path

from service.config.config import Config
from service.daemon.lock import name_is_held
from service.wiring.devices import controller_names

LOCKS = Path("/proc/locks")


def running_service(config: Config) -> int | None:
    """The process that runs on this state folder; None where none does."""
    return holder(config.service.state_dir / "combtrace.lock")


def hidden(config: Config) -> bool:
    """True where this user may not look whether a service runs."""
    folder = config.service.state_dir
    return os.path.isdir(folder) and not os.access(folder, os.X_OK)


def holder(path: Path) -> int | None:
    """The process that holds a lock on the file, by the kernel's table; None where none does or the table is not there.

    Columns as in proc_locks(5): the file is the device's numbers in hexadecimal and the inode.
    """
    try:
        status = path.stat()
        table = LOCKS.read_text()
    except OSError:
        return None
    name = f"{os.major(status.st_dev):02x}:{os.minor(status.st_dev):02x}:{status.st_ino}"
    for line in table.splitlines():
        words = line.split()
        if len(words) > 5 and words[1] == "FLOCK" and words[5] == name:
            return int(words[4])
    return None


def other_user_of_controller(config: Config) -> str | None:
    """The name under which another service of this machine holds the controller; None where none does."""
    return next((name for name in controller_names(config) if name_is_held(name)), None)
