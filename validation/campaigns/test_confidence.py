"""Are the intervals of θ right? Twenty episodes of a band whose parameters are known.

The rubber is the simulator's own, the motion the yardstick's; noise, clocks and extrinsics are off
as a recorder's are. Each episode is identified with the budget of params.yaml, and its posterior is
asked for the truth.
"""

import os
import time
from dataclasses import replace

import numpy as np
import pytest

from pipeline.confidence.axes import Axes
from pipeline.confidence.discrepancy import discrepancy
from pipeline.confidence.intervals import LEVEL, identifiable, interval
from pipeline.confidence.posterior import fit
from pipeline.confidence.profile import profiles
from pipeline.confidence.summary import SLIP
from pipeline.episode.phases import taut_frames
from pipeline.episode.signal import cutoff_hz
from pipeline.objective.evaluate import Evaluator
from pipeline.objective.loss import EpisodeLoss
from pipeline.objective.space import Space
from pipeline.search.history import History, theta_content
from pipeline.sling.interaction import interact
from pipeline.sling.material import THETA
from pipeline.sling.model import Sling
from tests.objective.own_law import disturbed, own_law_episode
from validation.benchmarks.methods import complete
from validation.synthetic import pull_and_release

pytestmark = pytest.mark.validation

METHOD = "sling2sim2real_taut"
EPISODES = 20
TRUTH = {  # drawn evenly between these, E and s d on a logarithmic scale
    "youngs_modulus": (1.5e5, 6e5),
    "poissons_ratio": (0.45, 0.49),
    "damping_product": (5e-4, 5e-3),
    "dynamic_friction": (0.6, 1.0),
    "damping_scale": (0.3, 1.0),
}
NOISE = {"force_noise": 0.05, "depth_noise": 0.0006}
ERRORS = {"release": 3e-4, "camera": 5e-4, "shift": 1e-3, "turn": 1e-3, "bias": 0.01}
CAMERA = 30.0  # pictures a second
COVERAGE, WIDTH = 0.8, 2.0  # at least, and at most
E_LIMIT, PRODUCT_LIMIT, FORCE_LIMIT = 0.01, 0.1, 0.01


def truth(rng: np.random.Generator) -> np.ndarray:
    """A θ in the order of THETA."""
    drawn = {
        name: np.exp(rng.uniform(*np.log(ends)))
        if name in ("youngs_modulus", "damping_product")
        else rng.uniform(*ends)
        for name, ends in TRUTH.items()
    }
    product = drawn.pop("damping_product")
    drawn["elasticity_damping"] = product / drawn["damping_scale"]
    return np.array([drawn[name] for name in THETA])


def searched(params, episode, sling) -> dict:
    """θ file of the method with the budget of params.yaml."""
    loss = EpisodeLoss.of(params, METHOD, episode, sling)
    evaluate = Evaluator(episode, sling, loss, Space.of_method(params, METHOD))
    found = complete(params, METHOD, params.optimizer, evaluate)
    return theta_content(History(METHOD, THETA, [found.table]), episode.band)


def one(params, number: int) -> dict:
    """Errors and intervals of one episode, relative to the truth where that is no zero."""
    rng = np.random.default_rng([7, number])
    band = next(iter(params.bands))
    sling = Sling.of(params.bands[band], params.setup, params.sling)
    true = truth(rng)
    cutoff = cutoff_hz(params.force.cutoff, params.force.cutoff_unit)
    episode, seen = None, np.zeros(1, bool)
    while not seen.any():  # a picture must show the recoil, or the method refuses the episode
        plan = pull_and_release(band, params.episode, sling)
        plan = replace(plan, cloud_time=plan.cloud_time + rng.uniform(0, 1 / CAMERA))
        exact = own_law_episode(sling, plan, true, cutoff=cutoff, seed=number, **NOISE)
        episode = disturbed(exact, rng, **ERRORS)
        seen = taut_frames(episode)

    start = time.perf_counter()
    content = searched(params, episode, sling)
    found_after = time.perf_counter() - start
    peak = np.linalg.norm(episode.force, axis=1).max()
    axes = Axes.of_method(params, METHOD, content, SLIP * peak / sling.grip_force)
    best, workers = axes.theta, os.cpu_count()
    posterior = fit(episode, sling, cutoff, axes, best, workers=workers)
    curves = profiles(posterior, workers=workers)
    seconds = time.perf_counter() - start - found_after

    # held in full: the force while the band is drawn
    three = interact(sling, plan, np.array([true, best, posterior.mean]))
    held = np.linalg.norm(EpisodeLoss.plain(params, episode, sling).filtered(three), axis=2)
    curve = np.abs(held[1:] - held[0]).mean(axis=1) / held[0].max()
    late = episode.release_time - episode.time
    hold = held[0, (late > 0.05) & (late < 0.5)].mean()
    product = true[2] * true[4]
    names = axes.space.names
    values = dict(zip(names, zip(true, posterior.samples.T, strict=True), strict=True))
    values["damping_product"] = product, posterior.derived["damping_product"]
    values["hold_force"] = hold, posterior.derived["hold_force"]
    # against the truth, or what is rounded in the record would be as wide as the interval
    values["release_time"] = 0.0, posterior.derived["release_time"] - plan.release_time
    late = float(episode.cloud_time[0] - plan.cloud_time[0])
    values["camera_delay"] = late, posterior.derived["camera_delay"]
    quantities = {}
    for name, (value, samples) in values.items():
        low, high = interval(samples)
        quantities[name] = {
            "truth": value,
            "low": low,
            "high": high,
            "error": float(np.median(samples)) - value,
            "identifiable": name not in names or identifiable(name, low, high, axes),
        }
        if name in names:
            quantities[name]["theta_error"] = float(best[names.index(name)] - value)
            quantities[name]["profile"] = [curves[name]["low"], curves[name]["high"]]
    quantities["damping_product"]["theta_error"] = float(best[2] * best[4] - product)
    return {
        "quantities": quantities,
        "discrepancy": discrepancy(episode, sling, cutoff, best),
        "force_curve": {"theta": curve[0], "posterior": curve[1]},
        "moved": posterior.moved,
        "settled": posterior.settled,
        "rollouts": posterior.rounds.rollouts,
        "seconds": {"search": found_after, "posterior": seconds},
    }


def calibration(episodes: list[dict]) -> dict:
    """Of each quantity: coverage, width against error, medians; over the identifiable ones."""
    table = {}
    for name in episodes[0]["quantities"]:
        rows = [one["quantities"][name] for one in episodes]
        good = [row for row in rows if row["identifiable"]]
        entry = {"identifiable": len(good), "episodes": len(rows)}
        if good:
            error = np.abs([row["error"] for row in good])
            width = np.array([row["high"] - row["low"] for row in good])
            inside = [row["low"] <= row["truth"] <= row["high"] for row in good]
            scale = np.abs([row["truth"] for row in good])
            if name in ("release_time", "camera_delay"):
                scale = np.ones(len(good))
            entry |= {
                "coverage": float(np.mean(inside)),
                "width_over_error": float(np.median(width) / np.quantile(error, LEVEL)),
                "median_error": float(np.median(error / scale)),
                "median_width": float(np.median(width / scale)),
            }
            if "theta_error" in good[0]:
                theta = np.abs([row["theta_error"] for row in good])
                entry["median_theta_error"] = float(np.median(theta / scale))
            if "profile" in good[0]:
                profile = np.array([np.ptp(row["profile"]) for row in good])
                entry["profile_over_posterior"] = float(np.median(profile / width))
        table[name] = entry
    return table


def test_intervals_cover_the_truth_and_are_no_wider_than_they_must(
    params, progress, record
) -> None:
    episodes = []
    for number in range(EPISODES):
        episodes.append(one(params, number))
        product = episodes[-1]["quantities"]["damping_product"]
        young = episodes[-1]["quantities"]["youngs_modulus"]
        progress(
            f"  {number}: E {100 * young['error'] / young['truth']:+.3f} %"
            f" (θ* {100 * young['theta_error'] / young['truth']:+.2f} %), s d"
            f" {100 * product['error'] / product['truth']:+.2f} %"
            f" (θ* {100 * product['theta_error'] / product['truth']:+.1f} %),"
            f" moved {episodes[-1]['moved']:.2f}, {sum(episodes[-1]['seconds'].values()):.0f} s"
        )
    table = calibration(episodes)
    for name, entry in table.items():
        progress(f"  {name}: {entry}")
    rows = {name: one for name, one in table.items() if one["identifiable"] >= EPISODES / 2}
    force = {
        who: float(np.median([one["force_curve"][who] for one in episodes]))
        for who in ("theta", "posterior")
    }
    count = sum(one["identifiable"] for one in table.values())
    covered = sum(one["identifiable"] * one.get("coverage", 0) for one in table.values()) / count
    missed = {
        "coverage": [name for name, row in rows.items() if row["coverage"] < COVERAGE],
        "width": [name for name, row in rows.items() if row["width_over_error"] > WIDTH],
    }
    met = {
        "coverage": covered >= COVERAGE,
        "width": float(np.median([row["width_over_error"] for row in rows.values()])) <= WIDTH,
        "posterior": table["youngs_modulus"]["median_error"] <= E_LIMIT
        and table["damping_product"]["median_error"] <= PRODUCT_LIMIT
        and force["posterior"] <= FORCE_LIMIT,
        "theta": table["youngs_modulus"]["median_theta_error"] <= E_LIMIT
        and table["damping_product"]["median_theta_error"] <= PRODUCT_LIMIT
        and force["theta"] <= FORCE_LIMIT,
    }
    record(
        "confidence",
        asked=f"Over {EPISODES} episodes of the simulator's own law with a recorder's noise and"
        f" errors, {100 * LEVEL:g} % intervals of identifiable quantities cover the truth in at"
        f" least {100 * COVERAGE:g} %; their median width is at most {WIDTH:g} times the 90 %"
        " error (which a calibrated interval's is exactly); in the median E is within 1 %, s d"
        " within 10 %, the force curve within 1 % of its peak.",
        met=all(met.values()),
        settings={"truth": TRUTH, "noise": NOISE, "errors": ERRORS, "method": METHOD}
        | {"first_picture": "0 to 1/30 s after the release, again until one shows the recoil"}
        | {"optimizer": params.optimizer.model_dump()},
        figures={
            "met": met,
            "coverage": covered,
            "missed_by_quantity": missed,
            "settled": sum(one["settled"] for one in episodes),
            "quantities": table,
            "median_force_curve_error": force,
            "episodes": episodes,
        },
    )
    assert all(met.values()), met
