"""Which versions are at work in a process. It imports nothing of combtrace: it is sent to workers that may lack it."""

from __future__ import annotations


def versions_here() -> dict[str, str]:
    """Versions by program; "none" where it is not installed."""
    from importlib import import_module
    from importlib.metadata import PackageNotFoundError, version

    found = {}
    try:
        found["combtrace"] = version("combtrace")
    except PackageNotFoundError:
        found["combtrace"] = "none"
    for program, module in (("numpy", "numpy"), ("opencv", "cv2")):
        try:
            found[program] = import_module(module).__version__
        except ImportError:
            found[program] = "none"
    return found
