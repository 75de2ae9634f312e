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

from pipeline.base.layout import Layout
from pipeline.base.machine import devices, kind
from pipeline.base.progress import Progress
from pipeline.landing.landing_map import LandingMap, surface_of, validation
from pipeline.landing.simulator import asked_of_the_hand, simulator
from pipeline.landing.stored import PLAIN, ROBUST, Stored
from pipeline.policy import robust
from pipeline.policy.check import check, check_expected, figures, robust_figures, verdict
from pipeline.policy.export import export
from pipeline.policy.train import Policy, train
from pipeline.sling.theta import load_samples, load_theta
from stages.start import run, started

EVERY = 1.0  # s, between two lines of a training


def main() -> None:
    params, band, method = started("band", "method")
    layout = Layout()
    theta = load_theta(layout.theta(band, method), band)
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
    title = f"policy-{band}-{method}"
    progress = Progress(title, params.policy.iterations, "iterations", every=EVERY)
    plain = train(surface_of([landing_map]), params.policy, kept, progress)
    checked = check(plain.policy, launcher, params)
    training = figures(plain, checked)

    stored = Stored(band, method)
    landing_map.save(stored.folder() / "map.parquet", {"band": band, "method": method})
    middle = plain.policy.draws(np.mean(params.policy.targets, keepdims=True))[0]
    hand = asked_of_the_hand(params, band, theta, middle)
    about = {"params": params, "band": band, "method": method, "theta": theta, "launch": hand}
    about["device"] = kind()
    validated = validation([landing_map], params.policy.targets)
    export(plain, stored.folder(), kind=PLAIN, training=training, landing_map=validated, **about)
    print(f"{band} {method}: {verdict(training, checked.failures)}", flush=True)

    shutil.rmtree(stored.folder(ROBUST), ignore_errors=True)  # of an earlier run
    if method in params.policy.robust.methods:
        source = layout.confidence(band, method)
        samples = load_samples(source)
        if samples is None:
            print(f"{band} {method}: no robust policy, for there are no samples in {source}")
        else:
            _robust(stored.folder(ROBUST), plain.policy, middle, samples, launcher, about)
    kept.unlink(missing_ok=True)


def _robust(folder: Path, plain: Policy, middle, samples: np.ndarray, launcher, about) -> None:
    """Train, check and export the policy that knows what the identification leaves open."""
    params, error = about["params"], about["params"].trials.actuation_error
    maps = robust.robust_maps(launcher, samples, middle, params)
    title = f"policy-{about['band']}-{about['method']}-robust"
    progress = Progress(title, robust.STEPS, "steps", every=EVERY)
    trained = robust.refine(plain, surface_of(maps, error), params.policy, progress)
    checked = check(trained.policy, launcher, params)
    expected = [check_expected(one, launcher, samples, params) for one in (trained.policy, plain)]
    training = robust_figures(trained, checked, *expected, len(maps), error)
    validated = validation(maps, params.policy.targets)
    export(trained, folder, kind=ROBUST, training=training, landing_map=validated, **about)
    ours, theirs = (100 * one.mean_error for one in expected)
    print(
        f"{about['band']} {about['method']}, robust: {verdict(training, checked.failures)};"
        f" expected over samples of θ and errors of the draw {ours:.2f} cm, plain {theirs:.2f} cm"
    )


if __name__ == "__main__":
    run(main)
