"""How far a simulated interaction is from the recorded one.

    geom   mean over camera frames of the Chamfer distance                              [cm]
    force  mean over samples of |f_real - f_sim|                                        [N]
    work   | sum of trapezoids of (f_real - f_sim) . v over the whole episode |         [J]
    taut   geom over the frames in which the released band is still taut                [cm]

The first three are the paper's, with its constants read as 1/(T 1 cm), 1/(T 1 N) and 1/(1 J). The
fourth is ours: after the recoil the band swings slack, and frames of that swing, many and alike,
drown the few that show the damping. docs/method.md says more.

Blocks of the recording can be held out: they count in `held_out_terms` alone. Nuisances
(nuisance.py) act on the simulated side before it is compared.
"""

from __future__ import annotations

import threading
from functools import lru_cache

import numpy as np
from scipy.ndimage import median_filter
from scipy.sparse import csr_array

from pipeline.base.errors import UserError
from pipeline.episode.episode import Episode
from pipeline.episode.phases import held_out_blocks, reach, taut_frames, within
from pipeline.episode.signal import as_recorded, cutoff_hz
from pipeline.objective.chamfer import Chamfer
from pipeline.objective.device_terms import DeviceTerms
from pipeline.objective.nuisance import AIR_DRAG, Delay, DelayedFrames, along_axes

TERMS = ("geom", "force", "work", "taut")
LOCK = threading.Lock()  # while a filter is made, which takes a second

Nuisances = dict[str, np.ndarray] | None


class EpisodeLoss:
    """The loss of one episode, for batches of rollouts.

    Attributes:
        stamps: Those of the frames that a rollout must hold [s], shape (K',): the camera's (K,), or
            more of them where camera_delay is a nuisance.
        fitted_samples, held_samples: Which samples `terms` and `held_out_terms` are of, (T,) bool.
        fitted_frames, held_frames: The same of the camera frames, shape (K,).
    """

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
        nuisances: dict[str, tuple[float, float]] | None = None,
        held_out: np.ndarray | None = None,
    ) -> None:
        """Prepare the recorded side.

        Args:
            radius, rest_length: Of the unstretched band [m]; the length whole or by edges.
            weights: Of each of TERMS; a term that weighs nothing is still computed.
            cutoff: Of the low-pass that the recorded force went through [Hz].
            median_window: Samples of the median filter on forces and velocity, odd.
            symmetric: Chamfer distance both ways, or measured to simulated alone.
            frame_cap: No frame counts for more than this [m].
            nuisances: Bounds of those that rollouts will come with.
            held_out: Begin and end [s] of blocks that are not fitted, shape (B, 2). Samples nearer
                to them than the force's filters reach count nowhere; clouds pass no filter.

        Raises:
            UserError: No cloud has points, or `taut` has weight and no frame is in the recoil.
        """
        self.weights = {name: float(weights[name]) for name in TERMS}
        self.frame_cap = np.inf if frame_cap is None else frame_cap
        self.median_window = median_window
        self.cutoff = cutoff
        self.time, self.period = episode.time, episode.sample_period
        self.velocity = self.smooth(episode.velocity)
        self.force = self.smooth(episode.force)
        self.chamfer = Chamfer(
            episode.clouds,
            episode.camera,
            radius=radius,
            rest_length=rest_length,
            symmetric=symmetric,
        )
        bounds = nuisances or {}
        self._force_delay = Delay(bounds.get("force_delay"))
        self._delayed = DelayedFrames(episode.cloud_time, bounds.get("camera_delay"))
        self.stamps = self._delayed.stamps if "camera_delay" in bounds else episode.cloud_time
        blocks = np.zeros((0, 2)) if held_out is None else np.asarray(held_out, float)
        guard = reach(self.period, cutoff, median_window)
        seen = np.array([len(cloud) > 0 for cloud in episode.clouds])
        self.fitted_samples = ~within(self.time, blocks, guard)
        self.held_samples = within(self.time, blocks)
        self.fitted_frames = ~within(episode.cloud_time, blocks) & seen
        self.held_frames = within(episode.cloud_time, blocks) & seen
        self.taut = taut_frames(episode) & self.fitted_frames
        pull = np.array([[episode.grasp_time, episode.release_time - guard]])
        self._pull = within(self.time, pull), within(episode.cloud_time, pull)
        self._on_device = DeviceTerms(
            self.chamfer,
            force=self.force,
            velocity=self.velocity,
            window=median_window,
            sample_weights=np.stack([_mean(self.fitted_samples), self._trapezoids()]),
            frame_weights=100 * np.stack([_mean(self.fitted_frames), _mean(self.taut)]),
            frame_cap=self.frame_cap,
        )
        if not self.fitted_frames.any():
            raise UserError(f"episode of {episode.band}: no camera frame shows the band")
        if self.weights["taut"] and not self.taut.any():
            raise UserError(
                f"episode of {episode.band}: no camera frame between the release and the fork"
                " plane; choose a method whose weights.taut is 0"
            )

    @classmethod
    def of(cls, params, method: str, episode: Episode, sling) -> EpisodeLoss:
        """Make it from params.yaml's `loss`, `force` and `methods.<method>`."""
        cutoff = cutoff_hz(params.force.cutoff, params.force.cutoff_unit)
        held = params.loss.held_out
        guard = reach(episode.sample_period, cutoff, params.loss.median_window)
        return cls(
            episode,
            radius=sling.radius,
            rest_length=sling.edge_lengths,
            weights=dict(params.methods[method].weights),
            cutoff=cutoff,
            median_window=params.loss.median_window,
            symmetric=params.loss.chamfer == "symmetric",
            nuisances=params.methods[method].nuisances,
            held_out=held_out_blocks(episode, held.blocks, held.length, guard),
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

    def terms(self, rollouts, nuisances: Nuisances = None) -> dict[str, np.ndarray]:
        """Each term of N rollouts, shape (N,); NaN or infinite where a rollout is.

        `taut` is NaN where the episode has no frame in the recoil. Clouds are compared on the
        device that holds the rollouts; so is all else of rollouts that are Warp arrays, unless
        there are nuisances of instruments. A rollout's terms are the same to the bit in any batch.

        Args:
            nuisances: Values of each that there is, shape (N,).
        """
        if not isinstance(rollouts.force, np.ndarray) and not set(nuisances or ()) - {AIR_DRAG}:
            found = self._on_device(rollouts, self._filters(rollouts.times)[0])
            some = [self.fitted_frames.any(), self.fitted_samples.any(), True, self.taut.any()]
            return dict(zip(TERMS, np.where(some, found, np.nan).T, strict=True))
        gap = self._gap(rollouts, nuisances)
        frames = self.frames(rollouts, nuisances)
        power = np.einsum("ntc,tc->nt", gap, self.velocity)
        both = self.fitted_samples[:-1] & self.fitted_samples[1:]  # ends of a trapezoid
        work = (power[:, :-1] + power[:, 1:]).compress(both, axis=1).sum(axis=1)
        return {
            "geom": self._centimetres(frames, self.fitted_frames),
            "force": self._newtons(gap, self.fitted_samples),
            "work": np.abs(work) / 2 * self.period,
            "taut": self._centimetres(frames, self.taut),
        }

    def held_out_terms(self, rollouts, nuisances: Nuisances = None) -> dict[str, np.ndarray]:
        """`geom` [cm] and `force` [N] of the held-out blocks alone, shape (N,); NaN without any."""
        return {
            "geom": self._centimetres(self.frames(rollouts, nuisances), self.held_frames),
            "force": self._newtons(self._gap(rollouts, nuisances), self.held_samples),
        }

    def residuals(self, rollouts, nuisances: Nuisances = None) -> dict[str, dict[str, np.ndarray]]:
        """Fitted against held-out between grasp and release: `force` [N] and `cloud` [cm], (N,)."""
        gap, frames = self._gap(rollouts, nuisances), self.frames(rollouts, nuisances)
        samples, pictures = self._pull
        return {
            "force": {
                "fitted": self._newtons(gap, samples & self.fitted_samples),
                "held_out": self._newtons(gap, self.held_samples),
            },
            "cloud": {
                "fitted": self._centimetres(frames, pictures & self.fitted_frames),
                "held_out": self._centimetres(frames, self.held_frames),
            },
        }

    def total(self, terms: dict[str, np.ndarray]) -> np.ndarray:
        """Weighted sum of the terms, shape (N,); one without weight may be NaN."""
        return sum(weight * terms[name] for name, weight in self.weights.items() if weight)

    def filtered(self, rollouts, nuisances: Nuisances = None) -> np.ndarray:
        """The simulated force as the record would have it [N], shape (N, T, 3), before `smooth`."""
        nuisances = nuisances or {}
        force = rollouts.force
        force = force if isinstance(force, np.ndarray) else force.numpy()
        force = force.transpose(1, 0, 2)  # (S, N, 3)
        filters = self._filters(rollouts.times)
        delay = nuisances.get("force_delay")
        if delay is None:
            force = _through(filters[0], force)
        else:
            below, part = self._force_delay.between(delay)
            weight = np.zeros((len(filters), len(delay)))
            weight[below, np.arange(len(delay))] = 1 - part
            weight[below + 1, np.arange(len(delay))] = part
            force = sum(
                one[:, None, None] * _through(matrix, force)
                for one, matrix in zip(weight, filters, strict=True)
            )
        if "force_gain" in nuisances:
            force = nuisances["force_gain"][:, None, None] * force
        bias = along_axes(nuisances, "force_bias")
        return force if bias is None else force + bias[:, None]

    def frames(self, rollouts, nuisances: Nuisances = None) -> np.ndarray:
        """Chamfer distance of each camera frame [m], shape (N, K); NaN where it shows nothing."""
        nuisances = nuisances or {}
        line = rollouts.center_line
        device = "cpu" if isinstance(line, np.ndarray) else str(line.device)
        delay, shift = nuisances.get("camera_delay"), along_axes(nuisances, "cloud_shift")
        if delay is not None or shift is not None:
            line = line if isinstance(line, np.ndarray) else line.numpy()
        if delay is not None:
            line = self._delayed(line, delay)
        if shift is not None:
            line = line + shift[:, None, None].astype(line.dtype)
        return np.minimum(self.chamfer(line, device), self.frame_cap)

    def smooth(self, signal: np.ndarray) -> np.ndarray:
        """Median filter along the samples of (..., T, 3)."""
        window = (1,) * (signal.ndim - 2) + (self.median_window, 1)
        return median_filter(signal, size=window, mode="nearest")

    def _gap(self, rollouts, nuisances: Nuisances) -> np.ndarray:
        """Measured less simulated force [N], shape (N, T, 3)."""
        return self.force - self.smooth(self.filtered(rollouts, nuisances))

    def _trapezoids(self) -> np.ndarray:
        """What each sample's power adds to the work [s], shape (T,)."""
        both = self.fitted_samples[:-1] & self.fitted_samples[1:]
        return self.period / 2 * (np.append(both, False) + np.append(False, both).astype(float))

    def _newtons(self, gap: np.ndarray, samples: np.ndarray) -> np.ndarray:
        size = np.linalg.norm(gap, axis=2).compress(samples, axis=1)
        return size.mean(axis=1) if samples.any() else np.full(len(gap), np.nan)

    def _centimetres(self, frames: np.ndarray, chosen: np.ndarray) -> np.ndarray:
        nothing = np.full(len(frames), np.nan)
        if not chosen.any():
            return nothing
        # not frames[:, chosen]: its order in memory, and so the sum's, would hang on N
        return 100 * frames.compress(chosen, axis=1).mean(axis=1)

    def _filters(self, times: np.ndarray) -> list[csr_array]:
        """Of forces at simulated times (S,), one for every simulated delay."""
        starts = tuple((self.time[0] - self.period / 2 - self._force_delay.values).tolist())
        with LOCK:
            return [
                _recording_filter(times.tobytes(), self.cutoff, start, self.period, len(self.time))
                for start in starts
            ]


def _mean(chosen: np.ndarray) -> np.ndarray:
    """Weights of a mean over what is chosen, shape (T,); all 0 where nothing is."""
    return chosen / max(chosen.sum(), 1)


@lru_cache(maxsize=128)  # shared by all losses of an episode, such as the report's replays
def _recording_filter(
    times: bytes, cutoff: float, start: float, period: float, samples: int
) -> csr_array:
    """Matrix (T, S) from forces at simulated times (S,) to the episode's T filtered samples.

    It is the recorded force's way (interpolation, low-pass, averages), which is linear, and
    forgets: weights that no rounding would show are left out.
    """
    times, parts = np.frombuffer(times), []
    for first in range(0, len(times), 32):
        pulses = np.eye(len(times), min(32, len(times) - first), -first)
        parts.append(as_recorded(times, pulses, cutoff, start, period, samples))
    weights = np.hstack(parts)
    return csr_array(np.where(np.abs(weights) > 1e-18, weights, 0))


def _through(matrix: csr_array, force: np.ndarray) -> np.ndarray:
    """Forces (S, N, 3) through a filter (T, S), shape (N, T, 3)."""
    steps, count, _ = force.shape
    return (matrix @ force.reshape(steps, -1)).reshape(-1, count, 3).transpose(1, 0, 2)
