"""Episodes of the simulator's own law as instruments with known flaws would record them."""

from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

from pipeline.episode.episode import Episode
from pipeline.sling.model import Sling
from tests.objective.own_law import own_law_episode


def flawed_episode(
    sling: Sling, episode: Episode, theta: np.ndarray, flaws: dict[str, float], **options
) -> Episode:
    """`own_law_episode` with `options`, seen and felt with `flaws`, by names of nuisances."""
    sling = replace(sling, air_drag=flaws.get("air_drag", 0.0))
    hand = CubicSpline(episode.time, episode.position, axis=0)
    early = episode.time - flaws.get("force_delay", 0)
    felt = replace(episode, time=early, position=hand(early))
    seen = replace(episode, cloud_time=episode.cloud_time - flaws.get("camera_delay", 0))
    force = own_law_episode(sling, felt, theta, **options).force
    clouds = own_law_episode(sling, seen, theta, **options).clouds
    shift, bias = (
        np.array([flaws.get(f"{name}_{axis}", 0) for axis in "xyz"])
        for name in ("cloud_shift", "force_bias")
    )
    return replace(
        episode,
        force=flaws.get("force_gain", 1) * force + bias,
        clouds=[cloud + shift.astype(np.float32) for cloud in clouds],
    )
