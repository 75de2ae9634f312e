"""Thousands of damaged recordings, each an episode or one clear line; nothing passes silently.

The episode of a damaged file equals the undamaged one's, or the recording says what it lost. Where
checksums were mended after the damage, or never were, nobody can ask for that; what remains is no
traceback, no hang, no memory over 2 GB.
"""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import version
from pathlib import Path

import pytest

from tests.recording.input.mutations import CHECKED, HANGS, KINDS, MOST, write_small

ROOT = Path(__file__).parents[3]
REPORT = ROOT / "reports/validation/mutations.json"


def campaign(folder: Path, tasks: list[tuple], jobs: int) -> list[dict]:
    """Results of all tasks, a process each: first seed, how many of each kind, the kinds.

    Args:
        jobs: Processes at once.
    """
    for kind in KINDS:
        write_small(folder / f"{kind}.mcap", kind)
    with ThreadPoolExecutor(jobs) as pool:
        return [line for part in pool.map(lambda task: _run(folder, *task), tasks) for line in part]


def _run(folder: Path, first: int, count: int, *kinds: str) -> list[dict]:
    command = [sys.executable, "-m", "tests.recording.input.mutations"]
    done = subprocess.run(
        [*command, *map(str, (folder, first, count, *kinds))],
        cwd=ROOT,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
    )
    found: dict[tuple[str, int], dict] = {}
    for line in map(json.loads, done.stdout.splitlines()):
        found.setdefault((line["kind"], line["seed"]), {}).update(line)
    if done.returncode:  # the last one hung, crashed or raised
        kind, seed = last = next(reversed(found), (kinds[0], first))
        found.setdefault(last, {"seed": seed, "kind": kind})
        found[last].update(outcome="crashed", words=done.stderr[-3000:], s=HANGS, bytes=0)
    return list(found.values())


def failures(results: list[dict]) -> list[dict]:
    """What may not be."""
    return [
        one
        for one in results
        if one["outcome"] in ("crashed", "unclear")
        or (one["outcome"] == "silent" and one["kind"] in CHECKED)
        or one["bytes"] > MOST
    ]


def counts(results: list[dict]) -> dict[str, dict[str, int]]:
    return {
        kind: dict(
            sorted(Counter(one["outcome"] for one in results if one["kind"] == kind).items())
        )
        for kind in KINDS
    }


@pytest.mark.slow
def test_the_first_sixty_mutations_of_each_kind(tmp_path) -> None:
    """Of those of the campaign below."""
    results = campaign(tmp_path, [(0, 60, *KINDS)], 1)
    assert failures(results) == []
    assert len(results) == 60 * len(KINDS)
    # The damage was not all of one sort.
    for kind, found in counts(results).items():
        assert found["refused"] > 3 and found.get("said", 0) + found.get("silent", 0) > 15, kind


@pytest.mark.validation
def test_twenty_thousand_mutations(tmp_path) -> None:
    each, share = 3400, 850
    tasks = [(first, share, kind) for kind in KINDS for first in range(0, each, share)]
    results = campaign(tmp_path, tasks, os.cpu_count())
    failed = failures(results)
    libraries = ("mcap", "mcap-ros2-support", "rosbags", "numpy", "opencv-python-headless")
    report = {
        "command": "python -m pytest -m validation -n 0 tests/recording/input/test_mutations.py",
        "mutations": len(results),
        "seeds": [0, each - 1],
        "outcomes": counts(results),
        "failures": failed,
        "longest_s": round(max(one["s"] for one in results), 3),
        "most_memory_mb": round(max(one["bytes"] for one in results) / 2**20),
        "python": platform.python_version(),
        "versions": {name: version(name) for name in libraries},
    }
    REPORT.write_text(json.dumps(report, indent=2) + "\n")
    assert len(results) == each * len(KINDS) and failed == []
