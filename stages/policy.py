"""Train, check and export the slingshot policies of one band and method.

    python -m stages.policy band1 paper

Reads data/theta/<band>/<method>.json; writes data/policies/<band>/<method>/: policy.onnx (metres
to metres), card.json, map.parquet (launches over the box) and training.parquet.
A killed training begins anew: it takes seconds.
SLING_DEVICE says where launches are simulated; PPO runs on one thread of the CPU.
"""

from __future__ import annotations

import numpy as np

from sling2sim2real.base.layout import Layout
from sling2sim2real.base.machine import devices, kind
from sling2sim2real.base.progress import Progress
from sling2sim2real.identification.results.theta import load_theta
from sling2sim2real.launching.surface.landing_map import LandingMap, validation
from sling2sim2real.launching.surface.simulated import SimulatedLandings
from sling2sim2real.launching.surface.simulator import asked_of_the_hand, simulator
from sling2sim2real.launching.surface.stored import Stored
from sling2sim2real.policy.check import check, figures, verdict
from sling2sim2real.policy.environment import projectile_start
from sling2sim2real.policy.export import export
from sling2sim2real.policy.train import train
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
    title = f"policy-{band}-{method}"
    progress = Progress(title, params.policy.iterations, "iterations", every=EVERY)
    surface, settings = landing_map.surface, params.policy
    if settings.landings == "simulated":  # the map then shows what the simulator does, no more
        surface = SimulatedLandings(launcher, surface)
    seen = settings.state == "projectile_target"
    start = projectile_start(params.setup, params.bands[band]) if seen else None
    trained = train(surface, settings, progress, projectile=start)
    checked = check(trained.policy, launcher, params)
    training = figures(trained, checked, settings.landings)

    stored = Stored(band, method)
    landing_map.save(stored.folder / "map.parquet", {"band": band, "method": method})
    middle = trained.policy.draws(np.mean(params.policy.targets, keepdims=True))[0]
    export(
        trained,
        stored.folder,
        params,
        band,
        method,
        theta,
        training=training,
        landing_map=validation(landing_map, params.policy.targets),
        launch=asked_of_the_hand(params, band, theta, middle),
        device=kind(),
    )
    print(f"{band} {method}: {verdict(training, checked.failures)}")


if __name__ == "__main__":
    run(main)
