"""The yardstick of `sling bench` is an interaction that the simulator carries through."""

from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest

from pipeline.params import load
from sling2sim2real.base.native import start, wp
from sling2sim2real.simulator.interaction import interact
from sling2sim2real.simulator.model import ClampedBand
from sling2sim2real.simulator.parameters import Parameters
from tests.project import DEFAULTS
from validation import synthetic
from validation import throughput as bench

PARAMS = load(DEFAULTS)


def test_the_yardstick_is_held_drawn_and_let_go() -> None:
    sling = ClampedBand.of(PARAMS.bands["band1"], PARAMS.setup, PARAMS.sling)
    episode = synthetic.pull_and_release("band1", PARAMS.episode, sling)
    rollouts = interact(sling, episode, Parameters.of(sling.law, [6e5, 0.45, 5e-3, 0.5, 1.0]))
    assert rollouts.failure == [None]
    at = {t: int(np.argmin(np.abs(rollouts.cloud_time - t))) for t in (7.9, 8.5)}
    middle = rollouts.center_line[0, :, sling.middle, 1]
    assert abs(middle[at[7.9]] + synthetic.DRAW) < 1e-3
    assert middle[at[8.5]] > -synthetic.DRAW / 2
    assert rollouts.force[0, rollouts.times < 7.9, 1].max() > 3.0  # N, towards the fork


@pytest.mark.parametrize("law", bench.BOXES)
def test_it_counts_rollouts_and_launches(monkeypatch, law: str) -> None:
    """With kernels that are compiled already."""
    start()
    cache = nullcontext(Path(wp.config.kernel_cache_dir).parent)
    monkeypatch.setattr(bench.tempfile, "TemporaryDirectory", lambda: cache)
    monkeypatch.setitem(bench.BATCHES, "cpu", (2, 4))
    monkeypatch.setattr(bench.os, "cpu_count", lambda: 1)
    result = bench.bench(PARAMS, law=law)
    assert result["law"] == law
    assert [entry["environments"] for entry in result["batches"]] == [2, 4]
    for entry in result["batches"]:
        assert all(np.isfinite(value) and value > 0 for value in entry.values())
        for what in ("rollouts", "rollouts_with_loss"):
            rate = entry["environments"] / entry[f"{what}_s"]
            assert entry[f"{what}_per_s"] == pytest.approx(rate)
    steps = result["yardstick"]["steps"]
    held, sling = synthetic.RELEASE - synthetic.GRASP, PARAMS.sling
    assert held / sling.hold_step < steps["held"] < held / sling.grip_step / 2
    assert result["yardstick"]["newton_iterations"] >= sum(steps.values())
    assert min(result["first_start_s"].values()) > 0
    assert str(steps["recoil"]) in bench.table(result)
