"""`tools/compare_runs.py` finds every changed number of a run, and only these."""

import json
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest

from tests.project import ROOT

PAGE = "# Report\n\n## Landings\n\n| band | miss |\n|---|---:|\n| band1 | {} |\n\nIn words: 3 cm.\n"


def write_run(root: Path, theta: float = 1.0, landing: float = 2.0, miss: str = "3.5 cm") -> Path:
    """A project folder with one θ file, one table of trials and one page."""
    for folder in ("data/theta/band1", "data/trials/band1", "reports"):
        (root / folder).mkdir(parents=True)
    content = {"theta": {"youngs_modulus": theta}, "made_with": str(root), "seconds": id(root)}
    (root / "data/theta/band1/paper.json").write_text(json.dumps(content))
    trials = pd.DataFrame({"draw": [[-0.3, -0.1]], "landing": [landing], "failure": [None]})
    trials.to_parquet(root / "data/trials/band1/paper.parquet")
    (root / "reports/README.md").write_text(PAGE.format(miss))
    return root


def compare(old: Path, new: Path, *options: str) -> subprocess.CompletedProcess:
    command = [sys.executable, "tools/compare_runs.py", old, new, *options]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True)


def test_equal_runs(tmp_path):
    """How a run was made and how long it took is no difference, nor is a landing that failed."""
    old = write_run(tmp_path / "old", landing=float("nan"))
    new = write_run(tmp_path / "new", landing=float("nan"))
    done = compare(old, new)
    assert done.returncode == 0, done.stdout
    assert "7 values in 3 files, 0 differ, 0 in one run only" in done.stdout


@pytest.mark.parametrize(
    "change, place",
    [
        ({"theta": 1.0 + 2**-52}, "paper.json: theta: youngs_modulus"),
        ({"landing": 2.0000000000000004}, "paper.parquet: landing[0]"),
        ({"miss": "3.6 cm"}, "Landings / band | miss: band1 #1: miss"),
    ],
)
def test_a_changed_number(tmp_path, change, place):
    done = compare(write_run(tmp_path / "old"), write_run(tmp_path / "new", **change))
    assert done.returncode == 1
    assert place in done.stdout and " 1 differ" in done.stdout


def test_what_one_run_alone_has(tmp_path):
    """A file that moved is found by its new path; one that is gone is said."""
    old, new = write_run(tmp_path / "old"), write_run(tmp_path / "new")
    (new / "data/theta/band1/paper.json").rename(new / "data/theta/band1/other.json")
    done = compare(old, new)
    assert done.returncode == 0
    assert "only: data/theta/band1/paper.json (OLD only)" in done.stdout
    assert "only: data/theta/band1/other.json (NEW only)" in done.stdout
    assert " 0 in one run only" in compare(old, new, "--rename", r"paper\.json=other.json").stdout


def test_nothing_to_compare(tmp_path):
    (tmp_path / "old").mkdir()
    assert compare(tmp_path / "old", write_run(tmp_path / "new")).returncode == 2
