"""A planned pull as an episode without force or clouds: where the hand goes, and when."""

from __future__ import annotations

import numpy as np

from pipeline.episode.episode import Episode
from pipeline.params.recording import EpisodeParams

REST, GRASP_TIME, LIFT_TIME, SPARE = 0.3, 0.1, 1.2, 0.3  # s
CAMERA = (0.80, 0.32, 0.50)  # m, where a planned pull is looked at from


def planned_pull(
    params: EpisodeParams,
    band: str,
    hanging: float,
    draw: tuple[float, float] = (-0.40, 0.0),
    *,
    pull_time: float = 1.5,
    pause: float = 1.0,
    frame_rate: float = 30.0,
) -> Episode:
    """The hand takes the hanging band, lifts it, draws it, pauses and lets go.

    Args:
        hanging: Height of the hanging band's middle, frame O [m].
        draw: Where the middle is drawn to (y, z), frame O [m].
        pull_time: For the way there [s].
        pause: From there to the release [s].
        frame_rate: Of the camera [Hz].
    """
    period = params.duration / params.samples
    grasp, lifted = REST, REST + LIFT_TIME
    drawn = lifted + pull_time
    release = drawn + pause
    end = release + params.tail + SPARE
    time = period * (np.arange(int(end / period)) + 0.5)
    start, below, there = (np.array(one) for one in ([0, 0, hanging], [0, 0, 0], [0, *draw]))
    position = start + np.outer(_eased(time, grasp + GRASP_TIME, lifted), below - start)
    position += np.outer(_eased(time, lifted, drawn), there)
    frames = np.arange(int(time[-1] * frame_rate)) / frame_rate
    return Episode(
        band=band,
        time=time,
        position=position,
        velocity=np.gradient(position, period, axis=0),
        force=np.zeros_like(position),
        opening=np.full(len(time), np.nan),
        cloud_time=frames,
        clouds=[np.zeros((0, 3), np.float32)] * len(frames),
        grasp_time=grasp,
        release_time=release,
        camera=np.array(CAMERA),
        metadata={"input": {"file": "planned"}},
    )


def _eased(time: np.ndarray, start: float, end: float) -> np.ndarray:
    """From 0 to 1, at rest at both ends, with continuous acceleration, shape (T,)."""
    part = np.clip((time - start) / (end - start), 0, 1)
    return part**3 * (10 - 15 * part + 6 * part**2)
