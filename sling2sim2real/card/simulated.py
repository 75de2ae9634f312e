"""A recorded pull as the calibrated simulator plays it, at finer stamps than the camera's."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import Akima1DInterpolator

from sling2sim2real.api.identification import Identification
from sling2sim2real.base.errors import UserError
from sling2sim2real.episode.episode import Episode
from sling2sim2real.simulator.interaction import with_recorded_pads
from sling2sim2real.simulator.replay import replay

COARSE, FINE = 1 / 30, 1e-3  # s between states, around the release FINE
AROUND = (-0.06, 0.2)  # of the release [s]
POINTS = 121  # of a drawn line


@dataclass(frozen=True)
class Simulated:
    """One simulated pull on the episode's clock, frame O.

    Attributes:
        release: When the hand lets go [s], as identified.
        camera: What to add to the camera's stamps for the simulator's clock [s].
        time: Of the states [s], shape (K,), increasing.
        nodes: Of the band in each [m], shape (K, L, 3).
        place: Of the nodes along the band at rest, shape (L,).
        force: On the gripper at the episode's samples, filtered as the measured one, shape (T, 3).
    """

    release: float
    camera: float
    time: np.ndarray
    nodes: np.ndarray
    place: np.ndarray
    force: np.ndarray

    def line(self, time: float) -> np.ndarray:
        """The band's middle line at a moment, smooth as the band is, shape (POINTS, 3)."""
        time = np.clip(time, self.time[0], self.time[-1])
        after = int(np.clip(np.searchsorted(self.time, time), 1, len(self.time) - 1))
        part = (time - self.time[after - 1]) / (self.time[after] - self.time[after - 1])
        nodes = (1 - part) * self.nodes[after - 1] + part * self.nodes[after]
        return smooth(self.place, nodes)


def smooth(place: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """A spline through nodes (L, ...) along the band, which goes round the hand without overshoot.

    Shape (POINTS, ...).
    """
    along = np.linspace(place[0], place[-1], POINTS)
    return Akima1DInterpolator(place, nodes, axis=0, method="makima")(along)


def simulate(found: Identification, episode: Episode) -> Simulated:
    """Play the pull with a band's θ, its release and its camera's clock as identified.

    Raises:
        UserError: θ fails in simulation.
    """
    sling, derived = found.sling, found.confidence.get("derived", {})
    camera = 0.0
    if "release_time" in derived:  # as the density has them (identification/posterior)
        friction = found.theta.dynamic_friction
        sling = with_recorded_pads(sling, episode, friction)
        episode = replace(episode, release_time=derived["release_time"]["value"])
        camera = -derived["camera_delay"]["value"]
    release = episode.release_time
    end = max(episode.time[-1], *episode.cloud_time)
    stamps = np.unique(
        np.concatenate(
            [
                np.arange(0.0, end, COARSE),
                np.arange(release + AROUND[0], release + AROUND[1], FINE),
                episode.cloud_time + camera,
            ]
        ).clip(0.0, end)
    )
    stamps = stamps[np.append(True, np.diff(stamps) > 1e-6)]
    played = replace(episode, cloud_time=stamps, clouds=[])
    done = replay(sling, played, found.parameters, found.settings.force)
    if failure := done.rollouts.failure[0]:
        raise UserError(f"{found.band.name}: its recording fails in simulation ({failure})")
    return Simulated(
        release=float(release),
        camera=float(camera),
        time=stamps,
        nodes=np.asarray(done.rollouts.center_line[0], float),
        place=np.append(0.0, np.cumsum(sling.edge_lengths)),
        force=done.force[0],
    )
