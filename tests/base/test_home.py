"""Where caches of libraries lie for a user who has no home, no name, or no room."""

import json
from pathlib import Path
from types import SimpleNamespace

import pytest

from pipeline.base import home
from tests.project import python

NAMES = ("HOME", "XDG_CACHE_HOME", "MPLCONFIGDIR", "DVC_SITE_CACHE_DIR", "USER", "LOGNAME")
# The user's number is nobody's, and the project may not be written.
ASK = f"""
import json, os, pwd, sys
from pathlib import Path
from pipeline.base import home
if "--no-name" in sys.argv:
    def missing(number):
        raise KeyError("getpwuid(): uid not found")
    pwd.getpwuid = missing
if "--no-project" in sys.argv:
    home.PROJECT = Path("/proc/none")
home.settle()
print(json.dumps({{name: os.environ.get(name) for name in {NAMES}}}))
"""


def settled(tmp_path: Path, *how: str, **more: str) -> dict[str, str | None]:
    clean = dict.fromkeys(NAMES, "") | {"TMPDIR": str(tmp_path)}
    code = f"import os\nfor n in {NAMES}:\n    if not os.environ[n]: del os.environ[n]\n{ASK}"
    done = python("-c", code, *how, folder=tmp_path, **(clean | more))
    assert (done.returncode, done.stderr) == (0, "")
    assert not (tmp_path / "~").exists()
    return json.loads(done.stdout)


def test_who_has_a_home_keeps_it(tmp_path: Path) -> None:
    settings = settled(tmp_path, HOME=str(tmp_path), USER="me", DVC_SITE_CACHE_DIR=str(tmp_path))
    assert settings["HOME"] == settings["DVC_SITE_CACHE_DIR"] == str(tmp_path)
    assert settings["USER"] == "me"
    assert settings["XDG_CACHE_HOME"] is settings["MPLCONFIGDIR"] is None


@pytest.mark.parametrize("home", ["", "/proc", "/nonexistent/of/nobody"])
def test_who_has_none_gets_a_folder_of_his_own(tmp_path: Path, home: str) -> None:
    """Not in the project where that may not be written, and never one that is called `~`."""
    if home == "/nonexistent/of/nobody" and Path("/").stat().st_uid == 0:
        home = "/proc/nonexistent"  # root may write to /
    settings = settled(tmp_path, "--no-name", "--no-project", HOME=home)
    (folder,) = tmp_path.glob("sling2sim2real-*")
    assert folder.stat().st_mode & 0o777 == 0o700
    assert settings["USER"] and settings["USER"].isdigit()
    if home:
        assert settings["XDG_CACHE_HOME"] == str(folder)
        assert settings["MPLCONFIGDIR"] == str(folder / "matplotlib")
    else:
        assert settings["HOME"] == str(folder)


def test_a_full_disk_is_no_home_either(tmp_path: Path, monkeypatch) -> None:
    """LLVM aborts where it cannot write a kernel."""
    for name in NAMES:
        monkeypatch.setenv(name, "")
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setattr(home.tempfile, "gettempdir", lambda: str(tmp_path / "other"))
    (tmp_path / "other").mkdir()
    monkeypatch.setattr("shutil.disk_usage", lambda folder: SimpleNamespace(free=home.ROOM))
    home.settle()
    assert Path(home.os.environ["XDG_CACHE_HOME"]).parent == tmp_path / "other"


def test_a_folder_of_that_name_that_others_may_read_is_not_taken(tmp_path: Path) -> None:
    settings = settled(tmp_path, "--no-name", "--no-project")
    Path(settings["HOME"]).chmod(0o777)
    other = settled(tmp_path, "--no-name", "--no-project")
    assert other["HOME"] != settings["HOME"] and Path(other["HOME"]).parent == tmp_path


def test_where_nothing_can_be_written_one_line_says_so(tmp_path: Path) -> None:
    code = """
import sys, tempfile
from pathlib import Path
from pipeline.base import home
home.PROJECT = Path("/proc/none")
def nowhere():
    raise FileNotFoundError(2, "No usable temporary directory found")
tempfile.gettempdir = nowhere
import stages
"""
    done = python("-c", code, folder=tmp_path, HOME="/proc/none", XDG_CACHE_HOME="")
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (1, "", 1)
    assert done.stderr.startswith("error: neither your home") and "TMPDIR" in done.stderr
