"""What telemetry remembers over restarts: a small file in the state folder; without it all begins anew."""

from __future__ import annotations

import json
import logging
from dataclasses import asdict, dataclass, field
from pathlib import Path

from service.atomic_file import write_whole

log = logging.getLogger("combtrace.telemetry")

KEPT_FILE = "telemetry.json"


@dataclass
class Kept:
    """births: of the last connection, Sparkplug's bdSeq, 0 to 255. confirmed: number of the last job that a broker has
    taken, None at first. since: of recipes, calibration and version the hash, and when it was first seen, Unix ms.
    """

    births: int = -1
    confirmed: int | None = None
    since: dict[str, tuple[str, int]] = field(default_factory=dict)

    def first_seen(self, what: str, digest: str, now_ms: int) -> int:
        """Since when it is as it is now."""
        if self.since.get(what, ("", 0))[0] != digest:
            self.since[what] = (digest, now_ms)
        return self.since[what][1]


def load_kept(folder: Path) -> Kept:
    """What the file says; nothing where it is not there, or says something else."""
    path = folder / KEPT_FILE
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        since = {str(what): (str(digest), int(at)) for what, (digest, at) in found["since"].items()}
        confirmed = found["confirmed"]
        return Kept(int(found["births"]) % 256, None if confirmed is None else int(confirmed), since)
    except FileNotFoundError:
        return Kept()
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        log.warning("telemetry: %s cannot be read and is begun anew: %s", path, error)
        return Kept()


def save_kept(folder: Path, kept: Kept) -> None:
    """Write it; where the disk refuses, jobs may be told again after a restart."""
    try:
        write_whole(folder / KEPT_FILE, json.dumps(asdict(kept)).encode())
    except OSError as error:
        log.debug("telemetry: %s cannot be written: %s", folder / KEPT_FILE, error)
