"""The yardstick of `sling bench` is an interaction that the simulator carries through."""

import numpy as np
import pytest

from pipeline.params import load
from sling2sim2real.simulator.interaction import interact
from sling2sim2real.simulator.model import ClampedBand
from sling2sim2real.simulator.parameters import Parameters
from tests.project import DEFAULTS
from validation import bench, synthetic

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
    monkeypatch.setitem(bench.BATCHES, "cpu", (2,))
    monkeypatch.setattr(bench.os, "cpu_count", lambda: 1)
    result = bench.bench(PARAMS, law=law)
    (entry,) = result["batches"]
    assert all(np.isfinite(value) and value > 0 for value in entry.values())
    assert entry["rollouts_per_s"] == pytest.approx(2 / entry["rollouts_s"])
    assert str(result["yardstick"]["steps"]["recoil"]) in bench.table(result)
