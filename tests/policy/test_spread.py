"""Landing intervals of a slingshot in closed form, with a stiffness that is not known exactly."""

from __future__ import annotations

import json
from types import SimpleNamespace

import numpy as np
import pytest

from pipeline.errors import UserError
from pipeline.policy.spread import landing_intervals, load_samples
from pipeline.sling.model import THETA
from tests.policy import toy

DRAWS = np.array([[-0.35, -0.2], [-0.3, -0.15]])
STIFFNESS = 0.02  # relative deviation: landing goes with it


def launcher(draws: np.ndarray, thetas: np.ndarray | None = None) -> SimpleNamespace:
    """The toy, whose landing is scaled by the first parameter."""
    launched = toy.launch(draws)
    if thetas is not None:
        launched.landing_y = launched.landing_y * thetas[:, 0]
    return launched


def samples(count: int = 200) -> np.ndarray:
    theta = np.full((count, 5), 0.5)
    theta[:, 0] = 1 + STIFFNESS * np.random.default_rng(1).normal(size=count)
    return theta


@pytest.mark.parametrize(("error", "known"), [(0.001, False), (0.0, True), (0.001, True)])
def test_nine_landings_of_ten_lie_inside(error: float, known: bool) -> None:
    """Of launches whose stiffness and draw vary as they are said to."""
    intervals = landing_intervals(launcher, DRAWS, samples() if known else None, error)
    rng = np.random.default_rng(2)
    for draw, (low, high) in zip(DRAWS, intervals, strict=True):
        landing = toy.launch(draw + rng.normal(0, error, (4000, 2))).landing_y
        landing = landing * (1 + known * STIFFNESS * rng.normal(size=4000))
        assert 0.85 < ((landing > low) & (landing < high)).mean() < 0.94


def test_failures_of_the_few_are_left_out_and_of_the_many_are_none() -> None:
    def fragile(share: float):
        def launch(draws, thetas=None):
            launched = launcher(draws, thetas)
            if thetas is not None:
                broken = np.arange(len(draws)) % 20 < 20 * share
                launched.failure = ["it broke" if one else None for one in broken]
            return launched

        return launch

    assert np.isfinite(landing_intervals(fragile(0.05), DRAWS, samples(), 0.001)).all()
    assert np.isnan(landing_intervals(fragile(0.25), DRAWS, samples(), 0.001)).all()


def test_samples_come_from_the_theta_stages_file(tmp_path) -> None:
    path = tmp_path / "ours.json"
    assert load_samples(path, "toy", "ours") is None
    content = {"names": list(THETA), "samples": samples(3).tolist()}
    path.write_text(json.dumps(content))
    np.testing.assert_array_equal(load_samples(path, "toy", "ours"), samples(3))
    for damaged in ("{", "[]", json.dumps(content | {"names": ["a"]}), '{"names": []}'):
        path.write_text(damaged)
        with pytest.raises(UserError, match="damaged; `dvc repro --force theta@toy-ours`"):
            load_samples(path, "toy", "ours")
