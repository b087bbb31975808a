"""What a configuration cannot be made into."""

from __future__ import annotations


class WiringError(Exception):
    """The configuration names what cannot be had: seen, expected, next step."""
