"""A policy for a band in PhysX: trained on landings there, and launched there.

    python -m validation.engines.physx.policy band1 [--landings CSV]

The last part of the paper's method in the paper's engine: theta is what search.py has found in
PhysX (reports/validation/physx-<band>.json). As in stages/policy.py, a landing map over the box of
draws is simulated, PPO is trained on it, and its draws are launched; but by PhysX, at the paper's
200 steps a second and 64 iterations. Then they are launched in our simulator with the same theta
and, of a band of the rig, on the rig with the errors of its trials. Measured launches are launched
in PhysX too.

Writes reports/validation/physx-policy-<band>.json after each step. What PhysX launched stands in
.checkpoints/physx-policy, so that a command that was killed goes on. Needs a GPU, but for the
rig, which `--rig` launches on any machine by the draws of the report.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from pipeline.base import errors
from pipeline.base.errors import UserError
from pipeline.base.files import replacing, write_json
from pipeline.base.machine import cores, devices
from pipeline.identify.results.mounting import load_sling
from pipeline.launching.surface.landing_map import LandingMap, validation
from pipeline.params import Params, load
from pipeline.simulator.launch import Launches, launch
from pipeline.simulator.model import ClampedBand, LaunchSetup
from pipeline.simulator.parameters import THETA, Parameters
from validation import orange
from validation.campaigns.runner import read
from validation.engines.physx import study
from validation.engines.physx.bands import Engine, release
from validation.engines.physx.exported import yielded
from validation.engines.physx.launches import alike, launch_in_physx
from validation.engines.physx.rollouts import ITERATIONS, RATE
from validation.reports import plain, write_report
from validation.simulator.finding import Bench

FOUND = "reports/validation/physx-{}.json"
REPORT = "reports/validation/physx-policy-{}.json"
CHECKPOINTS = Path(".checkpoints/physx-policy")
DEVICE = "cuda:0"  # PhysX's
BATCH = 256  # bands at once
ASK = f"{study.ASKED:g} rollouts/s of {study.ENVIRONMENTS[1]} bands; the policy's targets all land."


@dataclass(frozen=True)
class Launched:
    """N launches in PhysX: landing [m] and force held [N], shape (N,); None, or why they fail."""

    landing_y: np.ndarray
    hold_force: np.ndarray
    failure: list[str | None]


class PhysxLauncher:
    """Launches draws (N, 2) [m] in PhysX by one theta (5,), BATCH at once; knows earlier ones.

    The arm gives way as far as in our simulator with that theta.

    Attributes:
        count, seconds: Launches that were not known, and what they took.
    """

    def __init__(self, engine: Engine, sling: ClampedBand, params: Params, theta: np.ndarray):
        self.engine, self.sling, self.theta = engine, sling, theta
        self.rigid = alike(params)
        self.setup = LaunchSetup.of(params.setup, params.sling)
        self.count, self.seconds = 0, 0.0

    def __call__(self, draws: np.ndarray) -> Launched:
        draws = np.atleast_2d(np.asarray(draws, float))
        batches = [self._batch(some) for some in np.split(draws, range(BATCH, len(draws), BATCH))]
        return Launched(
            np.concatenate([done.landing_y for done in batches]),
            np.concatenate([done.hold_force for done in batches]),
            [reason for done in batches for reason in done.failure],
        )

    def ours(self, draws: np.ndarray) -> Launches:
        """The same in our simulator."""
        parameters = Parameters.of(self.sling.law, self.theta)
        return launch(self.sling, self.setup, parameters, draws, workers=cores())

    def _batch(self, draws: np.ndarray) -> Launched:
        settings = repr((RATE, ITERATIONS, self.sling.mass, self.sling.radius, self.setup))
        where = [np.asarray(part, float).tobytes() for part in (self.theta, draws)]
        name = hashlib.sha256(b"".join([*where, settings.encode()]))
        path = CHECKPOINTS / f"{name.hexdigest()[:16]}.json"
        if not path.exists():
            began = time.monotonic()
            content = json.dumps(self._simulated(draws))
            self.count, self.seconds = (
                self.count + len(draws), self.seconds + time.monotonic() - began,
            )  # fmt: skip
            with replacing(path) as temporary:
                temporary.write_text(content, "utf-8")
            print(f"{self.count} launches in PhysX, {self.seconds:.0f} s", flush=True)
        stored = json.loads(path.read_text("utf-8"))
        return Launched(
            *(np.array(stored[name]) for name in ("landing", "force")), stored["failure"]
        )

    def _simulated(self, draws: np.ndarray) -> dict:
        force = self.ours(draws).hold_force
        places = yielded(draws, np.nan_to_num(force), self.setup.arm_stiffness)
        thetas = np.tile(self.theta, (len(draws), 1))
        done = launch_in_physx(self.engine, self.sling, self.rigid, thetas, places).launches
        values = {"landing": done.landing_y.tolist(), "force": done.hold_force.tolist()}
        return values | {"failure": list(done.failure)}


def found(band: str) -> np.ndarray:
    """The theta (5,) that a search in PhysX has found. Raises UserError where there was none."""
    path = Path(FOUND.format(band))
    try:
        theta = json.loads(path.read_text("utf-8"))["physx"]["theta"]
    except (OSError, KeyError, ValueError) as error:
        command = f"python -m validation.engines.physx.search {band}"
        raise UserError(f"{path}: has no theta of PhysX; {command} finds one") from error
    return np.array([theta[name] for name in THETA])


def trained_policy(launcher: PhysxLauncher, params: Params, content: dict):
    """A policy by a landing map of the launcher's; what both came to is set in `content`."""
    settings = params.policy
    landing_map = LandingMap.simulate(
        launcher,
        draw_y=params.setup.draw_y,
        draw_z=params.setup.draw_z,
        size=settings.map_size,
        max_force=params.setup.max_force,
        seed=settings.seed,
    )
    content["landing_map"] = {
        "size": list(settings.map_size),
        "failed": int(np.isnan(landing_map.landing_y).sum()),
        "error": validation(landing_map, settings.targets),
    }
    from pipeline.policy.check import check, figures, verdict  # PyTorch and rsl_rl
    from pipeline.policy.train import train

    trained = train(landing_map.surface, settings)
    checked = check(trained.policy, launcher, params)
    content["training"] = figures(trained, checked)
    content["failures"] = checked.failures
    print(verdict(content["training"], checked.failures), flush=True)
    return trained.policy


def at_targets(policy, launcher: PhysxLauncher, params: Params) -> list[dict]:
    """Where the policy's draws for the trials' targets land, in each simulator."""
    targets = np.array(params.trials.targets)
    draws = policy.draws(targets)
    there, ours = launcher(draws), launcher.ours(draws)
    return [
        {
            "target_m": target,
            "draw_m": draw,
            "in_physx_m": landing,
            "in_physx_n": force,
            "in_ours_m": other,
        }
        for target, draw, landing, force, other in zip(
            targets, draws, there.landing_y, there.hold_force, ours.landing_y, strict=True
        )
    ]


def launched_on_rig(content: dict, params: Params) -> None:
    """Launch the draws of `content` on the rig, with the errors of its trials."""
    from rig.physics.launch import launch as launch_on_rig  # not on every machine with a GPU

    count = params.trials.repeats
    for i, row in enumerate(content["targets"]):
        row["on_rig_m"] = [
            launch_on_rig(content["band"], params, row["draw_m"], number).landing_y
            for number in range(i * count, (i + 1) * count)
        ]
    content["errors"]["on_rig_m"] = mean_error(content["targets"], "on_rig_m", "target_m")


def mean_error(rows: list[dict], name: str, wanted: str) -> dict:
    """Mean |landing - wanted| [m] of the rows' launches that land, and how many do not."""
    values = np.array([np.ravel(row[name]) for row in rows], float)
    off = np.abs(values - np.array([[row[wanted]] for row in rows]))
    landed = np.isfinite(off)
    mean = float(off[landed].mean()) if landed.any() else None
    return {"mean_error_m": mean, "launches": off.size, "failed": int((~landed).sum())}


def main() -> None:
    """Map, train, launch, write. Raises UserError."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("band")
    parser.add_argument("--params", default="params.yaml")
    parser.add_argument("--landings", help="CSV of measured launches of this band")
    parser.add_argument("--rig", action="store_true", help="launch the report's draws there alone")
    requested = parser.parse_args()
    params, band = load(requested.params), requested.band
    if band == orange.NAME:
        params = orange.with_orange(params)
    if band not in params.bands:
        raise UserError(f"no band {band} in {requested.params}")
    path = Path(REPORT.format(band))
    if requested.rig:
        content = read(path)
        launched_on_rig(content, params)
        write_json(path, plain(content))
        return
    theta, options = found(band), {"versions": {"ovphysx": release()}, "device": DEVICE}
    arguments = band + (" --landings CSV" if requested.landings else "")
    content = {
        "asked": ASK,
        "met": False,
        "band": band,
        "theta": dict(zip(THETA, theta, strict=True)),
        "settings": {"steps_per_s": RATE, "iterations": ITERATIONS},
    }

    def write() -> None:
        write_report(path, content, arguments, **options)

    with Engine() as engine:
        launcher = PhysxLauncher(engine, load_sling(params, band), params, theta)
        policy = trained_policy(launcher, params, content)
        content["launches_in_physx"] = {"count": launcher.count, "seconds": launcher.seconds}
        write()
        rows = content["targets"] = at_targets(policy, launcher, params)
        content["errors"] = {
            name: mean_error(rows, name, "target_m") for name in ("in_physx_m", "in_ours_m")
        }
        write()
        if requested.landings:
            table = pd.read_csv(requested.landings)
            draws, measured = table[["draw_y_m", "draw_z_m"]].to_numpy(), table.landing_y_m
            columns = zip(draws, measured, launcher(draws).landing_y, strict=True)
            names = "draw_m", "measured_m", "in_physx_m"
            content["measured"] = [dict(zip(names, row, strict=True)) for row in columns]
            error = mean_error(content["measured"], "in_physx_m", "measured_m")
            content["errors"]["measured"] = error
            write()
        bench, counts = Bench(params, device=devices()[0]), study.ENVIRONMENTS[1:2]
        content["speeds"] = study.speeds(bench, engine, counts)
        content["met"] = study.fast_enough(content["speeds"]) and not content["failures"]
        write()
    if params.bands[band].source == "rig":
        launched_on_rig(content, params)
        write()


if __name__ == "__main__":
    errors.run(main)
