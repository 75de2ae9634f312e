"""How far a simulated interaction is from the recorded one.

    geom   mean over camera frames of the Chamfer distance                              [cm]
    force  mean over samples of |f_real - f_sim|                                        [N]
    work   | sum of trapezoids of (f_real - f_sim) . v over the whole episode |         [J]

They are the paper's, with its constants read as 1/(T 1 cm), 1/(T 1 N) and 1/(1 J). docs/method.md
says more.
"""

from __future__ import annotations

import threading
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from sling2sim2real.base.errors import UserError
from sling2sim2real.episode.episode import Episode
from sling2sim2real.episode.signal import cutoff_hz, recording_matrix
from sling2sim2real.identification.objective.chamfer import Chamfer, CloudDistance
from sling2sim2real.identification.objective.device_terms import DeviceTerms
from sling2sim2real.identification.results.evaluations import TERMS
from sling2sim2real.settings import Settings
from sling2sim2real.simulator.interaction import Rollouts
from sling2sim2real.simulator.model import ClampedBand

if TYPE_CHECKING:
    from scipy.sparse import csr_array

FILTER_LOCK = threading.Lock()  # while a filter is made, which takes a second


class EpisodeLoss:
    """The loss of one episode, for batches of rollouts."""

    def __init__(
        self,
        episode: Episode,
        *,
        radius: float,
        rest_length: float | np.ndarray,
        weights: dict[str, float],
        cutoff: float,
        median_window: int = 7,
        chamfer: str = "symmetric",
    ) -> None:
        """Prepare the recorded side.

        Args:
            radius, rest_length: Of the unstretched band [m]; the length whole or by edges.
            weights: Of each of TERMS; a term that weighs nothing is still computed.
            cutoff: Of the low-pass that the recorded force went through [Hz].
            median_window: Samples of the median filter on forces and velocity, odd.
            chamfer: "symmetric": between the cloud and the tube both ways; "clouds": between two
                clouds, as the paper prints it.

        Raises:
            UserError: No cloud has points.
        """
        self.weights = {name: float(weights[name]) for name in TERMS}
        self.median_window = median_window
        self.cutoff = cutoff
        self.time, self.period = episode.time, episode.sample_period
        self.velocity = self.smooth(episode.velocity)
        self.force = self.smooth(episode.force)
        distance = CloudDistance if chamfer == "clouds" else Chamfer
        self.chamfer = distance(
            episode.clouds, episode.camera, radius=radius, rest_length=rest_length
        )
        self._seen = np.array([len(cloud) > 0 for cloud in episode.clouds])
        if not self._seen.any():
            raise UserError(f"episode of {episode.band}: no camera frame shows the band")
        trapezoids = np.full(len(self.time), self.period)
        trapezoids[[0, -1]] /= 2
        self._on_device = DeviceTerms(
            self.chamfer,
            force=self.force,
            velocity=self.velocity,
            window=median_window,
            sample_weights=np.stack([np.full(len(self.time), 1 / len(self.time)), trapezoids]),
            frame_weights=100 * (self._seen / self._seen.sum()),
        )

    @classmethod
    def of(cls, params: Settings, method: str, episode: Episode, sling: ClampedBand) -> EpisodeLoss:
        """Make it from params.yaml's `loss`, `force` and `methods.<method>`."""
        weights = dict(params.methods[method].weights)
        return cls._weighed(params, weights, episode, sling, params.loss.chamfer)

    @classmethod
    def plain(cls, params: Settings, episode: Episode, sling: ClampedBand) -> EpisodeLoss:
        """Geometry, of what the camera sees, and force alone, for a part of an episode."""
        weights = {"geom": 1.0, "force": 1.0, "work": 0.0}
        return cls._weighed(params, weights, episode, sling, "symmetric")

    @classmethod
    def _weighed(
        cls,
        params: Settings,
        weights: dict[str, float],
        episode: Episode,
        sling: ClampedBand,
        chamfer: str,
    ) -> EpisodeLoss:
        return cls(
            episode,
            radius=sling.radius,
            rest_length=sling.edge_lengths,
            weights=weights,
            cutoff=cutoff_hz(params.force.cutoff, params.force.cutoff_unit),
            median_window=params.loss.median_window,
            chamfer=chamfer,
        )

    def terms(self, rollouts: Rollouts) -> dict[str, np.ndarray]:
        """Loss terms of N rollouts, each of shape (N,); NaN or infinite where a rollout is.

        They are computed on the device that holds the rollouts. A rollout's terms are the same to
        the bit in any batch.
        """
        if not isinstance(rollouts.force, np.ndarray):
            on_device = self._on_device(rollouts, self._filter(rollouts.times))
            return dict(zip(TERMS, on_device.T, strict=True))
        gap, frames = self._gap(rollouts), self.frames(rollouts)
        power = np.einsum("ntc,tc->nt", gap, self.velocity)
        work = (power[:, :-1] + power[:, 1:]).sum(axis=1)
        return {
            # not frames[:, seen]: its order in memory, and so the sum's, would depend on N
            "geom": 100 * frames.compress(self._seen, axis=1).mean(axis=1),
            "force": np.linalg.norm(gap, axis=2).mean(axis=1),
            "work": np.abs(work) / 2 * self.period,
        }

    def total(self, terms: dict[str, np.ndarray]) -> np.ndarray:
        """Weighted sum of the terms, shape (N,); one without weight may be NaN."""
        weighed = (weight * terms[name] for name, weight in self.weights.items() if weight)
        return sum(weighed, np.zeros(()))

    def filtered(self, rollouts: Rollouts) -> np.ndarray:
        """The simulated force as the record would have it [N], shape (N, T, 3), before `smooth`."""
        force = rollouts.force
        force = force if isinstance(force, np.ndarray) else force.numpy()
        count, steps, _ = force.shape
        flat = force.transpose(1, 0, 2).reshape(steps, -1)
        return (self._filter(rollouts.times) @ flat).reshape(-1, count, 3).transpose(1, 0, 2)

    def frames(self, rollouts: Rollouts) -> np.ndarray:
        """Chamfer distance of each camera frame [m], shape (N, K); NaN where it shows nothing."""
        line = rollouts.center_line
        return self.chamfer(line, "cpu" if isinstance(line, np.ndarray) else str(line.device))

    def smooth(self, signal: np.ndarray) -> np.ndarray:
        """Median filter along the samples of (..., T, 3)."""
        from scipy.ndimage import median_filter

        window = (1,) * (signal.ndim - 2) + (self.median_window, 1)
        return median_filter(signal, size=window, mode="nearest")

    def _gap(self, rollouts: Rollouts) -> np.ndarray:
        """Measured less simulated force [N], shape (N, T, 3)."""
        return self.force - self.smooth(self.filtered(rollouts))

    def _filter(self, times: np.ndarray) -> csr_array:
        """Filter of forces at simulated times (S,), as the recorded force was filtered."""
        start = float(self.time[0] - self.period / 2)
        with FILTER_LOCK:
            return _recording_filter(
                times.tobytes(), self.cutoff, start, self.period, len(self.time)
            )


@lru_cache(maxsize=128)  # shared by all losses of an episode, such as the report's replays
def _recording_filter(
    stamps: bytes, cutoff: float, start: float, period: float, samples: int
) -> csr_array:
    """Matrix (T, S) from forces at simulated times (S,) to the episode's T filtered samples.

    It is the recorded force's way (interpolation, low-pass, averages), which is linear, and
    forgets: weights that no rounding would show are left out.
    """
    from scipy.sparse import csr_array

    weights = recording_matrix(np.frombuffer(stamps), cutoff, start, period, samples)
    return csr_array(np.where(np.abs(weights) > 1e-18, weights, 0))
