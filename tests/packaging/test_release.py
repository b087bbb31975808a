"""`make release` hands out nothing of a tree that is not fit for it."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from tests.support.processes.processes import ROOT
from tests.support.real_parts import need_program


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A repository with what the script reads, committed."""
    need_program("git", "apt-get install git")
    folder = tmp_path / "tree"
    shutil.copytree(ROOT / "packaging", folder / "packaging")
    (folder / "packaging" / "reproduce.sh").write_text("echo built >&2; exit 9\n")
    (folder / "pyproject.toml").write_text('[project]\nversion = "0.3.0"\n')
    (folder / "CHANGELOG.md").write_text("# Changelog\n\n## 0.3.0 (2027-01-02)\n")
    git(folder, "init", "--quiet")
    commit(folder)
    return folder


def git(folder: Path, *arguments: str) -> None:
    identity = ("-c", "user.name=A", "-c", "user.email=a@example.invalid", "-c", "commit.gpgsign=false")
    subprocess.run(["git", "-C", folder, *identity, *arguments], check=True, capture_output=True)


def commit(folder: Path) -> None:
    git(folder, "add", "--all")
    git(folder, "commit", "--quiet", "--message", "x")


def release(folder: Path) -> subprocess.CompletedProcess[str]:
    command = ["sh", folder / "packaging" / "release.sh", folder.parent / "dist"]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_a_fit_tree_is_built(tree: Path) -> None:
    assert (release(tree).returncode, release(tree).stderr) == (9, "built\n")


def test_changes_another_head_of_the_changelog_and_a_tag_that_is_there_are_refused(tree: Path) -> None:
    (tree / "new").touch()
    assert "the tree has changes" in release(tree).stderr
    commit(tree)
    git(tree, "tag", "v0.3.0")
    assert "tag v0.3.0 is there already" in release(tree).stderr
    git(tree, "tag", "--delete", "v0.3.0")
    (tree / "CHANGELOG.md").write_text("# Changelog\n\n## Unreleased\n\n## 0.3.0 (2027-01-02)\n")
    commit(tree)
    assert "begins with '## Unreleased', expected '## 0.3.0 (YYYY-MM-DD)'" in release(tree).stderr
    (tree / "CHANGELOG.md").write_text("# Changelog\n\n## 0.3.0 (2027-01-02)\n")
    commit(tree)
    (tree.parent / "dist" / "old.deb").touch()
    refused = release(tree)
    assert (refused.returncode, "is not empty" in refused.stderr) == (1, True)
