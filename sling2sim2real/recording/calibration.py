"""How far camera and hand are off from where they are said to be, by the drawn band.

The drawn band is two nearly straight lines, from each fork tip to the hand. A camera that is
misplaced moves all of them alike; a hand that is misplaced moves their common end and leaves the
tips. At different draws the lines turn about the tips, and so the two come apart. Before the grasp
the band hangs in the plane through the tips.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sling2sim2real.recording.force import GRAVITY
from sling2sim2real.recording.motion import interpolated
from sling2sim2real.recording.scene import Scene

PULLED = 1.1  # least stretch: a band that is drawn less sags
CLEAR = (0.015, 0.045)  # m of each line left out at its tip (the clamp) and at the hand (fingers)
WITHIN = 3.5  # diameters from the line: what is further off is no band
FAST = 0.4  # m/s of the hand, from which the band swings, and a millisecond is half a millimetre
SPAN = 0.02  # s before and after a picture that tell its hand's speed
CELL = 0.01  # m of the hand's path whose pictures count as one: they share their errors
LEAST_FRAMES, LEAST_POINTS, MOST_POINTS = 5, 20, 150
SEEN = 0.7  # radii by which the middle of what is seen lies before the line
# What is fitted: shifts of the camera and of the hand [m]; beside them what widens the lines alike
# on both sides (the fingers' width, an error of the fork's) [m], how far the band's middle lies
# behind its surface [m], and the root of the band's stiffness in bending [sqrt(N) m].
MEAN = np.array([0, 0, 0, 0, 0, 0, 0.003, 0, 0, 0.015])
PRIOR = np.array([0.03, 0.03, 0.03, 0.01, 0.01, 0.01, 0.003, 0.002, 0.0005, 0.01])
HUNG = 4.0  # cells of the drawn band that the hanging band counts as
FREE = 0.15  # s before the grasp in which the hand may touch it
IN_PLANE = 0.1  # sine of the angle to the plane y = 0 that the clamps may have
ROUNDS, SHARP = 20, 1.345  # scales from which Huber's weights fall
LEAST_SCALE = 0.0003  # m
FLOOR = 0.001  # m: systematic errors of depth, fork and clamps that no repetition shows
LAW = 0.15  # of the bending at the tips that its law may be wrong by
SURE = 3.5  # standard errors from which one of several components is more than noise
MATTERS = 0.004  # m


@dataclass(frozen=True)
class Calibration:
    """What the drawn band says of the calibration, frame O, all in metres.

    Attributes:
        camera: Where the camera shows the fork tips, less where they are, shape (3,).
        camera_error: Standard errors, shape (3,).
        hand: Where the band's end in the hand is, less where the pose puts it, shape (3,).
        hand_error: Standard errors, shape (3,).
        residual: Median distance of points from where they are expected, along the sight.
        frames: Pictures that were used.
    """

    camera: np.ndarray
    camera_error: np.ndarray
    hand: np.ndarray
    hand_error: np.ndarray
    residual: float
    frames: int

    @property
    def is_off(self) -> bool:
        """The camera is off by more than noise, and enough to matter."""
        sure = np.where(np.abs(self.camera) > SURE * self.camera_error, self.camera, 0.0)
        return float(np.linalg.norm(sure)) > MATTERS

    @property
    def camera_off(self) -> tuple[float, float]:
        """Distance, and its standard error."""
        return _length(self.camera, self.camera_error)

    @property
    def hand_off(self) -> tuple[float, float]:
        """Distance, and its standard error."""
        return _length(self.hand, self.hand_error)


def _length(vector: np.ndarray, errors: np.ndarray) -> tuple[float, float]:
    length = float(np.linalg.norm(vector))
    return length, float(np.linalg.norm(vector * errors) / max(length, 1e-12))


@dataclass(frozen=True)
class _Picture:
    """Points of the band in one picture, and the line from tip to hand beside each.

    Attributes:
        points, tips, ways: Of each point, its line's beginning and direction, shape (P, 3).
        share: Of the way to the hand, shape (P,).
        sag: Of the band below its line [m], shape (P,).
        bend: Aside of it where its stiffness is 1, shape (P, 3).
        hand: Shape (3,).
        radius: Of the band [m].
    """

    points: np.ndarray
    tips: np.ndarray
    ways: np.ndarray
    share: np.ndarray
    sag: np.ndarray
    bend: np.ndarray
    hand: np.ndarray
    radius: float


def calibration_of(
    scene: Scene,
    times: np.ndarray,
    clouds: list[np.ndarray],
    eye: np.ndarray,
    mass: float,
    clamp: np.ndarray,
) -> Calibration | None:
    """Fit a shift of the clouds and one of the hand to all pictures of the drawn band.

    Args:
        scene: Tips, band, and where the hand is.
        times: Of the clouds [s], shape (K,).
        clouds: Frame O, K arrays of shape (P, 3).
        eye: Position of the depth camera, frame O, shape (3,).
        mass: Of the band [kg], by which it sags.
        clamp: How the band leaves the tips, frame O, shape (3,).

    Returns:
        None where too little of the drawn band is seen.
    """
    seen = [
        _seen(scene, time, cloud, mass, clamp) for time, cloud in zip(times, clouds, strict=True)
    ]
    pictures = [picture for picture in seen if picture is not None]
    if len(pictures) < LEAST_FRAMES:
        return None
    cells = np.round(np.array([picture.hand for picture in pictures]) / CELL)
    _, cells = np.unique(cells, axis=0, return_inverse=True)
    cells = cells.ravel()
    alike = np.bincount(cells)[cells]
    rows, off, weights, cell = [], [], [], []
    for k, picture in enumerate(pictures):
        matrix, gap = _equations(picture, eye)
        rows.append(matrix)
        off.append(gap)
        weights.append(np.full(len(gap), 1 / alike[k] / len(picture.points)))
        cell.append(np.full(len(gap), cells[k]))
    if abs(clamp[1]) < IN_PLANE:
        matrix, gap = _hanging(scene, times, clouds, eye)
        rows.append(matrix)
        off.append(gap)
        weights.append(np.full(len(gap), HUNG / max(len(gap), 1)))
        cell.append(np.full(len(gap), cells.max() + 1))
    rows, off, weights = np.concatenate(rows), np.concatenate(off), np.concatenate(weights)
    state, errors, left = _fit(rows, off, weights, np.concatenate(cell))
    tip = np.median(
        [np.linalg.norm(picture.bend[picture.share < 0.5], axis=1).max() for picture in pictures]
    )
    errors[:3] = np.hypot(errors[:3], np.hypot(FLOOR, LAW * state[9] * tip * np.abs(clamp)))
    errors[3:6] = np.hypot(errors[3:6], FLOOR)
    pairs = 2 * sum(len(picture.points) for picture in pictures)
    residual = float(np.median(np.abs(left[:pairs:2])))
    return Calibration(-state[:3], errors[:3], state[3:6], errors[3:6], residual, len(pictures))


def _seen(
    scene: Scene, time: float, cloud: np.ndarray, mass: float, clamp: np.ndarray
) -> _Picture | None:
    """What one picture shows of the drawn band; None where it is too little, or moves fast."""
    signals = scene.signals
    if not (scene.taut(time) and scene.stretch(time) > PULLED and len(cloud)):
        return None
    before, hand, after = (signals.hand(time + late) for late in (-SPAN, 0.0, SPAN))
    if np.linalg.norm(after - before) > 2 * SPAN * FAST:
        return None
    ways = hand - scene.tips
    lengths = np.linalg.norm(ways, axis=1)
    ways = ways / lengths[:, None]
    tension = np.linalg.norm(interpolated(time, signals.time, signals.force))
    tension /= np.linalg.norm(ways.sum(axis=0))
    away = (cloud[:, None] - scene.tips).astype(float)  # (P, 2, 3)
    along = np.einsum("psi,si->ps", away, ways)
    aside = np.linalg.norm(away - along[..., None] * ways, axis=-1)
    side, point = np.argmin(aside, axis=1), np.arange(len(cloud))
    along, aside = along[point, side], aside[point, side]
    clear = (along > CLEAR[0]) & (along < lengths[side] - CLEAR[1])
    kept = clear & (aside < WITHIN * scene.diameter)
    if tension <= 0 or min(np.sum(kept & (side == s)) for s in (0, 1)) < LEAST_POINTS:
        return None
    kept = np.flatnonzero(kept)[:: max(1, int(kept.sum()) // MOST_POINTS)]
    side, along = side[kept], along[kept]
    stretch = scene.stretch(time)
    weight = mass * float(np.linalg.norm(GRAVITY)) / (scene.rest_length * stretch)  # N/m
    # At its ends the band is clamped and bends into its way within a few l = sqrt(EI / T): its line
    # passes 2 l sin(phi / 2) beside the clamp, phi being the angle between clamp and line (the
    # elastica of a long rod under tension T). Neo-Hookean: its section shrinks faster than the
    # tangent modulus grows.
    root = 2 * np.sqrt((2 * stretch**2 + 1 / stretch) / 3) / stretch / np.sqrt(tension)
    share = (along / lengths[side])[:, None]
    outwards = np.sign(scene.tips[side, :1]) * [1.0, 0.0, 0.0]
    bend = (1 - share) * _beside(clamp, ways[side]) + share * _beside(outwards, -ways[side])
    return _Picture(
        points=cloud[kept].astype(float),
        tips=scene.tips[side],
        ways=ways[side],
        share=share[:, 0],
        sag=weight * along * (lengths[side] - along) / (2 * tension),
        bend=root * bend,
        hand=hand,
        radius=scene.diameter / 2 / np.sqrt(stretch),  # rubber keeps its volume
    )


def _beside(clamp: np.ndarray, way: np.ndarray) -> np.ndarray:
    """sin(phi / 2) towards where the clamp points to, across the line, shape (P, 3)."""
    clamp = np.broadcast_to(clamp / np.linalg.norm(clamp, axis=-1, keepdims=True), way.shape)
    cosine = np.einsum("pi,pi->p", clamp, way)[:, None]
    aside = clamp - cosine * way
    aside /= np.maximum(np.linalg.norm(aside, axis=1), 1e-9)[:, None]
    return np.sqrt(np.maximum((1 - cosine) / 2, 0)) * aside


def _equations(picture: _Picture, eye: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows (2 P, 10) and offsets (2 P,) of points from the line, towards the eye and across it."""
    away = picture.points - picture.tips
    away[:, 2] += picture.sag
    sight = eye - picture.points
    sight -= np.einsum("pi,pi->p", sight, picture.ways)[:, None] * picture.ways
    sight /= np.linalg.norm(sight, axis=1)[:, None]
    normals = np.stack([sight, np.cross(picture.ways, sight)], axis=1)  # (P, 2, 3)
    off = np.einsum("pi,pni->pn", away, normals) - [SEEN * picture.radius, 0.0]
    share = picture.share[:, None, None]
    wide = normals[..., :1] * np.sign(picture.tips[:, :1, None])
    near = np.broadcast_to([[[1.0], [0.0]]], wide.shape)
    bend = -np.einsum("pi,pni->pn", picture.bend, normals)[..., None]
    parts = normals, -share * normals, -share * wide, -(1 - share) * wide, -near, bend
    return np.concatenate(parts, axis=2).reshape(-1, len(PRIOR)), off.ravel()


def _hanging(
    scene: Scene, times: np.ndarray, clouds: list[np.ndarray], eye: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Rows (P, 10) and offsets (P,) of points of the hanging band from the plane y = 0."""
    free, half = scene.signals.grasp_time - FREE, scene.tips[1, 0]
    before = [cloud for time, cloud in zip(times, clouds, strict=True) if time < free]
    points = np.concatenate([np.zeros((0, 3)), *before])
    kept = (np.abs(points[:, 0]) < half) & (np.abs(points[:, 1]) < WITHIN * scene.diameter)
    kept &= (points[:, 2] < -CLEAR[0]) & (points[:, 2] > -scene.rest_length / 2 - CLEAR[0])
    points = points[kept]
    sight = eye - points
    # A catenary's slope grows in proportion to the arc from its lowest point.
    depth = 0.9 * np.sqrt(max((scene.rest_length / 2) ** 2 - half**2, 0)) / half**2
    slope = 2 * depth * points[:, 0]
    ways = np.stack([np.ones_like(slope), np.zeros_like(slope), slope], axis=1)
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    sight -= np.einsum("pi,pi->p", sight, ways)[:, None] * ways
    toward = sight[:, 1] / np.maximum(np.linalg.norm(sight, axis=1), 1e-9)
    rows = np.zeros((len(points), len(PRIOR)))
    rows[:, 1], rows[:, 8] = 1.0, -toward
    return rows, points[:, 1] - SEEN * toward * scene.diameter / 2


def _fit(
    rows: np.ndarray, off: np.ndarray, weights: np.ndarray, cells: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Huber's estimate by reweighting: state (10,), standard errors (10,), what is left.

    Cells of the hand's path are independent, points in them are not.
    """
    state, prior = MEAN, np.diag(PRIOR**-2.0)
    sure, curvature, left = weights, prior, off
    for _ in range(ROUNDS):
        left = off + rows @ state
        scale = max(1.4826 * float(np.median(np.abs(left))), LEAST_SCALE)
        sure = weights / np.maximum(1, np.abs(left) / (SHARP * scale)) / scale**2
        curvature = (rows * sure[:, None]).T @ rows + prior
        state = np.linalg.solve(curvature, prior @ MEAN - (rows * sure[:, None]).T @ off)
    pulls = np.zeros((int(cells.max()) + 1, len(PRIOR)))
    np.add.at(pulls, cells, rows * (sure * left)[:, None])
    inverse = np.linalg.inv(curvature)
    covariance = inverse @ (pulls.T @ pulls + prior) @ inverse
    return state, np.sqrt(np.diag(covariance)), left
