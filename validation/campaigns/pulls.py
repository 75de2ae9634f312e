"""Which pull tells what a launch gets back: the paper's, one dip, or dips that were searched.

    python -m validation.campaigns.pulls

writes reports/validation/pulls.json. Of each rubber of validation/rubbers.py DEVELOP, whose
recording no method sees, one number of stretch stands for the whole band: two straight halves. The
law `rubber` with its softening free is fitted to the force of a pull, with the priors of the
method and noise of its own in REPEATS recordings; then the energy that a band gives back which was
recorded before, was drawn to one of DRAWS and is let go within FREE seconds is held against the
rubber's. The viscosity is given. There are no pictures.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from pipeline.base import errors
from pipeline.base.machine import cores
from pipeline.episode.planned import planned_pull
from pipeline.identify.posterior.coordinates import PRIORS
from pipeline.identify.posterior.design import PullDesign, PullLimits, searched
from pipeline.identify.posterior.likelihood import Tolerances
from pipeline.params import Params, load
from pipeline.params.lab import Dip
from pipeline.simulator.model import ClampedBand
from rig.physics import world
from rig.physics.rubber import Rubber
from validation.campaigns import runner
from validation.projects import DEFAULTS
from validation.real import fits
from validation.reports import write_report
from validation.rubbers import DEVELOP, rubbers, with_rubbers

REPORT = Path("reports/validation/pulls.json")
ONE_DIP = (Dip(at=1.0, depth=0.10, out_time=1.0, back_time=1.0),)
BY_HAND = (
    Dip(at=0.8, depth=0.10, out_time=1.0, back_time=1.0),
    Dip(at=1.0, depth=0.25, out_time=1.25, back_time=1.25),
)  # the best of nine sets that were tried after the rule was applied: no choice rests on it
RULE = """Searched dips are better than one, if the mean over rubbers of the error is less than nine
tenths of that with one dip (written before the first run)."""
METHOD, USUAL = "least_squares", "band1"  # the band of unknown force that a search for all is of
REPEATS, SPARE = 3, 7.3  # recordings, and s for dips in 15 s from the grasp to the release
DRAWS = 0.30, 0.35, 0.40  # m
PULL_TIME, PAUSE, DRAW = 4.0, 2.0, 0.40
STEP, NOISE = 0.01, 0.03  # s of a history, N of a sample's noise
FREE, LET_GO = 0.018, 300  # s, steps
BOUNDS = {"mooney_share": (-0.3, 0.9), "upturn": (0, 0.3), "softening": (0, 0.6)}
BOUNDS |= {"relaxation": (0, 0.1)}


class Scalar:
    """A band of two straight halves of one stretch."""

    def __init__(self, params: Params, name: str) -> None:
        self.band = ClampedBand.of(params.bands[name], params.setup, params.sling)
        self.period = params.episode.duration / params.episode.samples
        self.params = params

    def pull(self, dips: Sequence[Dip]) -> np.ndarray:
        """How far the hand is from the fork, every STEP from the pull's begin [m]."""
        fine = self.params.episode.model_copy(update={"samples": 100, "duration": 100 * STEP})
        made = planned_pull(
            fine, "scalar", 0.0, (-DRAW, 0.0), pull_time=PULL_TIME, pause=PAUSE, dips=dips
        )
        held = made.time < made.release_time
        way = -made.position[held, 1]
        return way[np.flatnonzero(way > 0)[0] :]

    def force(self, stress: np.ndarray, way: np.ndarray) -> np.ndarray:
        return 2 * self.band.area * stress * way / np.hypot(self.band.half_width, way)

    def before_launch(self, draw: float) -> np.ndarray:
        """Stretches every STEP of a draw for a launch."""
        part = np.clip(np.arange(0, PULL_TIME + PAUSE, STEP) / PULL_TIME, 0, 1)
        return self.band.drawn(draw * part**2 * (3 - 2 * part))

    @staticmethod
    def let_go(top: float) -> np.ndarray:
        """Stretches at LET_GO equal steps of FREE."""
        return 1 + (top - 1) * (1 + np.cos(np.pi * np.linspace(0, 1, LET_GO))) / 2


def true_stress(rubber: Rubber, stretch: np.ndarray) -> np.ndarray:
    """Nominal, along stretches every STEP, over the rubber's scale."""
    memory = rubber.history(stretch, STEP)[1]
    total, slope, _ = rubber.response(stretch, memory)
    return total + rubber.viscosity * slope * np.gradient(stretch, STEP)


def true_energy(rubber: Rubber, scalar: Scalar, draw: float, worst: float) -> float:
    """Given back, over the volume and the rubber's scale."""
    before = scalar.before_launch(draw)
    memory = rubber.history(before, STEP, worst)[1][-1:]
    stretch, step, done = scalar.let_go(before[-1]), FREE / (LET_GO - 1), []
    for now, rate in zip(stretch, np.gradient(stretch, step), strict=True):
        total, slope, rates = rubber.response(np.array([now]), memory)
        done.append(total[0] + rubber.viscosity * slope[0] * rate)
        memory = memory + step * rates
    return -float(np.trapezoid(done, stretch))


def told_energy(values: dict, viscosity: float, scalar: Scalar, draw: float, worst: float) -> float:
    """The same by the law, over the shear modulus."""
    before = scalar.before_launch(draw)
    stretch, step = scalar.let_go(before[-1]), FREE / (LET_GO - 1)
    time = np.append(STEP * np.arange(len(before)), STEP * (len(before) - 1))
    time = np.append(time[:-1], time[-1] + step * np.arange(1, LET_GO))
    whole = np.append(before, stretch[1:])
    stress = fits.history(whole, time, values, worst)[len(before) - 1 :]
    shape = values["mooney_share"], values["upturn"]
    rate = np.gradient(fits.uniaxial(stretch, *shape), step)
    return -float(np.trapezoid(stress + viscosity * rate, stretch))


def fitted(scalar: Scalar, way: np.ndarray, force: np.ndarray) -> tuple[float, dict, float]:
    """Shear modulus [Pa], the law's other values and what is left of a force (n,) [N], rms."""
    stretch, time = scalar.band.drawn(way), scalar.period * np.arange(len(way))
    mean, spread = PRIORS["softening"]

    def values(x: np.ndarray) -> dict[str, float]:
        return dict(zip(BOUNDS, x[1:].tolist(), strict=True))

    def left(x: np.ndarray) -> np.ndarray:
        stress = np.exp(x[0]) * fits.history(stretch, time, values(x))
        gap = (scalar.force(stress, way) - force) / Tolerances().force
        return np.append(gap, (x[3] - mean) / spread)

    low, high = np.array([np.log([1e3, 1e8]), *BOUNDS.values()], float).T
    start, scale = [np.log(1e5), 0.2, 0.05, 0.1, 0.02], [0.1, 0.1, 0.05, 0.1, 0.01]
    done = least_squares(left, start, bounds=(low, high), x_scale=scale)
    rest = Tolerances().force * float(np.sqrt(np.mean(done.fun[:-1] ** 2)))
    return float(np.exp(done.x[0])), values(done.x), rest


def judged(params: Params, name: str, pulls: dict[str, Sequence[Dip]]) -> dict:
    """Errors of a rubber's energy [%] by pull, at DRAWS, means over REPEATS."""
    scalar, hidden = Scalar(params, name), params.rig.bands[name]
    rubber = world.rubber_of(hidden, 1.0)
    way = scalar.pull(())
    peak = scalar.force(true_stress(rubber, scalar.band.drawn(way)), way).max()
    rubber = replace(rubber, scale=hidden.peak_force / peak)
    worst = float(scalar.band.drawn(np.array(DRAW)))
    truth = [rubber.scale * true_energy(rubber, scalar, draw, worst) for draw in DRAWS]
    every, rows = round(scalar.period / STEP), {}
    for pull, dips in pulls.items():
        way = scalar.pull(dips)
        force = scalar.force(rubber.scale * true_stress(rubber, scalar.band.drawn(way)), way)
        errors_of, rests, summary = [], [], {}
        for seed in range(REPEATS):
            noise = np.random.default_rng(seed).normal(0, NOISE, len(way[::every]))
            scale, summary, rest = fitted(scalar, way[::every], force[::every] + noise)
            energies = [
                scale * told_energy(summary, rubber.viscosity, scalar, draw, worst)
                for draw in DRAWS
            ]
            errors_of.append(100 * (np.array(energies) / truth - 1))
            rests.append(rest)
        rows[pull] = {
            "error_percent": np.mean(errors_of, axis=0).round(2).tolist(),
            "mean_abs_error_percent": round(float(np.mean(np.abs(errors_of))), 2),
            "scatter_percent": round(float(np.std(errors_of, axis=0).mean()), 2),
            "left_newton": round(float(np.mean(rests)), 4),
            "softening": round(summary["softening"], 3),
        }
    return rows


def main() -> None:
    args = runner.parser(__doc__, REPORT).parse_args()
    params = with_rubbers(load(DEFAULTS), DEVELOP, 0)
    plan = params.plan
    limits = PullLimits(plan.max_speed, plan.max_acceleration, SPARE)

    def design_of(name: str, force: float) -> PullDesign:
        inputs = (-DRAW, 0.0), (PULL_TIME, PAUSE), force, params.trials.targets
        return PullDesign.of(params, METHOD, name, *inputs, cores())

    chosen = searched(design_of(USUAL, params.setup.max_force / 2), limits)
    pulls = {"paper": (), "one_dip": ONE_DIP, "searched": chosen, "by_hand": BY_HAND}
    every, off = {}, {}
    for name in rubbers(DEVELOP):
        design = design_of(name, params.rig.bands[name].peak_force)
        every[name] = judged(params, name, pulls)
        for pull, row in every[name].items():
            half = 100 * 1.645 * np.sqrt(design.variances(pulls[pull]).mean())
            row["expected_half_width_percent"] = round(float(half), 2)
        off[name] = {pull: row["mean_abs_error_percent"] for pull, row in every[name].items()}
        print(name, off[name])
    mean = {
        pull: round(float(np.mean([rubber[pull] for rubber in off.values()])), 2) for pull in pulls
    }
    content = {
        "kind": "one number of stretch, virtual rubbers",
        "asked": " ".join(RULE.split()),
        "mean_abs_error_percent": mean,
        "searched_dips_are_better": mean["searched"] < 0.9 * mean["one_dip"],
        "dips": {name: [dip.model_dump() for dip in dips] for name, dips in pulls.items()},
        "rubbers": every,
    }
    write_report(args.report, content)
    print(f"{mean}; wrote {args.report}")


if __name__ == "__main__":
    errors.run(main)
