"""A posterior on the simulator itself: one band with known parameters, a few seconds."""

from dataclasses import replace

import numpy as np

from pipeline.confidence import posterior as module
from pipeline.confidence.axes import Axes
from pipeline.confidence.intervals import interval
from pipeline.confidence.posterior import fit
from pipeline.confidence.summary import by_phase
from pipeline.episode.signal import cutoff_hz
from pipeline.objective.space import Space
from pipeline.params import load
from pipeline.sling.model import Sling
from tests.objective.own_law import disturbed, own_law_episode
from tests.project import ROOT, ROUGH
from validation.synthetic import pull_and_release

TRUTH = np.array([2.5e5, 0.47, 4e-3, 0.8, 0.6])


def test_truth_is_found_through_wrong_clocks_and_extrinsics(monkeypatch) -> None:
    """From 2 % off in E and 20 % in damping to 0.1 % and 2 %; the clocks are found as well.

    Coarse edges and steps, and fewer rounds, for the sake of time.
    """
    params = load(ROOT / "params.yaml")
    coarse = params.sling.model_copy(update=ROUGH)
    band = next(iter(params.bands))
    sling = Sling.of(params.bands[band], params.setup, coarse)
    plan = pull_and_release(band, params.episode, sling)
    some = np.arange(len(plan.cloud_time)) % 4 == 0
    some |= plan.cloud_time > plan.release_time - 0.1
    clouds = [cloud for cloud, taken in zip(plan.clouds, some, strict=True) if taken]
    plan = replace(plan, cloud_time=plan.cloud_time[some] + 0.012, clouds=clouds)
    cutoff = cutoff_hz(params.force.cutoff, params.force.cutoff_unit)
    exact = own_law_episode(sling, plan, TRUTH, cutoff=cutoff, seed=1)
    errors = {"release": 3e-4, "camera": 5e-4, "shift": 1e-3, "turn": 1e-3, "bias": 0.01}
    episode = disturbed(exact, np.random.default_rng(2), **errors)

    monkeypatch.setattr(module, "HEAT", (30.0, 3.0))
    monkeypatch.setattr(module, "ROUNDS", 5)
    peak = np.linalg.norm(episode.force, axis=1).max()
    axes = Axes(Space.of(params.parameters), TRUTH, least_friction=peak / sling.grip_force)
    start = TRUTH * [1.02, 1.0, 0.8, 1.0, 1.0]
    posterior = fit(episode, sling, cutoff, axes, start, workers=2)
    product = TRUTH[2] * TRUTH[4]
    assert abs(posterior.mean[0] / TRUTH[0] - 1) < 1e-3
    assert abs(posterior.mean[2] * posterior.mean[4] / product - 1) < 0.02
    low, high = interval(posterior.derived["release_time"])
    assert abs((low + high) / 2 - plan.release_time) < 2e-4
    late = episode.cloud_time[0] - plan.cloud_time[0]
    assert abs(np.median(posterior.derived["camera_delay"]) - late) < 2e-4
    phases = by_phase(posterior.last.groups)
    assert list(phases) == ["slack", "taut", "recoil", "swing"]
    assert phases["taut"]["force_rms"] < 0.05  # noise, not misfit
    assert phases["taut"]["cloud_rms"] < 0.003
