"""A band of known law, and a hand that lifts, pulls and lets go; no force and no clouds yet."""

from types import SimpleNamespace

import numpy as np

from pipeline.params import load
from sling2sim2real.base.minimum_jerk import minimum_jerk
from sling2sim2real.episode.episode import Episode
from sling2sim2real.simulator.model import ClampedBand, ClampValues
from tests.project import DEFAULTS

PARAMS = load(DEFAULTS)
PERIOD = 0.03


def sling_of(mass: float, clamps: ClampValues | None = None) -> ClampedBand:
    """A band of 10 mm and 52 cm at params.yaml's resolution."""
    band = SimpleNamespace(mass=mass, diameter=0.01, rest_length=0.52, preconditioned=False)
    return ClampedBand.of(band, PARAMS.setup, PARAMS.sling, clamps)


def smooth(time: np.ndarray, start: float, end: float) -> np.ndarray:
    """From 0 to 1 with rest at both ends."""
    return minimum_jerk((time - start) / (end - start))


def pulled(
    samples: int,
    frames: int,
    grasp: float,
    lift: tuple[float, float],
    pull: tuple[float, float],
    release: float,
    first_frame: float = 0.0,
) -> Episode:
    """The hand takes the hanging band at `grasp`, lifts it 0.2 m, pulls it 0.4 m, lets go [s]."""
    time = PERIOD * (np.arange(samples) + 0.5)
    position = [0 * time, -0.4 * smooth(time, *pull), -0.2 * (1 - smooth(time, *lift))]
    position = np.stack(position, axis=1)
    return Episode(
        band="known",
        time=time,
        position=position,
        velocity=np.gradient(position, PERIOD, axis=0),
        force=np.zeros((samples, 3)),
        opening=np.full(samples, np.nan),
        cloud_time=np.arange(frames) / 30 + first_frame,
        clouds=[np.zeros((0, 3), np.float32)] * frames,
        grasp_time=grasp,
        release_time=release,
        camera=np.array([0.8, 0.3, 0.5]),
    )
