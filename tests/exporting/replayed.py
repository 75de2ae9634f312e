"""What holds of an export that is replayed in its own engine, whichever that is."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from sling2sim2real.exporting.chain import SpringChain
from sling2sim2real.exporting.match import (
    HOLD_LIMIT,
    LANDING_LIMIT,
    Matched,
    compared,
    draws_of,
    proof_draws,
)

DRAW = np.array([-0.35, -0.15])


def chain_of(model, done, **more) -> SpringChain:
    """The matched chain of the export `done`."""
    draws, ours = draws_of(model)
    matched = {row["name"]: row["value"] for row in done.card["matched"]}
    return replace(SpringChain.of(model, draws, ours.hold_force), **matched, **more)


def assert_proven(model, done) -> None:
    """On draws that took no part in the match."""
    assert done.met and done.card["met"]
    match = {(row["draw_y_m"], row["draw_z_m"]) for row in done.card["match"]}
    assert len(match) > 8 and len(done.card["proof"]) == 3
    assert done.card["time_step_error"] < 0.005
    for row in done.card["proof"]:
        draw = row["draw_y_m"], row["draw_z_m"]
        assert draw not in match
        ours = model.launches(draw)
        assert row["hold_force_n"] == pytest.approx(ours.hold_force[0], rel=1e-3)
        assert row["landing_there_m"] == pytest.approx(ours.landing_y[0], rel=LANDING_LIMIT)
        assert row["hold_force_there_n"] == pytest.approx(ours.hold_force[0], rel=HOLD_LIMIT)


def assert_another_would_be_noticed(model, chain: SpringChain, replay) -> None:
    """5 % more pull, or three times the damping, does not pass the proof."""
    draws = proof_draws(model)

    def met(chain: SpringChain) -> bool:
        proof = compared(model, draws, replay(chain).launches(draws))
        return Matched(chain, [], proof, 0.0, "").met

    assert met(chain)
    assert not met(replace(chain, strength=1.05 * chain.strength))
    assert not met(replace(chain, damping_time=3 * chain.damping_time))


def pull_of(chain: SpringChain, middle: np.ndarray) -> np.ndarray:
    """Of two straight legs to `middle`, and of the weight there [N], shape (3,)."""
    legs = chain.tips - middle
    lengths = np.linalg.norm(legs, axis=1, keepdims=True)
    pull = chain.pull(2 * lengths / chain.rest_length - 1)
    weight = (chain.mass / 2 + chain.projectile_mass) * 9.81
    return (pull * legs / lengths).sum(axis=0) - [0, 0, weight]


def assert_samples(model, done) -> None:
    """They hold and land as the calibrated simulation of theirs, and not as the best θ."""
    told, table = done.card["samples"], pd.read_parquet(done.folder / "samples.parquet")
    assert told["met"] and (told["count"], len(told["replayed"])) == (5, 3)
    assert {told["replayed"][0]["sample"], told["replayed"][-1]["sample"]} == {0, 2}
    names = [f"theta_{name}" for name in model.sampled.names]
    np.testing.assert_allclose(table[names], model.samples, rtol=1e-9)
    ours = model.launches(np.tile(DRAW, (5, 1)), model.samples)
    assert np.ptp(ours.hold_force) > 5 * HOLD_LIMIT * ours.hold_force.mean()
    assert np.ptp(ours.landing_y) > 5 * LANDING_LIMIT * ours.landing_y.mean()


def loaded(done, monkeypatch) -> dict:
    """What the card's second example makes: a band of the first sample."""
    monkeypatch.chdir(done.folder)
    code = (done.folder / "README.md").read_text().split("```python\n")[2].split("```")[0]
    names: dict = {}
    exec(code, names)
    return names
