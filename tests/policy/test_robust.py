"""The second policy on toys whose least sensitive draw is known, and which samples it looks at."""

from types import SimpleNamespace

import numpy as np
import pytest
import torch

from pipeline.base.progress import Progress, parse
from pipeline.landing.landing_map import LandingMap, surface_of
from pipeline.params import load
from pipeline.policy import robust
from pipeline.policy.check import check_expected
from pipeline.policy.robust import refine, representative, robust_maps
from pipeline.policy.train import told as said
from pipeline.policy.train import train
from tests.policy import toy
from tests.project import ROOT, with_
from validation.benchmarks.best_draws import best_draws, expected_error

Z_SAFE = -0.22  # m, the height of draws that θ does not move
SLOWER = {"learning_rate": 1e-4}
THETAS = np.array([[-0.9], [-0.3], [0.3], [0.9]])


def tilted(draws: np.ndarray, thetas: np.ndarray | None = None) -> SimpleNamespace:
    """The toy, with landings that θ moves in proportion to the draw's height over Z_SAFE."""
    launched = toy.launch(draws)
    if thetas is not None:
        launched.landing_y = launched.landing_y + thetas[:, 0] * (draws[:, 1] - Z_SAFE)
    return launched


def maps(thetas: np.ndarray = THETAS) -> list[LandingMap]:
    return LandingMap.simulate_each(
        tilted, thetas, draw_y=toy.DRAW_Y, draw_z=toy.DRAW_Z, size=(17, 13), max_force=1e3
    )


@pytest.fixture(autouse=True)
def short(monkeypatch) -> None:
    monkeypatch.setattr(robust, "STEPS", 300)


@pytest.fixture(scope="module")
def plain(settings):
    """Trained where θ is known."""
    small = SimpleNamespace(**{**vars(settings), "envs": 256, "iterations": 40})
    return train(surface_of(maps(np.zeros((1, 1)))), small).policy


def test_it_finds_the_draws_that_theta_does_not_move(plain, settings) -> None:
    """The plain policy, which does not know of θ, draws elsewhere."""
    targets = np.linspace(1.6, 2.3, 15)
    found = refine(plain, surface_of(maps()), settings)
    draws = found.policy.draws(targets)
    assert np.abs(plain.draws(targets)[:, 1] - Z_SAFE).mean() > 0.06
    assert np.abs(draws[:, 1] - Z_SAFE).mean() < 0.02
    assert np.abs(toy.launch(draws).landing_y - targets).mean() < 0.005
    assert found.mean_error < 0.4 * found.curve["mean_error"][0]


def test_it_comes_near_the_best_draws_under_an_error_of_the_draw(plain, settings) -> None:
    """Best of all draws of a fine grid; the error alone makes some draws better than others."""
    surface, targets = surface_of(maps(np.zeros((1, 1))), 0.004), np.linspace(1.6, 2.3, 15)
    found = refine(plain, surface, settings).policy
    drawn = (best_draws(surface, targets), plain.draws(targets), found.draws(targets))
    best, before, after = (expected_error(surface, draws, targets) for draws in drawn)
    assert best - 1e-3 < after < before  # the grid is a millimetre wide
    assert after - best < 0.3 * (before - best)


def test_it_keeps_off_draws_that_fail(plain, settings) -> None:
    """The way to the safe height, here above the plain draws, leads over the force limit."""

    def rising(draws: np.ndarray, thetas: np.ndarray) -> SimpleNamespace:
        launched = toy.launch(draws)
        launched.landing_y = launched.landing_y + thetas[:, 0] * (draws[:, 1] + 0.10)
        return launched

    force = toy.launch(plain.draws(np.linspace(*settings.targets, 256))).hold_force.max()
    box = {"draw_y": toy.DRAW_Y, "draw_z": toy.DRAW_Z, "size": (17, 13), "max_force": force + 0.1}
    free, limited = (
        refine(plain, surface_of(LandingMap.simulate_each(rising, THETAS, **one)), settings)
        for one in ({**box, "max_force": 1e3}, box)
    )
    targets = np.linspace(*settings.targets, 256)
    assert toy.launch(free.policy.draws(targets)).hold_force.max() > force + 0.2
    assert toy.launch(limited.policy.draws(targets)).hold_force.max() <= force + 0.11
    assert limited.curve["failed_targets"][limited.iteration] == 0
    assert limited.mean_error < 0.8 * limited.curve["mean_error"][0]


def test_the_refinement_is_the_same_every_time(plain, settings, monkeypatch) -> None:
    monkeypatch.setattr(robust, "STEPS", 40)
    once, again = (refine(plain, surface_of(maps()), settings) for _ in range(2))
    slower = refine(plain, surface_of(maps()), SimpleNamespace(**{**vars(settings), **SLOWER}))
    assert once.curve == again.curve != slower.curve
    pairs = zip(once.policy.parameters(), again.policy.parameters(), strict=True)
    assert all(torch.equal(a, b) for a, b in pairs)


def test_few_samples_stand_for_many() -> None:
    """Ordered by landing they have the median and the spread of all, which random ones have not."""
    many = np.random.default_rng(1).normal(0, 0.5, (200, 1))
    draw = np.array([-0.35, -0.25])
    chosen = representative(tilted, many, draw, 10)
    assert chosen.shape == (10, 1)
    assert np.median(chosen) == pytest.approx(np.median(many), abs=0.02)
    assert chosen.std() == pytest.approx(many.std(), rel=0.1)
    assert representative(tilted, many[:5], draw, 10).shape == (5, 1)

    def broken(draws, thetas):
        launched = tilted(draws, thetas)
        launched.failure = ["it broke" if theta > 0 else None for theta in thetas[:, 0]]
        return launched

    fails = (representative(broken, many, draw, 10) > 0).mean()
    assert fails == pytest.approx((many > 0).mean(), abs=0.1)


def params_with(samples: int = 4, map_size=(9, 7), error: float = 0.002):
    params = with_(load(ROOT / "params.yaml"), "trials", actuation_error=error)
    return with_(params, "policy.robust", samples=samples, map_size=map_size)


def test_samples_and_map_size_say_what_is_launched() -> None:
    draw, many = np.array([-0.35, -0.25]), np.linspace(-1, 1, 50)[:, None]
    some = robust_maps(tilted, many, draw, params_with())
    more = robust_maps(tilted, many, draw, params_with(samples=6, map_size=(11, 7)))
    assert (len(some), some[0].landing_y.shape) == (4, (9, 7))
    assert (len(more), more[0].landing_y.shape) == (6, (11, 7))


class Fixed:
    """A policy that always draws alike."""

    def __init__(self, draw: tuple[float, float]):
        self.draw = draw

    def draws(self, targets: np.ndarray) -> np.ndarray:
        return np.tile(self.draw, (len(targets), 1))


def test_the_expected_error_is_that_of_launches_with_both_errors() -> None:
    """A draw in the safe height feels the error of the draw alone, another one θ too."""
    params = params_with(error=1e-9)
    targets = np.linspace(*params.policy.targets, 256)
    safe, other = (-0.33, Z_SAFE), (-0.33, Z_SAFE - 0.1)
    for draw in (safe, other):
        found = check_expected(Fixed(draw), tilted, THETAS, params)
        landing = tilted(np.tile(draw, (4, 1)), THETAS).landing_y
        truth = np.abs(landing - targets[:, None]).mean()
        assert found.mean_error == pytest.approx(truth, rel=0.01)
    shaken = check_expected(Fixed(safe), tilted, THETAS, params_with(error=0.02))
    assert shaken.max_error > check_expected(Fixed(safe), tilted, THETAS, params).max_error + 0.1


def test_each_step_is_told(plain, settings, tmp_path) -> None:
    told = Progress("x", robust.STEPS, "steps", tmp_path / "log")
    found = refine(plain, surface_of(maps()), settings, told)
    steps = [parse(f"x {line}") for line in (tmp_path / "log").read_text().splitlines()[1:]]
    assert [step.done for step in steps] == list(range(1, robust.STEPS + 1))
    assert [step.facts[0] for step in steps] == list(map(said, found.curve["mean_error"]))
