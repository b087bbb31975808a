"""Triggers in, settled jobs out, one at a time. Used by `daemon` and `web`."""
