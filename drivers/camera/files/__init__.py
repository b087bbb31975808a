"""Paths in, frames out: pictures and videos from files, with nothing decoded that is not whole. Used by the service."""
