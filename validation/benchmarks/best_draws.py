"""How near a robust policy comes to the best draws that there are, on the maps it was trained on.

    python -m validation.benchmarks.best_draws BAND METHOD   # reads data/, a line for each error

The best draws are found by trying all of a fine grid: slow, and no policy, but the truth.
"""

from __future__ import annotations

import sys

import numpy as np

from pipeline.base.layout import Layout
from pipeline.landing.landing_map import surface_of
from pipeline.landing.response_surface import ResponseSurface
from pipeline.landing.simulator import simulator
from pipeline.landing.stored import Stored
from pipeline.params import load
from pipeline.policy.expected import distance
from pipeline.policy.robust import robust_maps
from pipeline.sling.theta import load_samples, load_theta

NEAR = 0.06  # m: draws whose median landing is further from the target are not looked at


def best_draws(surface: ResponseSurface, targets: np.ndarray, fine: int = 401) -> np.ndarray:
    """Draws (N, 2) [m] of least expected |y_p - g| for targets (N,), of a fine x fine grid."""
    axes = (np.linspace(*ends, fine) for ends in zip(surface.low, surface.high, strict=True))
    draws = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 2)
    launched = surface(draws)
    good = ~(launched.failure > 0).any(1)
    draws, landing, spread = draws[good], launched.landing_y[good], launched.spread[good]
    median, found = np.median(landing, axis=1), []
    for target in targets:
        near = np.abs(median - target) < NEAR
        expected = distance(landing[near] - target, spread[near]).mean(1)
        found.append(draws[near][expected.argmin()])
    return np.array(found)


def expected_error(surface: ResponseSurface, draws: np.ndarray, targets: np.ndarray) -> float:
    """Mean expected |y_p - g| [m] of draws for targets."""
    launched = surface(draws)
    return float(np.nanmean(distance(launched.landing_y - targets[:, None], launched.spread)))


def main() -> None:
    band, method = sys.argv[1:]
    params = load()
    stored = Stored(band, method)
    launcher = simulator(params, band, load_theta(Layout().theta(band, method), band))
    samples = load_samples(Layout().confidence(band, method))
    targets = np.linspace(*params.policy.targets, 64)
    middle = stored.draws(np.mean(params.policy.targets, keepdims=True))[0]
    maps = robust_maps(launcher, samples, middle, params)
    surface = surface_of(maps, params.trials.actuation_error)
    draws = {
        **{kind: stored.draws(targets, kind) for kind in stored.kinds()},
        "best": best_draws(surface, targets),
    }
    for name, drawn in draws.items():
        launched = surface(drawn)
        error = 100 * expected_error(surface, drawn, targets)
        by_theta = 100 * np.nanstd(launched.landing_y, axis=1).mean()
        by_draw = 100 * launched.spread.mean()
        aside = 100 * np.nanmean(np.nanmedian(launched.landing_y, axis=1) - targets)
        print(
            f"{name}: expected |y_p - g| {error:.2f} cm,"
            f" spread by theta {by_theta:.2f} cm, by the draw {by_draw:.2f} cm,"
            f" median landing off the target by {aside:+.2f} cm"
        )


if __name__ == "__main__":
    main()
