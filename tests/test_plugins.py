"""Pytest loads no plugin of others: a sourced ROS has some, which need what is not here."""

from pathlib import Path

import pytest

from tests.project import python, write_files

FOREIGN = {
    "foreign.py": "import a_module_that_nobody_has",
    "foreign-1.0.dist-info/METADATA": "Metadata-Version: 2.1\nName: foreign\nVersion: 1.0\n",
    "foreign-1.0.dist-info/entry_points.txt": "[pytest11]\nforeign = foreign\n",
}
PASSES = "def test_it():\n    pass\n"


@pytest.fixture
def foreign(tmp_path: Path) -> str:
    """A folder for PYTHONPATH."""
    write_files(tmp_path, FOREIGN)
    return str(tmp_path)


def test_a_foreign_plugin_is_left_alone(foreign: str, tmp_path: Path) -> None:
    """In workers too; our own do load. Without our options it would end the run."""
    (tmp_path / "test_it.py").write_text(PASSES)
    ours = "-m", "pytest", "-c", "pyproject.toml", "-p", "tests.conftest", "-n", "1"
    ours = (*ours, tmp_path / "test_it.py")
    done = python(*ours, PYTHONPATH=foreign)
    assert done.returncode == 0, done.stderr
    assert "1 worker [1 item]" in done.stdout and "1 passed" in done.stdout
    done = python("-m", "pytest", "-o", "addopts=", tmp_path / "test_it.py", PYTHONPATH=foreign)
    assert done.returncode != 0 and "a_module_that_nobody_has" in done.stderr
