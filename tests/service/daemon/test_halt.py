"""A halt by a person: kept in the state folder, durable before it is answered."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from service.daemon.operations import Halt


@pytest.fixture
def synced(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, list[str]]]:
    """What was made durable: its path, and, of a folder, what was in it then."""
    seen: list[tuple[str, list[str]]] = []
    fsync = os.fsync

    def note(number: int) -> None:
        path = os.readlink(f"/proc/self/fd/{number}")
        seen.append((path, sorted(os.listdir(path)) if os.path.isdir(path) else []))
        fsync(number)

    monkeypatch.setattr(os, "fsync", note)
    return seen


def test_a_halt_and_its_end_are_durable_with_their_folder(tmp_path: Path, synced: list[tuple[str, list[str]]]) -> None:
    halt = Halt(tmp_path)
    halt.set("ann", "cleaning")
    assert synced[-1] == (str(tmp_path), ["halted.json"]), "after it was put there"
    assert "cleaning (ann, " in str(Halt(tmp_path).reason())
    halt.clear()
    assert synced[-1] == (str(tmp_path), [])
    assert Halt(tmp_path).reason() is None
