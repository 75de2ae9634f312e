"""Batches of launches: what a virtual world's launches leave in them."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from pipeline.policy.batches import launched
from pipeline.policy.trials import Batch

LANDINGS = (1.9, 3.0, float("nan"))  # within the area, beyond it, nowhere


def launch(draw: np.ndarray, seed: int) -> SimpleNamespace:
    landing = LANDINGS[seed % 1000]
    return SimpleNamespace(
        landing_y=landing,
        failure=None if landing == 1.9 else "failed",
        hold_force=1e3 * abs(draw[0]) + seed % 1000,
        flight=None,
    )


def test_landings_outside_the_area_stand_beside_their_failure() -> None:
    """Equal numbers of two batches have equal seeds; what else is known of a launch stays."""
    drawn = {"plain": [[-0.3, -0.1]] * 3, "robust": [[-0.4, -0.2]] * 3}
    aimed = [
        Batch.without_flight("predicted", policy, draws, [1.9, 1.9, 2.1])
        for policy, draws in drawn.items()
    ]
    plain, robust = launched(aimed, launch, SimpleNamespace(seed=1))
    for one, policy in ((plain, "plain"), (robust, "robust")):
        assert (one.kind, one.policy, one.targets) == ("virtual", policy, [1.9, 1.9, 2.1])
        assert one.draws.tolist() == drawn[policy]
        assert one.landing == [1.9, 3.0, None]
        assert one.failure == [None, "failed", "failed"]
    assert plain.hold_force == [300, 301, 302] and robust.hold_force == [400, 401, 402]
