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
from sling2sim2real.identification.objective.chamfer import Chamfer
from sling2sim2real.identification.results.evaluations import TERMS
from sling2sim2real.settings import Settings
from sling2sim2real.simulator.interaction import Rollouts
from sling2sim2real.simulator.model import ClampedBand

if TYPE_CHECKING:
    import warp as wp
    from scipy.sparse import csr_array

FILTER_LOCK = threading.Lock()  # while a filter is made, which takes a second
SURFACES = {"symmetric": "tube", "clouds": "mesh"}  # of `loss.chamfer`


class EpisodeLoss:
    """The loss of one episode, for batches of rollouts."""

    def __init__(
        self,
        episode: Episode,
        *,
        radius: float,
        rest_edges: np.ndarray,
        weights: dict[str, float],
        cutoff: float,
        median_window: int = 7,
        chamfer: str = "symmetric",
    ) -> None:
        """Prepare the recorded side.

        Args:
            radius, rest_edges: Of the unstretched band, and of its edges [m].
            weights: Of each of TERMS; a term that weighs nothing is still computed.
            cutoff: Of the low-pass that the recorded force went through [Hz].
            median_window: Samples of the median filter on forces and velocity, odd.
            chamfer: "symmetric": between the cloud and the tube both ways; "clouds": between two
                clouds, as the paper prints it.

        Raises:
            UserError: No cloud has points.
        """
        self.weights = {name: float(weights[name]) for name in TERMS}
        self.median_window, self.cutoff = median_window, cutoff
        self.time, self.period = episode.time, episode.sample_period
        self.chamfer = Chamfer(
            episode.clouds,
            episode.camera,
            radius=radius,
            rest_edges=rest_edges,
            surface=SURFACES[chamfer],
        )
        seen = np.array([len(cloud) > 0 for cloud in episode.clouds])
        if not seen.any():
            raise UserError(f"episode of {episode.band}: no camera frame shows the band")
        self._recorded = {
            "measured": _median(episode.force, median_window),
            "velocity": _median(episode.velocity, median_window),
            "frame_weights": 100 * (seen / seen.sum()),
        }
        self._copies: dict[str, tuple[csr_array, dict[str, wp.array]]] = {}
        self._lock = threading.Lock()

    @classmethod
    def of(
        cls, params: Settings, method: str | None, episode: Episode, sling: ClampedBand
    ) -> EpisodeLoss:
        """Make it from params.yaml's `loss`, `force` and `methods.<method>`.

        None: of geometry, of what the camera sees, and force alone, for a part of an episode.
        """
        plain = {"geom": 1.0, "force": 1.0, "work": 0.0}
        return cls(
            episode,
            radius=sling.radius,
            rest_edges=sling.edge_lengths,
            weights=dict(params.methods[method].weights) if method else plain,
            cutoff=cutoff_hz(params.force.cutoff, params.force.cutoff_unit),
            median_window=params.loss.median_window,
            chamfer=params.loss.chamfer if method else "symmetric",
        )

    def terms(self, rollouts: Rollouts) -> dict[str, np.ndarray]:
        """Loss terms of N rollouts, each of shape (N,); NaN or infinite where a rollout is.

        They are computed on the device that holds the rollouts. A rollout's terms are the same to
        the bit in any batch.
        """
        import warp as wp

        from sling2sim2real.base.native import empty, run_threads
        from sling2sim2real.identification.objective.kernels import terms_kernels

        line, force, device = rollouts.center_line, rollouts.force, _device_of(rollouts)
        count, samples, frames = len(force), len(self.time), len(self.chamfer.clouds)
        errors = self.chamfer.errors(line, device).reshape((count, frames, 2))
        double = force.dtype in (np.float64, wp.float64)
        filtered, terms = terms_kernels(wp.float64 if double else wp.float32)
        if isinstance(force, np.ndarray):
            force = wp.array(force, device=device)
        there = self._on(device, rollouts.times)
        simulated = empty((count, samples), wp.vec3d, device)
        rows = there["first"], there["columns"], there["values"]
        run_threads(filtered, (count, samples), [force, *rows, simulated], device)
        result = empty(count, wp.vec3d, device)
        recorded = there["measured"], there["velocity"], wp.float64(self.period)
        geom = errors, there["frame_weights"]
        inputs = [simulated, *recorded, *geom, self.median_window, result]
        run_threads(terms, count, inputs, device)
        return dict(zip(TERMS, result.numpy().T, strict=True))

    def total(self, terms: dict[str, np.ndarray]) -> np.ndarray:
        """Weighted sum of the terms, shape (N,); one without weight may be NaN."""
        weighed = (weight * terms[name] for name, weight in self.weights.items() if weight)
        return sum(weighed, np.zeros(()))

    def frames(self, rollouts: Rollouts) -> np.ndarray:
        """Chamfer distance of each camera frame [m], shape (N, K); NaN where it shows nothing."""
        return self.chamfer(rollouts.center_line, _device_of(rollouts))

    def _on(self, device: str, times: np.ndarray) -> dict[str, wp.array]:
        """What all rollouts share, there; the filter of other times replaces the last one."""
        import warp as wp

        start = float(self.time[0] - self.period / 2)
        with FILTER_LOCK:
            matrix = _recording_filter(
                times.tobytes(), self.cutoff, start, self.period, len(self.time)
            )
        with self._lock:
            kept, copies = self._copies.get(device, (None, {}))
            if kept is not matrix:
                rows = {"first": matrix.indptr, "columns": matrix.indices}
                kinds = {"measured": wp.vec3d, "velocity": wp.vec3d}
                copies = {
                    name: wp.array(array.astype(np.int32), device=device)
                    for name, array in rows.items()
                } | {
                    name: wp.array(array, dtype=kinds.get(name, wp.float64), device=device)
                    for name, array in {**self._recorded, "values": matrix.data}.items()
                }
                self._copies[device] = matrix, copies
            return copies


def _device_of(rollouts: Rollouts) -> str:
    line = rollouts.center_line
    return "cpu" if isinstance(line, np.ndarray) else str(line.device)


def _median(signal: np.ndarray, window: int) -> np.ndarray:
    """Median filter along the samples of (T, 3)."""
    from scipy.ndimage import median_filter

    return median_filter(signal, size=(window, 1), mode="nearest")


@lru_cache(maxsize=128)  # shared by all losses of an episode, such as the report's replays
def _recording_filter(
    stamps: bytes, cutoff: float, start: float, period: float, samples: int
) -> csr_array:
    """Matrix (T, S) from forces at simulated times (S,) to the episode's T filtered samples.

    It does what was done to the recorded force (interpolation, low-pass, averages), which is
    linear, and forgets: weights that no rounding would show are left out.
    """
    from scipy.sparse import csr_array

    weights = recording_matrix(np.frombuffer(stamps), cutoff, start, period, samples)
    return csr_array(np.where(np.abs(weights) > 1e-18, weights, 0))
