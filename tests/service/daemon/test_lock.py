"""One service per state folder, journal and controller on this machine; the kernel lets go when a process ends."""

from __future__ import annotations

import fcntl
import os
import subprocess
import sys
from pathlib import Path

import pytest

from service.config.config import Config
from service.daemon.lock import Lock, LockError, Locks, NameLock, journal_lock, name_is_held, network_names, serial_name
from service.wiring.devices import controller_names


def config(**controller: object) -> Config:
    return Config.model_validate(
        {"camera": {"kind": "files", "path": "in"}, "calibration": {"file": "c"}, "controller": controller}
    )


def test_a_controller_is_locked_once_and_the_holder_is_named() -> None:
    held = NameLock("test/once")
    with pytest.raises(LockError, match=rf"controller test/once: another combtrace \(process {os.getpid()}\)"):
        NameLock("test/once")
    held.release()
    NameLock("test/once").release()


def test_a_killed_process_holds_no_lock() -> None:
    code = (
        "import time; from service.daemon.lock import NameLock; held = NameLock('test/killed');"
        " print('held', flush=True); time.sleep(60)"
    )
    other = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert other.stdout is not None
    assert other.stdout.readline() == "held\n"
    with pytest.raises(LockError, match=rf"process {other.pid}"):
        NameLock("test/killed")
    other.kill()
    other.wait()
    other.stdout.close()
    NameLock("test/killed").release()


@pytest.mark.parametrize("linked", ["folder", "file"])
def test_two_paths_to_one_journal_are_one_journal(tmp_path: Path, linked: str) -> None:
    (tmp_path / "a").mkdir()
    if linked == "folder":
        (tmp_path / "b").symlink_to("a")
    else:  # the lock lies beside the file, so that only its true path leads to one lock
        (tmp_path / "b").mkdir()
        (tmp_path / "b" / "journal.sqlite").symlink_to(tmp_path / "a" / "journal.sqlite")
    held = journal_lock(tmp_path / "a" / "journal.sqlite")
    with pytest.raises(LockError, match=r"runs on this journal, expected one.*its own journal\.path"):
        journal_lock(tmp_path / "b" / "journal.sqlite")
    held.release()


def test_names_of_one_host_are_one_controller() -> None:
    assert set(network_names("localhost", 502, 1)) & set(network_names("127.0.0.1", 502, 1))
    assert network_names("127.0.0.1", 502, 1) != network_names("127.0.0.1", 502, 2)


def test_a_name_that_nobody_knows_now_is_locked_as_it_stands() -> None:
    assert network_names("no-such-host.invalid", 502, 1) == ["no-such-host.invalid:502/1"]


def test_links_to_one_serial_port_are_one_port(tmp_path: Path) -> None:
    (tmp_path / "tty").touch()
    (tmp_path / "by-id").symlink_to("tty")
    assert serial_name(str(tmp_path / "by-id")) == serial_name(str(tmp_path / "tty"))


def test_what_is_locked_follows_from_the_kind() -> None:
    assert controller_names(config(kind="modbus-tcp", host="127.0.0.1", port=502, device_id=3)) == ["127.0.0.1:502/3"]
    rtu_over_tcp = config(kind="modbus-rtu-over-tcp", host="127.0.0.1", port=4001)
    assert controller_names(rtu_over_tcp) == ["127.0.0.1:4001"], "one program on the line, whatever the device id"
    assert controller_names(config(kind="modbus-rtu", port="/dev/null")) == ["/dev/null"]
    assert controller_names(config(kind="none")) == []


def test_to_observe_needs_no_lock_but_that_of_a_serial_port() -> None:
    assert controller_names(config(kind="modbus-tcp", mode="observe")) == []
    assert controller_names(config(kind="modbus-rtu", port="/dev/null", mode="observe")) == ["/dev/null"]


def test_all_locks_are_let_go_at_once_and_once_more_does_no_harm() -> None:
    names = ["test/one", "test/two"]
    held = [NameLock(name) for name in names]  # kept here: what nobody refers to is let go by itself
    locks = Locks(held[:1])
    locks.add(held[1])
    assert [name_is_held(name) for name in names] == [True, True]
    locks.release()
    assert [name_is_held(name) for name in names] == [False, False]
    locks.release()


def test_a_lock_whose_file_was_taken_away_while_one_waited_to_hold_it_is_not_held_twice(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The file is opened, and before it is locked its holder takes it away and lets it go."""
    first = Lock(tmp_path / "lock")
    let_go = iter([lambda: (first.leave_no_file(), first.release())])
    flock = fcntl.flock

    def late(file: int, how: int) -> None:
        next(let_go, lambda: None)()
        flock(file, how)

    monkeypatch.setattr("service.daemon.lock.fcntl.flock", late)
    second = Lock(tmp_path / "lock")
    with pytest.raises(LockError, match="another combtrace"):
        Lock(tmp_path / "lock")
    second.release()
