"""Signed residuals of an episode, smooth in θ: what Gauss-Newton and a likelihood need.

The loss is no likelihood: its distances have no sign, its frames and samples no variance. Here

    force   measured less simulated, filtered alike, no median                     [N]
    cloud   mean offset of the points in a bin along the band from the simulated tube, in two
            components across it: `depth` towards the camera, `side` the other one  [m]

Bins and directions are those of one reference rollout, so that residuals of all others have the
same shape; a bin that shows too few points is none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.episode.episode import Episode
from pipeline.episode.phases import phases, reach
from pipeline.episode.signal import as_recorded

BINS = 16  # along the band, equal at rest
LEAST_POINTS = 4  # of a bin
MOST_POINTS = 320  # of a frame that are looked at
WINDOW = 4  # edges on each side of a bin's own on which its point's foot may lie
VISIBLE = 2 / np.pi  # mean of cos over the half of a tube that faces the camera
PHASES = ("slack", "taut", "recoil", "swing")
DRAWN = (0.33, 0.67, 0.95)  # of the way from taut to the farthest: parts of the taut phase
LATER = (0.1, 0.2, 0.4)  # after the recoil: parts of the swing, which goes astray with time [s]
HELD = (0.05, 0.5)  # before the release: when the hand holds the drawn band still [s]


@dataclass(frozen=True)
class Group:
    """Residuals of one channel in one phase, which share a variance.

    Attributes:
        channel: force_x, force_y, force_z, cloud_depth or cloud_side.
        phase: slack, taut, recoil or swing.
        part: Of the taut phase, by how far the band is drawn, and of the swing, by time.
        rows: Their places in the residual vector, shape (R,).
        grid: Of each, when (sample or frame) and where (bin; 0 of a force), shape (R, 2).
    """

    channel: str
    phase: str
    part: int
    rows: np.ndarray
    grid: np.ndarray


class Residuals:
    """Residual vectors of rollouts, in the bins of a reference rollout."""

    def __init__(self, episode: Episode, sling, cutoff: float, reference: np.ndarray) -> None:
        """Sort the measured points into bins of the reference.

        Args:
            cutoff: Of the low-pass that the recorded force went through [Hz].
            reference: Centre lines of one rollout [m], shape (K, L, 3).
        """
        self.episode, self.cutoff = episode, cutoff
        self._edges = sling.edge_lengths
        self._bin(sling, np.asarray(reference, float))
        self._samples = self._force_samples()
        self.groups = self._groups()
        self.size = 3 * len(self._samples) + 2 * len(self.frame)

    def _bin(self, sling, reference: np.ndarray) -> None:
        episode = self.episode
        place = np.append(0, np.cumsum(self._edges)) / self._edges.sum()
        found = []
        for number, cloud in enumerate(episode.clouds):
            if len(cloud) < LEAST_POINTS:
                continue
            points = np.asarray(cloud[:: -(-len(cloud) // MOST_POINTS)], float)
            line = reference[number]
            foot, edge, part = _nearest(points, line)
            bins = np.minimum((_between(place, edge, part) * BINS).astype(int), BINS - 1)
            count = np.bincount(bins, minlength=BINS)
            good = np.flatnonzero(count >= LEAST_POINTS)
            if not len(good):
                continue
            mean = np.stack([np.bincount(bins, axis, BINS) for axis in points.T], 1)[good]
            mean /= count[good, None]
            step = np.diff(line, axis=0)
            length = np.linalg.norm(step, axis=1)
            tangent = step / length[:, None]
            radius = sling.radius * np.sqrt(self._edges / length)
            front = _across(episode.camera - foot, tangent[edge])
            offset = points - foot - VISIBLE * radius[edge, None] * front
            foot_of_mean, edge_of_mean, _ = _nearest(mean, line)
            along = tangent[edge_of_mean]
            depth = _across(episode.camera - mean, along)
            side = np.cross(along, depth)
            seen = np.stack([np.bincount(bins, axis, BINS) for axis in offset.T], 1)[good]
            seen /= count[good, None]
            # what bending and tube add to a bin's mean point, as they do at the reference
            bias = (mean - foot_of_mean) - seen
            frames = np.full(len(good), number)
            found.append((frames, good, edge_of_mean, mean, depth, side, bias))
        columns = zip(*found, strict=True)
        self.frame, self.bin, edge, self.point, self.depth, self.side, bias = (
            np.concatenate(column) for column in columns
        )
        self._bias = np.stack([_dot(bias, self.depth), _dot(bias, self.side)])  # (2, M)
        window = edge[:, None] + np.arange(-WINDOW, WINDOW + 1)
        self._window = np.clip(window, 0, len(self._edges) - 1)

    def _force_samples(self) -> np.ndarray:
        """Samples from the grasp until the release is forgotten: later ones hold no band."""
        episode = self.episode
        end = episode.release_time + reach(episode.sample_period, self.cutoff, 1)
        return np.flatnonzero((episode.time > episode.grasp_time) & (episode.time < end))

    def _groups(self) -> list[Group]:
        count, points = len(self._samples), len(self.frame)
        near = reach(self.episode.sample_period, self.cutoff, 1)
        # the recoil is the drop, whose filtered end may outlast it: one sample is no swing
        phase, part = self._phase(self.episode.time[self._samples], near)
        phase, part = np.where(phase == 3, (2 + 0 * phase, 0 * part), (phase, part))
        groups = []
        for number, channel in enumerate(("force_x", "force_y", "force_z")):
            grid = np.stack([self._samples, 0 * self._samples], axis=1)
            groups += _split(channel, number * count, grid, phase, part)
        phase, part = self._phase(self.episode.cloud_time[self.frame], 0.0)
        for number, channel in enumerate(("cloud_depth", "cloud_side")):
            grid = np.stack([self.frame, self.bin], axis=1)
            groups += _split(channel, 3 * count + number * points, grid, phase, part)
        return groups

    def _phase(self, time: np.ndarray, early: float) -> tuple[np.ndarray, np.ndarray]:
        """Number of phase and part of times (T,); the recoil begins by `early` sooner."""
        bounds, episode = phases(self.episode), self.episode
        taut, release, end = (bounds[name][0] for name in PHASES[1:])
        number = np.searchsorted([taut, release - early, end], time)
        distance = np.linalg.norm(episode.position[:, 1:], axis=1)
        inside = (episode.time > taut) & (episode.time < release)
        low, high = distance[inside].min(), distance[inside].max()
        drawn = (np.interp(time, episode.time, distance) - low) / (high - low)
        part = np.where(number == 1, np.searchsorted(DRAWN, drawn), 0)
        later = np.searchsorted(LATER, time - end)
        return number, np.where(number == 3, later, part)

    def __call__(self, rollouts) -> np.ndarray:
        """Residual vectors of N rollouts, shape (N, R)."""
        gap = (self.episode.force - self.force(rollouts))[:, self._samples]
        line = np.asarray(rollouts.center_line, np.float32)
        point = self.point.astype(np.float32)[:, None]
        start = line[:, self.frame[:, None], self._window]  # (N, M, W, 3)
        step = line[:, self.frame[:, None], self._window + 1] - start
        start -= point
        part = -_dot(start, step) / np.maximum(_dot(step, step), 1e-12)
        start += np.clip(part, 0, 1)[..., None] * step  # from the point to its foot
        best = _dot(start, start).argmin(axis=2)
        offset = -np.take_along_axis(start, best[:, :, None, None], 2)[:, :, 0]  # (N, M, 3)
        cloud = [_dot(offset, self.depth) - self._bias[0], _dot(offset, self.side) - self._bias[1]]
        return np.concatenate([*gap.transpose(2, 0, 1), *cloud], axis=1).astype(float)

    def force(self, rollouts) -> np.ndarray:
        """Of N rollouts on the gripper, as the recorded one was filtered [N], shape (N, T, 3)."""
        episode = self.episode
        steps = np.moveaxis(np.asarray(rollouts.force, float), 0, 1)  # (S, N, 3)
        sampling = episode.time[0] - episode.sample_period / 2, episode.sample_period
        force = as_recorded(rollouts.times, steps, self.cutoff, *sampling, len(episode.time))
        return np.moveaxis(force, 1, 0)

    def hold_force(self, vectors: np.ndarray) -> np.ndarray:
        """Simulated force of the drawn band on the hand [N], (N,), of residual vectors (N, R)."""
        count = len(self._samples)
        until = self.episode.release_time - self.episode.time[self._samples]
        held = np.flatnonzero((until > HELD[0]) & (until < HELD[1]))
        gap = vectors[:, : 3 * count].reshape(-1, 3, count)[:, :, held]
        force = self.episode.force[self._samples[held]].T - gap
        return np.linalg.norm(force.mean(axis=2), axis=1)

    def columns(self) -> dict[str, np.ndarray]:
        """How the residuals change with what moves all measured forces or points alike, (R,) each.

        force_bias_* [N], cloud_shift_* [m], cloud_turn_* about the camera [rad].
        """
        count, points = len(self._samples), len(self.frame)
        changes = {}
        arm = self.point - self.episode.camera
        turned = np.cross(arm, self.depth), np.cross(arm, self.side)
        for axis, letter in enumerate("xyz"):
            bias = np.zeros(self.size)
            bias[axis * count : (axis + 1) * count] = 1
            changes[f"force_bias_{letter}"] = bias
            for name, (depth, side) in (
                ("cloud_shift", (self.depth, self.side)),
                ("cloud_turn", turned),
            ):
                column = np.zeros(self.size)
                column[-2 * points : -points], column[-points:] = depth[:, axis], side[:, axis]
                changes[f"{name}_{letter}"] = column
        return changes

    def of_frame(self, number: int) -> np.ndarray:
        """Which residuals are of one camera frame, shape (R,) bool."""
        cloud = self.frame == number
        return np.concatenate([np.zeros(self.size - 2 * len(cloud), bool), cloud, cloud])


def _split(channel: str, first: int, grid: np.ndarray, phase: np.ndarray, part: np.ndarray):
    """Groups of a channel whose residuals begin at `first`."""
    pairs = sorted(set(zip(phase.tolist(), part.tolist(), strict=True)))
    rows = [np.flatnonzero((phase == one) & (part == two)) for one, two in pairs]
    return [
        Group(channel, PHASES[one], two, first + mine, grid[mine])
        for (one, two), mine in zip(pairs, rows, strict=True)
    ]


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("...c,...c->...", a, b)


def _across(towards: np.ndarray, tangent: np.ndarray) -> np.ndarray:
    """Unit part of `towards` across unit `tangent`, both (..., 3)."""
    towards = towards - _dot(towards, tangent)[..., None] * tangent
    return towards / np.linalg.norm(towards, axis=-1, keepdims=True)


def _nearest(points: np.ndarray, line: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Feet (P, 3) of points on a line (L, 3), the edges (P,) they lie on, and where in them."""
    step = np.diff(line, axis=0)
    gap = points[:, None] - line[:-1]
    part = np.clip(_dot(gap, step) / np.maximum(_dot(step, step), 1e-12), 0, 1)
    foot = line[:-1] + part[..., None] * step
    offset = points[:, None] - foot
    edge = _dot(offset, offset).argmin(axis=1)
    row = np.arange(len(points))
    return foot[row, edge], edge, part[row, edge]


def _between(place: np.ndarray, edge: np.ndarray, part: np.ndarray) -> np.ndarray:
    return place[edge] + part * (place[edge + 1] - place[edge])
