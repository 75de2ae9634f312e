"""Where caches of libraries lie for a user without a home."""

import os
from pathlib import Path

import pytest

from sling2sim2real.base import home
from sling2sim2real.base.errors import UserError


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The temporary folder that stands in for a home."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.delenv("USER", raising=False)
    return tmp_path / f"sling2sim2real-{os.getuid()}"


def test_a_home_is_kept(folder: Path, monkeypatch) -> None:
    monkeypatch.setenv("HOME", str(folder.parent))
    home.settle()
    assert os.environ["HOME"] == str(folder.parent) and not folder.exists()


@pytest.mark.parametrize("missing", ["", "/proc/nobody"])
def test_who_has_none_gets_a_folder_that_is_theirs_alone(folder, monkeypatch, missing) -> None:
    """Twice the same, so that what is compiled stays; without HOME the system knows no name."""
    monkeypatch.setenv("HOME", missing)
    if not missing:
        monkeypatch.delenv("HOME")
        monkeypatch.setattr("os.path.expanduser", lambda path: path)
    for _ in range(2):
        monkeypatch.setenv("HOME", missing)
        home.settle()
        assert os.environ["HOME"] == str(folder)
    assert folder.stat().st_mode & 0o777 == 0o700
    assert os.environ["USER"] == str(os.getuid())


def test_a_folder_of_another_user_is_not_taken(folder, monkeypatch) -> None:
    monkeypatch.setenv("HOME", "/proc/nobody")
    folder.mkdir()
    monkeypatch.setattr("os.getuid", lambda: int(folder.name.partition("-")[2]))
    other = os.stat_result((0o40700, 0, 0, 2, 4321, 0, 0, 0, 0, 0))
    monkeypatch.setattr("os.lstat", lambda path: other)
    with pytest.raises(UserError, match="set HOME to a folder .* is another user's"):
        home.settle()
