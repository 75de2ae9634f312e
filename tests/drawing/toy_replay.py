"""A replay without a simulation: nine tenths of the force, clouds a centimetre off."""

import numpy as np

from pipeline.drawing.replay import Replay, work

LOADED = -0.4 * (1 - np.abs(np.linspace(-1, 1, 25)))  # z [m]: 40 cm deep in the middle
NOTHING = {kind: {"fitted": 0.2, "held_out": np.nan} for kind in ("force", "cloud")}


def toy_replay(params, band, method, episode, theta, residuals=NOTHING) -> Replay:
    period = episode.sample_period
    return Replay(
        force=0.9 * episode.force,
        center_line=np.stack([cloud + 0.01 for cloud in episode.clouds]),
        distance=np.full(len(episode.clouds), 0.01),
        measured_work=work(episode.force, episode.velocity, period),
        work=0.9 * work(episode.force, episode.velocity, period),
        residuals=residuals,
        loaded=np.stack([np.linspace(-0.1375, 0.1375, 25), np.zeros(25), LOADED], 1),
    )
