"""Thousands of damaged recordings, each an episode or one clear line; nothing passes silently."""

import os
from importlib.metadata import version

import pytest

from validation.campaigns.mutations import KINDS, MOST, campaign, counts, failures

pytestmark = pytest.mark.validation

LIBRARIES = ("mcap", "mcap-ros2-support", "rosbags", "numpy", "opencv-python-headless")


def test_twenty_thousand_mutations(tmp_path, record) -> None:
    each, share = 3400, 850
    tasks = [(first, share, kind) for kind in KINDS for first in range(0, each, share)]
    results = campaign(tmp_path, tasks, os.cpu_count())
    failed = failures(results)
    met = len(results) == each * len(KINDS) and failed == []
    record(
        "mutations",
        asked="Of every damaged recording comes the undamaged one's episode, or what was lost is"
        f" said, or one clear line; no traceback, no hang, at most {MOST / 2**30:g} GB.",
        met=met,
        settings={"seeds": [0, each - 1], "versions": {name: version(name) for name in LIBRARIES}},
        figures={
            "mutations": len(results),
            "outcomes": counts(results),
            "failures": failed,
            "longest_s": max(one["s"] for one in results),
            "most_memory_mb": round(max(one["bytes"] for one in results) / 2**20),
        },
    )
    assert met
