"""Where the error of a landing comes from: the law, the identification, the policy or the noise.

One thing at a time is made perfect, by an oracle that may launch on the rig. No method sees what it
finds: the oracle's θ and draws live in this campaign alone.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.stats import qmc

from pipeline.params import Params, load
from rig.oracle.aim import hit, least_sensitive_draw
from rig.oracle.floor import errors_of, trial_numbers
from rig.oracle.world import World
from sling2sim2real.base.files import write_json
from sling2sim2real.identification.objective.box import SearchBox
from sling2sim2real.identification.results.theta import load_theta, parameters_of
from sling2sim2real.launching.surface.simulator import simulator
from sling2sim2real.launching.surface.stored import Stored
from sling2sim2real.settings.identification import STEPS
from sling2sim2real.simulator.parameters import EXTRA
from validation.campaigns.runner import OURS, PAPER
from validation.campaigns.test_orange import copy_of_the_project
from validation.projects import ProjectCopy

pytestmark = pytest.mark.validation

METHODS = PAPER, OURS
FACTOR = 1.5  # times the floor, asked of ours
SHOTS, REACH = 40, 0.05  # launches that the oracle's θ is fitted to; m beyond the trained range
STARTS, STEP, LOST = 48, 2e-3, 0.5  # of the fit: points, of the unit cube, m for a failed launch
AS_IT_IS, THETA_, AIMED, HIT = "as it is", "oracle θ", "exact policy", "oracle policy"


def shots(params: Params, landing_map, seed: int = 1) -> np.ndarray:
    """Draws (SHOTS, 2) spread over those of the box that land in the trained range, by the map."""
    setup, (near, far) = params.setup, params.policy.targets
    low, high = np.array([setup.draw_y, setup.draw_z]).T
    draws = low + qmc.Sobol(2, rng=seed).random(1024) * (high - low)
    landing = landing_map(draws).landing_y
    return draws[(landing > near - REACH) & (landing < far + REACH)][:SHOTS]


def oracle_theta(launcher, box: SearchBox, draws: np.ndarray, landing: np.ndarray, start: dict):
    """θ of a method's box whose launches come nearest to landings (N,), and its misses (N,) [m].

    Friction takes no part in a launch and stays. Least squares from the best of STARTS points and
    from what was identified.
    """
    free = np.array([name != "dynamic_friction" for name in box.names])
    start_unit = box.to_unit(np.array([start[name] for name in box.names]))

    def misses(points: np.ndarray) -> np.ndarray:
        unit = np.tile(start_unit, (len(points), 1))
        unit[:, free] = points
        values = np.repeat(box.to_physical(unit), len(draws), axis=0)
        landed = launcher(np.tile(draws, (len(points), 1)), box.parameters(values))
        good = np.array([reason is None for reason in landed.failure])
        landed = np.where(good, landed.landing_y, np.nan).reshape(len(points), -1)
        return np.where(np.isfinite(landed), landed - landing, LOST)

    def jacobian(point: np.ndarray) -> np.ndarray:
        step = np.where(point + STEP <= 1, STEP, -STEP)
        around = misses(np.vstack([point, point + np.diag(step)]))
        return ((around[1:] - around[0]) / step[:, None]).T

    dimension = int(free.sum())
    points = np.vstack([start_unit[free], qmc.LatinHypercube(dimension, rng=1).random(STARTS)])
    points = np.clip(points, 1e-3, 1 - 1e-3)
    best = points[1 + np.argmin(np.sum(misses(points[1:]) ** 2, axis=1))]
    fits = [
        least_squares(lambda p: misses(p[None])[0], x0, jacobian, bounds=(0, 1), max_nfev=40)
        for x0 in (points[0], best)
    ]
    fit = min(fits, key=lambda candidate: candidate.cost)
    unit = start_unit.copy()
    unit[free] = fit.x
    return dict(zip(box.names, box.to_physical(unit).tolist(), strict=True)), fit.fun


def split(params: Params, run: ProjectCopy, world: World, trials: tuple, method: str) -> dict:
    """What the error of one method on one band is made of.

    Args:
        run: Where θ and policy are; the policy there is then trained anew, by the oracle's θ.
        trials: Draws and landings [m] of the rig without errors, for the oracle's θ.
    """
    root, band, targets = run.folder, world.band, np.array(params.trials.targets)
    numbers = trial_numbers(params)
    path = root / "data/theta" / band / f"{method}.json"
    stored = Stored(band, method, root)
    content = load_theta(path, band)
    values = content["theta"]
    launcher = simulator(params, band, content, root=root)
    draws = {AS_IT_IS: stored.draws(targets)}
    policy_draws = draws[AS_IT_IS]
    land = lambda draw: float(launcher(draw[None]).landing_y[0])  # noqa: E731
    draws[AIMED] = np.array(
        [hit(land, g, draw) for g, draw in zip(targets, policy_draws, strict=True)]
    )
    draws[HIT] = world.hits(targets, policy_draws)

    beside = parameters_of(content).sample()
    box = replace(SearchBox.of_method(params, method), fixed={name: beside[name] for name in EXTRA})
    best, missed = oracle_theta(launcher, box, *trials, values)
    fitted = content | {"theta": best, "confidence": None}
    predicted, aimed = launcher(policy_draws).landing_y, simulator(params, band, fitted, root=root)
    write_json(path, fitted)
    run("python", "-m", "stages.policy", band, method)
    draws[THETA_] = stored.draws(targets)

    variants = {}
    for name, each in draws.items():
        clean = world.exact(each).landing_y
        errors = errors_of(each, world.landings(each, numbers), params)
        bias = clean - targets
        variants[name] = errors | {
            "without_noise_m": float(np.abs(bias).mean()),
            "bias_without_noise_m": bias,
            "bias_without_noise_share": bias / targets,
        }
    landed = variants[AS_IT_IS]["bias_without_noise_m"] + targets
    by_best = aimed(policy_draws).landing_y
    parts = {
        "law": landed - by_best,
        "identification": by_best - predicted,
        "policy": predicted - targets,
    }
    sizes = {name: float(np.abs(part).mean()) for name, part in parts.items()}
    sizes["noise"] = variants[HIT]["mean_error_m"]
    return {
        "identified": values,
        "oracle_theta": best,
        "oracle_theta_fit": {
            "launches": len(missed),
            "rms_m": float(np.sqrt(np.mean(missed**2))),
            "worst_m": float(np.abs(missed).max()),
        },
        "variants": variants,
        "bias_parts_m": parts,
        "sizes_m": sizes,
        "limits": max(sizes, key=sizes.get),
    }


def band_figures(params: Params, run: ProjectCopy, band: str, progress) -> dict:
    """Floor and split of every method on one band."""
    targets = params.trials.targets
    with World(band, run.folder / "params.yaml") as world:
        landing_map = world.landing_map(params.setup, params.floor.map_size)
        starts = [least_sensitive_draw(landing_map, target) for target in targets]
        draws = world.hits(targets, starts)
        floor = errors_of(draws, world.landings(draws, trial_numbers(params)), params)
        tried = shots(params, landing_map)
        landing = world.exact(tried).landing_y
        progress(f"  {band}: floor {100 * floor['mean_error_m']:.2f} cm")
        result = {"floor": floor, "methods": {}}
        for method in METHODS:
            result["methods"][method] = of = split(params, run, world, (tried, landing), method)
            errors = [
                f"{name} {100 * v['mean_error_m']:.2f} ({100 * v['without_noise_m']:.2f})"
                for name, v in of["variants"].items()
            ]
            message = f"{', '.join(errors)}; {of['limits']}"
            progress(f"  {band} {method} [cm] (without noise): {message}")
    return result


def test_what_the_error_of_a_landing_is_made_of(tmp_path, progress, record) -> None:
    run, figures = copy_of_the_project(tmp_path / "project"), {}
    params = load(run.folder / "params.yaml")
    for band in params.run.rig:
        for stage in ("record", "episode", "clamps", "evidence"):
            run("python", "-m", f"stages.{stage}", band)
        for method in METHODS:
            for stage in (*STEPS[params.methods[method].search], "theta", "policy"):
                run("python", "-m", f"stages.{stage}", band, method)
        figures[band] = band_figures(params, run, band, progress)
    met = {}
    for band, content in figures.items():
        ours, most = content["methods"][OURS]["variants"][AS_IT_IS], content["floor"]
        near = ours["mean_error_m"] <= FACTOR * most["mean_error_m"]
        met[band] = bool(near and not ours["failed"])
    record(
        "gap",
        requested="On the virtual rig, with the errors of the floor's own launches (those of the"
        f" trials and more): the mean error of {OURS} is at most {FACTOR:g} times the actuation"
        " floor on each band, and no launch fails. Reported beside it: the error with one thing"
        " at a time made perfect, and what the bias of each target is made of.",
        met=all(met.values()),
        settings={
            "methods": METHODS,
            "targets": params.trials.targets,
            "launches_a_target": trial_numbers(params).shape[1],
            "actuation_error_m": params.trials.actuation_error,
            "release_jitter": params.rig.release_jitter,
            "optimizer": params.optimizer.model_dump(),
            "policy": params.policy.model_dump(),
        },
        figures={"met": met, "bands": figures},
    )
    assert all(met.values()), met
