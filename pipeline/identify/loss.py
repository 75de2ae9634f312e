"""How far a simulated interaction is from the recorded one.

    geom   mean over camera frames of the Chamfer distance                              [cm]
    force  mean over samples of |f_real - f_sim|                                        [N]
    work   | sum of trapezoids of (f_real - f_sim) . v over the whole episode |         [J]
    taut   geom over the frames in which the released band is still taut                [cm]

The first three are the paper's, with its constants read as 1/(T 1 cm), 1/(T 1 N) and 1/(1 J). The
fourth is ours: after the recoil the band swings slack, and frames of that swing, many and alike,
drown the few that show the damping. docs/method.md says more.
"""

from __future__ import annotations

import threading

import numpy as np
from scipy.ndimage import median_filter
from scipy.sparse import csr_array

from pipeline.episode import Episode
from pipeline.errors import UserError
from pipeline.identify.chamfer import Chamfer
from pipeline.signal import average, cutoff_hz, lowpass, uniform

TERMS = ("geom", "force", "work", "taut")
RATE = 1000.0  # of the simulated force on its way through the filter [Hz]
MIDDLE = 0.03  # the middle of the band: points this near the plane x = 0 [m]
LONGEST_RECOIL = 0.2  # after the release [s]; soft bands cross the fork plane within 0.1


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
        symmetric: bool = True,
        frame_cap: float | None = None,
        device: str = "cpu",
    ) -> None:
        """Prepare the recorded side.

        Args:
            radius, rest_length: Of the unstretched band [m]; the length whole or by edges.
            weights: Of each of TERMS; a term that weighs nothing is still computed.
            cutoff: Of the low-pass that the recorded force went through [Hz].
            median_window: Samples of the median filter on forces and velocity, odd.
            symmetric: Chamfer distance both ways, or measured to simulated alone.
            frame_cap: No frame counts for more than this [m].
            device: Where the Chamfer distances are computed.

        Raises:
            UserError: No cloud has points, or `taut` has weight and no frame is in the recoil.
        """
        self.weights = {name: float(weights[name]) for name in TERMS}
        self.frame_cap = np.inf if frame_cap is None else frame_cap
        self.median_window = median_window
        self.cutoff = cutoff
        self.time, self.period = episode.time, episode.sample_period
        self.velocity = self._smooth(episode.velocity)
        self.force = self._smooth(episode.force)
        self.chamfer = Chamfer(
            episode.clouds,
            episode.camera,
            radius=radius,
            rest_length=rest_length,
            symmetric=symmetric,
            device=device,
        )
        self.seen = np.array([len(cloud) > 0 for cloud in episode.clouds])
        self.taut = taut_frames(episode) & self.seen
        if not self.seen.any():
            raise UserError(f"episode of {episode.band}: no camera frame shows the band")
        if self.weights["taut"] and not self.taut.any():
            raise UserError(
                f"episode of {episode.band}: no camera frame between the release and the fork"
                " plane; choose a method whose weights.taut is 0"
            )
        self._cached: tuple[np.ndarray, csr_array] | None = None
        self._lock = threading.Lock()

    @classmethod
    def of(
        cls, params, method: str, episode: Episode, sling, *, device: str = "cpu"
    ) -> EpisodeLoss:
        """Make it from params.yaml's `loss`, `force` and `methods.<method>`."""
        return cls(
            episode,
            radius=sling.radius,
            rest_length=sling.edge_lengths,
            weights=dict(params.methods[method].weights),
            cutoff=cutoff_hz(params.force.cutoff, params.force.cutoff_unit),
            median_window=params.loss.median_window,
            symmetric=params.loss.chamfer == "symmetric",
            device=device,
        )

    @classmethod
    def plain(cls, params, episode: Episode, sling) -> EpisodeLoss:
        """Geometry and force alone, for a part of an episode."""
        return cls(
            episode,
            radius=sling.radius,
            rest_length=sling.edge_lengths,
            weights={"geom": 1.0, "force": 1.0, "work": 0.0, "taut": 0.0},
            cutoff=cutoff_hz(params.force.cutoff, params.force.cutoff_unit),
            median_window=params.loss.median_window,
            symmetric=params.loss.chamfer == "symmetric",
        )

    def terms(self, rollouts) -> dict[str, np.ndarray]:
        """Each term of N rollouts, shape (N,); NaN or infinite where a rollout is.

        `taut` is NaN where the episode has no frame in the recoil.
        """
        force = rollouts.force
        force = force if isinstance(force, np.ndarray) else force.numpy()
        force = force.transpose(1, 0, 2)  # (S, N, 3)
        force = self._filter(rollouts.times) @ force.reshape(len(force), -1)
        force = force.reshape(len(force), -1, 3).transpose(1, 0, 2)  # (N, T, 3)
        gap = self.force - self._smooth(force)  # (N, T, 3)
        power = np.einsum("ntc,tc->nt", gap, self.velocity)
        frames = np.minimum(self.chamfer(rollouts.center_line), self.frame_cap)  # (N, K)
        nothing = np.full(len(frames), np.nan)
        return {
            "geom": 100 * frames[:, self.seen].mean(axis=1),
            "force": np.linalg.norm(gap, axis=2).mean(axis=1),
            "work": np.abs((power[:, :-1] + power[:, 1:]).sum(axis=1)) / 2 * self.period,
            "taut": 100 * frames[:, self.taut].mean(axis=1) if self.taut.any() else nothing,
        }

    def total(self, terms: dict[str, np.ndarray]) -> np.ndarray:
        """Weighted sum of the terms, shape (N,); one without weight may be NaN."""
        return sum(weight * terms[name] for name, weight in self.weights.items() if weight)

    def _smooth(self, signal: np.ndarray) -> np.ndarray:
        """Median filter along the samples of (..., T, 3)."""
        window = (1,) * (signal.ndim - 2) + (self.median_window, 1)
        return median_filter(signal, size=window, mode="nearest")

    def _filter(self, times: np.ndarray) -> csr_array:
        """Matrix (T, S) from forces at simulated times (S,) to the episode's filtered samples.

        It is the recorded force's way (interpolation, low-pass, averages), which is linear, and
        forgets: weights that no rounding would show are left out.
        """
        with self._lock:
            if self._cached is None or not np.array_equal(self._cached[0], times):
                start = self.time[0] - self.period / 2
                columns = []
                for first in range(0, len(times), 128):
                    pulses = np.eye(len(times), min(128, len(times) - first), -first)
                    grid, signal = uniform(times, pulses, RATE)
                    signal = lowpass(signal, RATE, self.cutoff)
                    columns.append(average(grid, signal, start, self.period, len(self.time)))
                weights = np.hstack(columns)
                self._cached = times, csr_array(np.where(np.abs(weights) > 1e-18, weights, 0))
            return self._cached[1]


def taut_frames(episode: Episode) -> np.ndarray:
    """Which camera frames show the released band on its way to the fork plane, shape (K,).

    Decided by the measured clouds alone, so that it is the same for every theta: from the release
    on, until a frame shows the middle of the band at y >= 0. A frame that does not show the middle
    decides nothing.
    """
    taut = np.zeros(len(episode.cloud_time), bool)
    for frame in np.argsort(episode.cloud_time):
        after = episode.cloud_time[frame] - episode.release_time
        if after <= 0:
            continue
        cloud = episode.clouds[frame]
        middle = cloud[np.abs(cloud[:, 0]) < MIDDLE, 1]
        if after > LONGEST_RECOIL or (len(middle) and np.median(middle) >= 0):
            break
        taut[frame] = True
    return taut
