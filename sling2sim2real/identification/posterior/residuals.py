"""Signed residuals of a recording, smooth in the parameters: what least squares needs.

    force   measured less simulated, filtered alike                                       [N]
    cloud   mean offset of the points in a bin along the band from the simulated tube, in two
            components across it: `depth` towards the camera, `side` the other one        [m]

Which samples and pictures count is decided by time and by what the camera saw, before anything is
simulated (Rule): the force from the grasp to just before the release; pictures of the held band in
the last half second before it, and of the recoil's first 34 ms, or for want of one the first until
50 ms. Bins and directions are those of one reference rollout; a bin that shows too few points is
none.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from sling2sim2real.base.errors import UserError
from sling2sim2real.episode.episode import Episode
from sling2sim2real.simulator.interaction import Rollouts
from sling2sim2real.simulator.model import ClampedBand
from sling2sim2real.simulator.replay import recorded_force

BINS = 16  # along the band, equal at rest
LEAST_POINTS = 4  # of a bin
MOST_POINTS = 320  # of a picture that are looked at
EDGES_BESIDE = 4  # edges on each side of a bin's own on which its point's foot may lie
MEAN_VISIBLE_COSINE = 2 / np.pi  # mean of cos over the half of a tube that faces the camera


@dataclass(frozen=True)
class Rule:
    """Which samples and pictures count, in seconds from the release.

    Attributes:
        force_until: Samples of the force from the grasp until then.
        held: Pictures of the drawn band.
        recoil: Pictures of the recoil until then, of which a camera of 30 Hz has one: the later a
            picture, the more of what a law gets wrong has added up.
        latest: Where there is none, the first one until then: later ones show a slack band that
            swings about.
        least_share: Of the draw by which the band must still be behind the fork in those; where it
            is in none, the first one counts.
        bins: Of the recoil, first and end: nearer the clamps the band folds.
    """

    force_until: float = -0.06
    held: tuple[float, float] = (-0.5, -0.02)
    recoil: float = 0.034
    latest: float = 0.05
    least_share: float = 0.15
    bins: tuple[int, int] = (4, 12)

    def pictures(self, episode: Episode) -> np.ndarray:
        """Numbers of the pictures that count, shape (F,)."""
        time = episode.cloud_time - episode.release_time
        held = (time > self.held[0]) & (time < self.held[1])
        hand = episode.position[episode.time <= episode.release_time][-1:]
        drawn = self.behind_fork(hand)
        after = np.flatnonzero((time > 0) & (time <= self.latest))
        first = after[np.argsort(time[after])[:1]]
        early = after[time[after] <= self.recoil]
        far = [k for k in early if self.behind_fork(episode.clouds[k]) > self.least_share * drawn]
        recoil = far or first.tolist()
        return np.union1d(np.flatnonzero(held), recoil).astype(int)

    @staticmethod
    def behind_fork(points: np.ndarray) -> float:
        """How far the farthest twentieth of points (P, 3) is behind the fork [m]."""
        return -float(np.quantile(points[:, 1], 0.05)) if len(points) else 0.0

    def samples(self, episode: Episode) -> np.ndarray:
        """Numbers of the force's samples that count, shape (S,)."""
        until = episode.release_time + self.force_until
        return np.flatnonzero((episode.time > episode.grasp_time) & (episode.time < until))


@dataclass
class Residuals:
    """Residual vectors of rollouts, in the bins of a reference rollout.

    R residuals: force x, y, z at S samples, then depth and side of M bins. Raises UserError where
    no picture shows the band.

    Attributes:
        cutoff: Of the low-pass that the recorded force went through [Hz].
        reference: Centre lines of one rollout [m], shape (K, L, 3).
        samples: Numbers of the force's, shape (S,).
        picture: Of each bin, which picture's, shape (M,).
    """

    episode: Episode
    sling: ClampedBand
    cutoff: float
    reference: np.ndarray
    rule: Rule = field(default_factory=Rule)

    def __post_init__(self) -> None:
        self.samples = self.rule.samples(self.episode)
        self._edges = self.sling.edge_lengths
        self._bin(np.asarray(self.reference, float))

    @property
    def size(self) -> int:
        return 3 * len(self.samples) + 2 * len(self.picture)

    @property
    def recoils(self) -> np.ndarray:
        """Which bins (M,) are of the recoil."""
        return self.episode.cloud_time[self.picture] > self.episode.release_time

    def _bin(self, reference: np.ndarray) -> None:
        episode = self.episode
        place = np.append(0, np.cumsum(self._edges)) / self._edges.sum()
        binned = []
        for number in self.rule.pictures(episode):
            cloud = episode.clouds[number]
            if len(cloud) < LEAST_POINTS:
                continue
            points = np.asarray(cloud[:: -(-len(cloud) // MOST_POINTS)], float)
            line = reference[number]
            foot, edge, part = nearest(points, line)
            at = place[edge] + part * (place[edge + 1] - place[edge])
            bins = np.minimum((at * BINS).astype(int), BINS - 1)
            count = np.bincount(bins, minlength=BINS)
            good = np.flatnonzero(count >= LEAST_POINTS)
            if episode.cloud_time[number] > episode.release_time:
                good = good[(good >= self.rule.bins[0]) & (good < self.rule.bins[1])]
            mean = np.stack([np.bincount(bins, axis, BINS) for axis in points.T], 1)[good]
            mean /= count[good, None]
            step = np.diff(line, axis=0)
            length = np.linalg.norm(step, axis=1)
            tangent = step / length[:, None]
            radius = self.sling.radius * np.sqrt(self._edges / length)
            front = _across(episode.camera - foot, tangent[edge])
            offset = points - foot - MEAN_VISIBLE_COSINE * radius[edge, None] * front
            foot_of_mean, edge_of_mean, _ = nearest(mean, line)
            along = tangent[edge_of_mean]
            depth = _across(episode.camera - mean, along)
            seen = np.stack([np.bincount(bins, axis, BINS) for axis in offset.T], 1)[good]
            seen /= count[good, None]
            # what bending and tube add to a bin's mean point, as they do at the reference
            bias = (mean - foot_of_mean) - seen
            pictures = np.full(len(good), number)
            binned.append((pictures, edge_of_mean, mean, depth, np.cross(along, depth), bias))
        if not binned:
            raise UserError(
                f"episode of {episode.band}: no picture of the drawn band or of its recoil shows"
                f" {LEAST_POINTS} points of it; look at `sling check --sheet`, and at the keys of"
                " `cloud` in params.yaml"
            )
        columns = zip(*binned, strict=True)
        self.picture, edge, self.point, self.depth, self.side, bias = (
            np.concatenate(column) for column in columns
        )
        self._bias = np.stack([_dot(bias, self.depth), _dot(bias, self.side)])  # (2, M)
        window = edge[:, None] + np.arange(-EDGES_BESIDE, EDGES_BESIDE + 1)
        self._window = np.clip(window, 0, len(self._edges) - 1)

    def __call__(self, rollouts: Rollouts) -> np.ndarray:
        """Residual vectors of N rollouts, shape (N, R)."""
        force = recorded_force(rollouts, self.episode, self.cutoff)
        gap = (self.episode.force - force)[:, self.samples]
        line = np.asarray(rollouts.center_line, np.float32)
        point = self.point.astype(np.float32)[:, None]
        start = line[:, self.picture[:, None], self._window]  # (N, M, W, 3)
        step = line[:, self.picture[:, None], self._window + 1] - start
        start -= point
        part = -_dot(start, step) / np.maximum(_dot(step, step), 1e-12)
        start += np.clip(part, 0, 1)[..., None] * step  # from the point to its foot
        best = _dot(start, start).argmin(axis=2)
        offset = -np.take_along_axis(start, best[:, :, None, None], 2)[:, :, 0]  # (N, M, 3)
        cloud = [_dot(offset, self.depth) - self._bias[0], _dot(offset, self.side) - self._bias[1]]
        return np.concatenate([*gap.transpose(2, 0, 1), *cloud], axis=1).astype(float)

    def spread(self, force: float, cloud: float, recoil: float) -> np.ndarray:
        """Standard deviation of each residual, shape (R,).

        Args:
            force: Of a sample [N].
            cloud, recoil: Of a bin [m], and as a share of how far the middle has travelled.
        """
        bins = np.hypot(cloud, recoil * np.where(self.recoils, self.travelled(), 0.0))
        return np.concatenate([np.full(3 * len(self.samples), force), bins, bins])

    def travelled(self) -> np.ndarray:
        """How far the band's middle is from where it was drawn, as each bin saw it [m], shape (M,).

        Where no picture of the drawn band counts, the hand at the release says it.
        """
        episode, first = self.episode, self.rule.pictures(self.episode)[0]
        if episode.cloud_time[first] < episode.release_time:
            drawn = self.reference[first, self.sling.middle]
        else:
            drawn = episode.position[episode.time <= episode.release_time][-1]
        return np.linalg.norm(self.reference[self.picture, self.sling.middle] - drawn, axis=1)

    def columns(self, residuals: np.ndarray) -> dict[str, np.ndarray]:
        """How the residuals change with what moves all measured forces or points alike, (R,) each.

        force_bias_* [N], force_drift_* [N over the pull], force_gain: a share of the force,
        force_delay: the force's stamps against the pose's [s], cloud_shift_* [m], cloud_turn_*
        about the camera [rad].

        Args:
            residuals: Shape (R,), of the rollout whose force a gain or a delay is of. With the
                measured one a gain would explain a part of its noise, at the modulus's expense.
        """
        count, changes = len(self.samples), {}
        time = self.episode.time[self.samples]
        since = (time - time[0]) / (time[-1] - time[0])
        force = self.episode.force[self.samples] - residuals[: 3 * count].reshape(3, count).T
        for name, course in (("delay", np.gradient(force, time, axis=0)), ("gain", force)):
            changes[f"force_{name}"] = np.append(course.T.ravel(), np.zeros(2 * len(self.picture)))
        arm = self.point - self.episode.camera
        turned = np.cross(arm, self.depth), np.cross(arm, self.side)
        for axis, letter in enumerate("xyz"):
            for name, course in (("force_bias", 1.0), ("force_drift", since)):
                column = np.zeros(self.size)
                column[axis * count : (axis + 1) * count] = course
                changes[f"{name}_{letter}"] = column
            for name, (depth, side) in (
                ("cloud_shift", (self.depth, self.side)),
                ("cloud_turn", turned),
            ):
                column = np.zeros(self.size)
                column[3 * count :] = np.concatenate([depth[:, axis], side[:, axis]])
                changes[f"{name}_{letter}"] = column
        return changes

    def of_picture(self, number: int) -> np.ndarray:
        """Which residuals are of one picture, shape (R,) bool."""
        cloud = self.picture == number
        return np.concatenate([np.zeros(3 * len(self.samples), bool), cloud, cloud])


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("...c,...c->...", a, b)


def _across(towards: np.ndarray, tangent: np.ndarray) -> np.ndarray:
    """Unit part of `towards` across unit `tangent`, both (..., 3)."""
    towards = towards - _dot(towards, tangent)[..., None] * tangent
    return towards / np.linalg.norm(towards, axis=-1, keepdims=True)


def nearest(points: np.ndarray, line: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Feet (P, 3) of points on a line (L, 3), the edges (P,) they lie on, and where in them."""
    step = np.diff(line, axis=0)
    gap = points[:, None] - line[:-1]
    part = np.clip(_dot(gap, step) / np.maximum(_dot(step, step), 1e-12), 0, 1)
    foot = line[:-1] + part[..., None] * step
    offset = points[:, None] - foot
    edge = _dot(offset, offset).argmin(axis=1)
    row = np.arange(len(points))
    return foot[row, edge], edge, part[row, edge]
