"""Train, check and export a slingshot policy.

    python -m stages.policy band1-paper

Reads data/theta/<pair>.json, and data/clamps/ of its recording; writes data/policies/<pair>/:
policy.onnx (metres to metres) and card.json. A killed training begins anew: it takes seconds.
SLING_DEVICE says where launches are simulated; PPO runs on one thread of the CPU.
"""

from __future__ import annotations

from pipeline.layout import Layout
from sling2sim2real.base.machine import device
from sling2sim2real.base.progress import Progress
from sling2sim2real.identification.results.theta import history_of, load_theta
from sling2sim2real.launching.surface.simulator import simulator
from sling2sim2real.launching.surface.stored import Stored
from sling2sim2real.policy.make import make_policy
from stages.start import pair_of_stage, run

EVERY = 1.0  # s, between two lines of a training


def main() -> None:
    params, pair = pair_of_stage()
    band, layout = pair.band, Layout()
    clamps, theta = layout.clamps(pair), load_theta(layout.theta(pair), band)
    iterations = params.policy.iterations
    how = make_policy(
        Stored(layout.policy(pair)),
        simulator(params, band, theta, clamps, device=device()),
        params,
        band,
        pair.method,
        theta,
        history=history_of(params, theta),
        progress=Progress(f"policy-{pair.key}", iterations, "iterations", every=EVERY),
    )
    print(f"{pair.key}: {how}")


if __name__ == "__main__":
    run(main)
