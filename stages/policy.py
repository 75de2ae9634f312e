"""Train, check and export a slingshot policy.

    python -m stages.policy band1-paper

Reads data/theta/<pair>.json, and data/clamps/ of its recording; writes data/policies/<pair>/:
policy.onnx (metres to metres), card.json, map.parquet (launches over the box) and training.parquet.
A killed training begins anew: it takes seconds. SLING_DEVICE says where launches are simulated; PPO
runs on one thread of the CPU.
"""

from __future__ import annotations

import numpy as np

from pipeline.layout import Layout
from sling2sim2real.base.machine import devices, kind
from sling2sim2real.base.progress import Progress
from sling2sim2real.identification.results.theta import load_theta
from sling2sim2real.launching.surface.landing_map import LandingMap, validation
from sling2sim2real.launching.surface.simulated import SimulatedLandings
from sling2sim2real.launching.surface.simulator import asked_of_the_hand, simulator
from sling2sim2real.policy.check import check, figures, verdict
from sling2sim2real.policy.environment import projectile_start
from sling2sim2real.policy.export import export
from sling2sim2real.policy.train import train
from stages.start import pair_of_stage, run

EVERY = 1.0  # s, between two lines of a training


def main() -> None:
    params, pair = pair_of_stage()
    band, method, layout = pair.band, pair.method, Layout()
    folder, clamps = layout.policy(pair), layout.clamps(pair)
    theta = load_theta(layout.theta(pair), band)
    launcher = simulator(params, band, theta, clamps, device=devices())
    landing_map = LandingMap.simulate(
        launcher,
        draw_y=params.setup.draw_y,
        draw_z=params.setup.draw_z,
        size=params.policy.map_size,
        max_force=params.setup.max_force,
        seed=params.policy.seed,
    )
    progress = Progress(f"policy-{pair.key}", params.policy.iterations, "iterations", every=EVERY)
    surface, settings = landing_map.surface, params.policy
    if settings.landings == "simulated":  # the map then shows what the simulator does, no more
        surface = SimulatedLandings(launcher, surface)
    seen = settings.state == "projectile_target"
    start = projectile_start(params.setup, params.bands[band]) if seen else None
    trained = train(surface, settings, progress, projectile=start)
    checked = check(trained.policy, launcher, params)
    training = figures(trained, checked, settings.landings)

    landing_map.save(folder / "map.parquet", {"band": band, "method": method})
    middle = trained.policy.draws(np.mean(params.policy.targets, keepdims=True))[0]
    export(
        trained,
        folder,
        params,
        band,
        method,
        theta,
        training=training,
        landing_map=validation(landing_map, params.policy.targets),
        launch=asked_of_the_hand(params, band, theta, middle, clamps),
        device=kind(),
    )
    print(f"{pair.key}: {verdict(training, checked.failures)}")


if __name__ == "__main__":
    run(main)
