"""Train, check and export the slingshot policies of one band and method.

    python -m stages.policy band1 sling2sim2real

Reads data/theta/<band>/<method>.json; writes data/policies/<band>/<method>/: policy.onnx (metres
to metres), card.json, map.parquet (launches over the box) and training.parquet.
A killed training begins anew: it takes seconds.
SLING_DEVICE says where launches are simulated; PPO runs on one thread of the CPU.
"""

from __future__ import annotations

from functools import partial

from sling2sim2real.base.layout import Layout
from sling2sim2real.base.machine import devices
from sling2sim2real.base.progress import Progress
from sling2sim2real.identification.results.theta import load_theta
from sling2sim2real.launching.surface.simulator import asked_of_the_hand, simulator
from sling2sim2real.launching.surface.stored import Stored
from sling2sim2real.policy.make import make_policy
from stages.start import run, started

EVERY = 1.0  # s, between two lines of a training


def main() -> None:
    params, band, method = started("band", "method")
    theta = load_theta(Layout().theta(band, method), band)
    title = f"policy-{band}-{method}"
    how = make_policy(
        Stored(band, method).folder,
        simulator(params, band, theta, device=devices()),
        params,
        band,
        method,
        theta,
        asked=partial(asked_of_the_hand, params, band, theta),
        progress=Progress(title, params.policy.iterations, "iterations", every=EVERY),
    )
    print(f"{band} {method}: {how}")


if __name__ == "__main__":
    run(main)
