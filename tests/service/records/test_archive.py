"""The archive keeps evidence whole or not at all, within its bounds, oldest first, refusals longer."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from service.reasons import Outcome
from service.records.archive import Archive, ArchiveError, ArchiveFull, ArchiveLimits, document_of, files_of
from service.records.journal_recovery import highest_archived

GOOD, BAD = Outcome.ACCEPTED, Outcome.REFUSED
BLOCK = 4096


def opened(path: Path, max_bytes: int = 10**9, min_free_bytes: int = 0) -> Archive:
    archive = Archive(path, ArchiveLimits(max_bytes, min_free_bytes))
    archive.open()
    return archive


def store(archive: Archive, job_id: int, outcome: Outcome = GOOD, size: int = BLOCK) -> None:
    archive.store(job_id, outcome, {"frame.png": bytes(size)}, b"{}")


def kept(archive: Archive) -> list[int]:
    """Jobs whose document is on the disk, whatever the archive counts."""
    return sorted(int(path.name.split("-")[0]) for path in archive.path.rglob("*-*.json"))


def on_disk(archive: Archive) -> int:
    return sum(-(-path.stat().st_size // BLOCK) * BLOCK for path in archive.path.rglob("*") if path.is_file())


def test_the_oldest_go_first_and_the_bound_holds(tmp_path: Path) -> None:
    archive = opened(tmp_path / "archive", max_bytes=10 * BLOCK)
    for job in range(1, 20):
        store(archive, job)
        assert on_disk(archive) == archive.kept_bytes <= 10 * BLOCK
    assert kept(archive) == [15, 16, 17, 18, 19]


def test_refusals_are_kept_longer_but_never_push_all_others_out(tmp_path: Path) -> None:
    archive = opened(tmp_path, max_bytes=20 * BLOCK)
    store(archive, 1, BAD)
    for job in range(2, 30):
        store(archive, job)
    assert kept(archive)[0] == 1
    for job in range(30, 60):
        store(archive, job, BAD)
    assert sum(job < 30 and job != 1 for job in kept(archive)) == 4, "half is theirs, less what an entry takes"
    assert kept(archive)[-1] == 59


@settings(max_examples=30)
@given(st.lists(st.tuples(st.booleans(), st.integers(0, 4 * BLOCK)), max_size=30), st.integers(2, 12))
def test_the_bound_holds_whatever_comes_and_a_reopened_archive_counts_the_same(
    tmp_path_factory: pytest.TempPathFactory, jobs: list[tuple[bool, int]], blocks: int
) -> None:
    archive = opened(tmp_path_factory.mktemp("archive"), max_bytes=blocks * BLOCK)
    for number, (good, size) in enumerate(jobs, start=1):
        try:
            store(archive, number, GOOD if good else BAD, size)
        except ArchiveFull:
            assert -(-size // BLOCK) + 1 > blocks
        assert on_disk(archive) == archive.kept_bytes <= blocks * BLOCK
    again = opened(archive.path, max_bytes=blocks * BLOCK)
    assert (again.kept_bytes, again.jobs) == (archive.kept_bytes, archive.jobs)


def test_what_a_kill_left_unfinished_is_swept_and_what_is_not_ours_stays(tmp_path: Path) -> None:
    archive = opened(tmp_path)
    store(archive, 1)
    folder = archive.folder_of(1)
    (folder / "2-frame.png").write_bytes(b"no document came after it")
    (folder / ".3-frame.png.new").write_bytes(b"half a fr")
    (folder / "notes.txt").write_text("somebody's")
    (folder / "4-frame.png").symlink_to(tmp_path / "elsewhere")
    again = opened(tmp_path)
    assert sorted(path.name for path in folder.iterdir()) == [
        "1-accepted.json",
        "1-frame.png",
        "4-frame.png",
        "notes.txt",
    ]
    assert (again.swept, again.jobs, again.kept_bytes) == (2, 1, 2 * BLOCK)


def test_a_file_is_renamed_into_place_and_the_document_comes_last(tmp_path: Path, monkeypatch) -> None:
    archive = opened(tmp_path)
    order: list[str] = []
    rename = os.replace

    def note(source: Path, target: Path) -> None:
        order.append(Path(target).name)
        assert Path(source).name == f".{Path(target).name}.new"
        rename(source, target)

    monkeypatch.setattr(os, "replace", note)
    archive.store(7, BAD, {"frame.png": b"a", "overlay.jpg": b"b"}, b"{}")
    assert order == ["7-frame.png", "7-overlay.jpg", "7-refused.json"]


def test_free_space_is_kept_at_the_cost_of_the_oldest(tmp_path: Path, monkeypatch) -> None:
    archive = opened(tmp_path, min_free_bytes=100 * BLOCK)
    monkeypatch.setattr(archive, "free_bytes", lambda: 110 * BLOCK - on_disk(archive))
    for job in range(1, 12):
        store(archive, job)
    assert kept(archive) == [7, 8, 9, 10, 11]
    monkeypatch.setattr(archive, "free_bytes", lambda: 104 * BLOCK - on_disk(archive))  # somebody else writes
    archive.make_room()
    assert kept(archive) == [10, 11]


def test_where_nothing_older_is_left_evidence_is_not_kept_and_the_message_says_what_to_do(
    tmp_path: Path, monkeypatch
) -> None:
    archive = opened(tmp_path, min_free_bytes=100)
    monkeypatch.setattr(archive, "free_bytes", lambda: 50)
    with pytest.raises(ArchiveFull, match=r"50 bytes of the disk are free.*min_free_bytes"):
        store(archive, 1)
    assert list(tmp_path.rglob("*-*")) == []


def test_a_write_that_fails_leaves_nothing_and_is_an_error(tmp_path: Path, monkeypatch) -> None:
    archive = opened(tmp_path)
    syncs = iter([None, OSError(28, "No space left on device")])

    def full(_handle: int) -> None:
        if error := next(syncs):
            raise error

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(ArchiveError, match="No space left on device"):
        store(archive, 1)
    assert (list(tmp_path.rglob("*1-*")), archive.kept_bytes) == ([], 0)


def test_a_number_used_again_after_a_lost_journal_replaces_what_was_kept(tmp_path: Path) -> None:
    archive = opened(tmp_path)
    store(archive, 1, BAD, 5 * BLOCK)
    store(archive, 1, GOOD)
    assert [path.name for path in files_of(tmp_path, 1)] == ["1-accepted.json", "1-frame.png"]
    assert archive.kept_bytes == on_disk(archive)


def test_numbers_of_a_lost_journal_are_found_in_the_archive(tmp_path: Path) -> None:
    archive = opened(tmp_path)
    for job in (7, 12_345, 4_000_000_000):
        store(archive, job)
    assert highest_archived(tmp_path) == 4_000_000_000
    assert document_of(tmp_path, 12_345) == tmp_path / "0000012xxx" / "12345-accepted.json"


def test_a_taught_table_is_kept_once_and_goes_with_the_last_job_that_used_it(tmp_path: Path) -> None:
    archive = opened(tmp_path, max_bytes=10 * BLOCK)
    place = archive.store_table("ab" * 16, lambda: b"table")
    assert archive.store_table("ab" * 16, lambda: pytest.fail("made again")) == place
    used_at = 1_000_000.0
    os.utime(tmp_path / place, (used_at, used_at))
    for job in range(1, 10):
        store(archive, job)
        document = archive.document_of(job)
        assert document is not None
        os.utime(document, (used_at + 1800 * job, used_at + 1800 * job))
        assert (tmp_path / place).exists() == (kept(archive)[0] <= 2), "half an hour after job 2 its hour is over"
    assert not (tmp_path / place).exists()
    assert archive.kept_bytes == on_disk(archive)
