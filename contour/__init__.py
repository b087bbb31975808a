"""The numeric core: pictures and points in, frozen dataclasses out. No clock, file, socket, log or configuration."""
