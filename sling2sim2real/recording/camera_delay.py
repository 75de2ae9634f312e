"""The camera's delay against the pose, by where the hand is seen: ICP over a time offset.

A late picture shows the hand where it was. Its points, laid over those of pictures in which the
hand rests (`icp`), are off by the velocity times the delay; what they are off by place is a matter
of the extrinsics and is fitted beside it, by weighted least squares. The delay's error is that of a
jackknife over blocks of time. No model of the hand is needed, but it must be rigid and turn as the
pose says.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree  # pyright: ignore[reportAttributeAccessIssue]
from scipy.spatial.transform import Rotation

from sling2sim2real.recording.events import Pull
from sling2sim2real.recording.force import LONGEST
from sling2sim2real.recording.motion import interpolated
from sling2sim2real.recording.release_pictures import points_near

FEWEST = 100  # points of a body that is seen
NEIGHBOURS = 12  # by which the normal at a point is told
FLAT = 0.1  # of the variances of neighbours across and along a surface
NEAREST = 0.02, 0.01, 0.004, 0.004, 0.004  # m between points laid on each other, by round
BLOCKS = 8  # of time, for errors by leaving one out
FRAMES = 144  # pictures looked at
REST = 4  # pictures with the slowest hand, at each end of the way
PALM, REACH = 0.08, 0.13  # m: what is looked at around a point so far behind the tool centre point
ROOM = 1.3  # times REACH, in which points of the hand are kept: the pose may be late
FINGERTIPS = 0.015  # m behind the tool centre point that are left to the band
POINTS = 500  # of the hand in a picture
SCATTER = 0.0003  # m from picture to picture, against which the next is weighed
ASKEW = 0.02  # m that wrong extrinsics may displace a metre of way
WORST = 0.001  # m from picture to picture that is left: else it is no rigid hand
SEEN = 0.8  # share of the pictures in which the hand must be found
ROUNDS, CLOSE = 4, 3e-4  # s


def camera_delay(pull: Pull) -> tuple[float, float] | None:
    """Delay and its standard error [s]; None where the hand is not seen well enough.

    Both halves of the way are solved apart, from the last delay on, until neither moves it; the
    error counts how far they differ.
    """
    times, pictures = _hands(pull)
    if len(pictures) < 2 * BLOCKS:
        return None
    motion = pull.motion
    grid, _, velocity = motion.velocity()
    delay, steps, errors = 0.0, np.zeros(2), np.full(2, np.inf)
    for _ in range(ROUNDS):
        at = times - delay
        turns, hands = motion.orientation(at), motion.position(at)
        speed = interpolated(at, grid, velocity)
        points = [
            _behind(turn.inv().apply(seen - hand))
            for turn, hand, seen in zip(turns, hands, pictures, strict=True)
        ]
        first = np.arange(len(at)) < len(at) / 2
        halves = [_step(points, turns, hands, speed, part) for part in (first, ~first)]
        if None in halves:
            return None
        steps, errors = np.array(halves).T
        delay += float(steps.mean())
        if abs(delay) > LONGEST:
            return None
        if abs(steps.mean()) < CLOSE:
            break
    return delay, float(np.hypot(errors.max(), np.ptp(steps) / 2))


def _hands(pull: Pull) -> tuple[np.ndarray, list[np.ndarray]]:
    """Stamps [s] of pictures while the band is held, and points around the hand in each, (P, 3)."""
    recording = pull.recording
    stamps = recording.depth.seconds(recording.origin)
    held = (stamps > pull.grasp + LONGEST) & (stamps < pull.release.time - LONGEST)
    used = np.flatnonzero(held)
    if len(used) < 2 * BLOCKS:
        return np.zeros(0), []
    used = used[np.linspace(0, len(used) - 1, min(FRAMES, len(used))).round().astype(int)]
    rays, random = recording.depth_camera.rays().astype(np.float32), np.random.default_rng(0)
    seen = [(k, random.permutation(_hand(pull, rays, k, float(stamps[k])))) for k in used]
    seen = [(k, points) for k, points in seen if len(points) >= FEWEST]
    return stamps[[k for k, _ in seen]], [points for _, points in seen]


def _hand(pull: Pull, rays: np.ndarray, k: int, time: float) -> np.ndarray:
    """Points around the hand in picture k, frame O, (P, 3); none where it does not show the hand.

    Args:
        rays: Of the depth camera, shape (H, W, 3).
    """
    depth = pull.recording.depth_picture(k)
    if depth is None:
        return np.zeros((0, 3))
    palm = pull.motion.position(time) + pull.motion.orientation(time).apply([0, 0, -PALM])
    points = points_near(pull, rays, depth, palm[None], ROOM * REACH)
    return points[np.linalg.norm(points - palm, axis=1) < ROOM * REACH]


def _behind(points: np.ndarray) -> np.ndarray:
    """Points of the hand without its fingertips and the band, in the hand's frame."""
    away = np.linalg.norm(points + [0, 0, PALM], axis=1)
    return points[(away < REACH) & (points[:, 2] < -FINGERTIPS)]


def _step(
    points: list[np.ndarray],
    turns: Rotation,
    hands: np.ndarray,
    speed: np.ndarray,
    part: np.ndarray,
) -> tuple[float, float] | None:
    """Delay and error that are left, against the slowest pictures of one part of the way.

    Each picture gives three equations, weighed by what its surface tells: its displacement is that
    of the hand as a whole (3 unknowns), of wrong extrinsics by place (9, with a prior) and of the
    delay by the velocity (1).

    Args:
        points: Of the hand in each of K pictures, (P, 3) each, in the hand's frame.
        turns: K rotations of that frame into frame O.
        hands, speed: Tool centre point [m] and its velocity [m/s], both (K, 3).
        part: Which pictures belong to that part of the way, (K,).
    """
    slowest = np.flatnonzero(part)[np.argsort(np.linalg.norm(speed[part], axis=1))[:REST]]
    surface = Surface(np.vstack([points[i] for i in slowest]), 8 * POINTS)
    rows, wanted = [], []
    for i in range(len(points)):
        if i in slowest:
            continue
        laid = surface.lay(points[i][:POINTS])
        if laid is None:
            continue
        offset, root = laid
        turn = turns[i].as_matrix()
        root = root @ turn.T / SCATTER  # frame O
        place = hands[i] - hands[slowest].mean(axis=0)
        away = np.kron(np.eye(3), place)  # (3, 9): displacement by the extrinsics
        rows.append(root @ np.hstack([np.eye(3), away, speed[i][:, None]]))
        wanted.append(root @ turn @ offset)
    if len(rows) < SEEN * (len(points) - REST):
        return None
    rows, wanted = np.array(rows), np.array(wanted)  # (K, 3, 13), (K, 3)
    prior = np.zeros((9, 13))
    prior[:, 3:12] = np.eye(9) / ASKEW

    def solve(used: np.ndarray) -> np.ndarray:
        matrix = np.vstack([rows[used].reshape(-1, 13), prior])
        right = np.concatenate([wanted[used].ravel(), np.zeros(9)])
        return np.linalg.lstsq(matrix, right, rcond=None)[0]

    everything = np.arange(len(rows))
    best = solve(everything)
    left = (rows @ best - wanted) * SCATTER
    if np.sqrt(np.mean(np.sum(left**2, axis=1))) > WORST:
        return None
    blocks = np.array_split(everything, BLOCKS)
    parts = np.array([-solve(np.setdiff1d(everything, block))[-1] for block in blocks])
    error = np.sqrt((BLOCKS - 1) / BLOCKS * np.sum((parts - parts.mean()) ** 2))  # jackknife
    return -best[-1], float(error)


class Surface:
    """Points of a rigid body with their normals, on which others are laid.

    Args:
        points: Shape (P, 3) [m].
        most: Of them that are kept.
    """

    def __init__(self, points: np.ndarray, most: int):
        self.tree: cKDTree | None = None
        if len(points) < FEWEST:
            return
        points = np.random.default_rng(0).permutation(points)[:most]
        _, index = cKDTree(points).query(points, k=NEIGHBOURS)
        around = points[index] - points[index].mean(axis=1, keepdims=True)
        spread, axes = np.linalg.eigh(np.einsum("nki,nkj->nij", around, around))
        flat = spread[:, 0] < FLAT * spread[:, 1]
        self.points, self.normals = points[flat], axes[flat, :, 0]
        if len(self.points) >= FEWEST:
            self.tree = cKDTree(self.points)

    def lay(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """Displacement of points (P, 3), and the root of its information, (3,) and (3, 3).

        Both are per point; the information is small where a surface could slide along itself. None
        where too little of the surface is seen.
        """
        if self.tree is None:
            return None
        offset, sure = np.zeros(3), np.zeros((3, 3))
        for most in NEAREST:
            distance, index = self.tree.query(points - offset, distance_upper_bound=most)
            near = np.isfinite(distance)
            if near.sum() < FEWEST:
                return None
            normals = self.normals[index[near]]
            across = points[near] - offset - self.points[index[near]]
            sure = normals.T @ normals / len(normals)
            gap = np.einsum("ij,ij->i", normals, across)
            offset = offset + np.linalg.lstsq(sure, normals.T @ gap / len(gap), rcond=0.02)[0]
        return offset, np.linalg.cholesky(sure + 1e-6 * np.eye(3)).T
