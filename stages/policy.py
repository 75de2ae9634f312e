"""Train, check and export the slingshot policies of one band and method.

    python -m stages.policy band1 sling2sim2real

Reads data/theta/<band>/<method>.json; writes data/policies/<band>/<method>/: policy.onnx and
policy.pt (metres to metres), card.json, map.parquet (the simulated launches) and training.parquet.
A method of policy.robust.methods gets a second policy in its folder robust/, by the samples of
data/confidence/<band>/<method>.json. A killed training goes on from .checkpoints/policy/.
SLING_DEVICE says where launches are simulated; PPO runs on one thread of the CPU.
"""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from pipeline import errors
from pipeline.files import replacing, write_json
from pipeline.machine import devices, kind
from pipeline.policy import robust
from pipeline.policy.aim import ROBUST, simulator
from pipeline.policy.check import check, check_expected, figures, robust_figures, verdict
from pipeline.policy.export import PLAIN, card, write_onnx, write_torchscript
from pipeline.policy.landing_map import LandingMap, validation
from pipeline.policy.landscape import Landscape
from pipeline.policy.spread import load_samples
from pipeline.policy.train import Policy, Trained, train
from pipeline.progress import Progress
from pipeline.stage import expect_from, started
from pipeline.theta import load_theta

EVERY = 1.0  # s, between two lines of a training


def main() -> None:
    params, band, method = started("band", "method")
    source = expect_from(
        params.run, "theta", band, method, Path("data/theta", band, f"{method}.json")
    )
    theta = load_theta(source, band)
    launcher = simulator(params, band, theta, device=devices())
    landing_map = LandingMap.simulate(
        launcher,
        draw_y=params.setup.draw_y,
        draw_z=params.setup.draw_z,
        size=params.policy.map_size,
        max_force=params.setup.max_force,
        seed=params.policy.seed,
    )
    kept = Path(".checkpoints/policy", f"{band}-{method}.pt")
    told = Progress(f"policy-{band}-{method}", params.policy.iterations, "iterations", every=EVERY)
    plain = train(Landscape([landing_map]), params.policy, kept, told)
    checked = check(plain.policy, launcher, params)
    training = figures(plain, checked)

    folder = Path("data/policies", band, method)
    landing_map.save(folder / "map.parquet", {"band": band, "method": method})
    about = {"params": params, "band": band, "method": method, "theta": theta, "device": kind()}
    validated = landing_map.validation(params.policy.targets)
    _write(folder, plain, about, kind=PLAIN, training=training, landing_map=validated)
    print(f"{band} {method}: {verdict(training, checked.failures)}", flush=True)

    shutil.rmtree(folder / ROBUST, ignore_errors=True)  # of an earlier run by other parameters
    if method in params.policy.robust.methods:
        source = Path("data/confidence", band, f"{method}.json")
        samples = load_samples(params.run, source, band, method)
        if samples is None:
            print(f"{band} {method}: no robust policy, for there is no {source}")
        else:
            _robust(folder / ROBUST, plain.policy, samples, launcher, about)
    kept.unlink(missing_ok=True)


def _robust(folder: Path, plain: Policy, samples: np.ndarray, launcher, about) -> None:
    """Train, check and export the policy that knows what the identification leaves open."""
    params, error = about["params"], about["params"].trials.actuation_error
    middle = plain.draws(np.mean(params.policy.targets, keepdims=True))[0]
    maps = robust.robust_maps(launcher, samples, middle, params)
    title = f"policy-{about['band']}-{about['method']}-robust"
    told = Progress(title, robust.STEPS, "steps", every=EVERY)
    trained = robust.refine(plain, Landscape(maps, error), params.policy, told)
    checked = check(trained.policy, launcher, params)
    expected = [check_expected(one, launcher, samples, params) for one in (trained.policy, plain)]
    training = robust_figures(trained, checked, *expected, len(maps), error)
    validated = validation(maps, params.policy.targets)
    _write(folder, trained, about, kind=ROBUST, training=training, landing_map=validated)
    ours, theirs = (100 * one.mean_error for one in expected)
    print(
        f"{about['band']} {about['method']}, robust: {verdict(training, checked.failures)};"
        f" expected over samples of θ and errors of the draw {ours:.2f} cm, plain {theirs:.2f} cm"
    )


def _write(folder: Path, trained: Trained, about: dict, **figures) -> None:
    with replacing(folder / "training.parquet") as temporary:
        pq.write_table(pa.table(trained.curve), temporary)
    write_onnx(trained.policy, folder / "policy.onnx")
    write_torchscript(trained.policy, folder / "policy.pt")
    write_json(folder / "card.json", card(trained.policy, **about, **figures))


if __name__ == "__main__":
    errors.run(main)
