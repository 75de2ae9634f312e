"""How far the extrinsics are off, told from the drawn band, which is two straight lines.

Each line runs from a fork tip to the hand. A camera that is misplaced moves and turns all of them
alike; a hand that is misplaced moves their common end and leaves the tips. At different draws the
lines turn about the tips, and so the two errors come apart.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from pipeline.recording import taut
from pipeline.recording.input.frames import Transform
from pipeline.recording.taut import HAND, PRIOR_MEAN, PRIOR_SPREAD, SHIFT, TURN, Samples
from pipeline.recording.view import Scene

ROUNDS = 25
SHARP = 1.345  # scales from which Huber's weights fall
FLOOR = 0.0003  # m: systematic errors of depth that no repetition shows
MODEL = 0.15  # of the bending at the tips that its law may be wrong by


@dataclass(frozen=True)
class Tips:
    """What the drawn band says of the calibration, frame O; standard errors beside each value.

    Attributes:
        offsets: Where the cloud shows them, less where they are [m], shape (2, 3).
        errors: Of `offsets` [m], shape (2, 3).
        correction: Of the clouds: puts what the camera sees at its place. Left of depth-to-O.
        rotation_error: Of the correction's rotation vector [rad], shape (3,).
        hand: Where the band's end in the hand is, less where the pose puts it [m], shape (3,).
        hand_error: [m], shape (3,).
        residual: Median distance of points from the band's surface after the correction [m].
        frames: Pictures that were used.
    """

    offsets: np.ndarray
    errors: np.ndarray
    correction: Transform
    rotation_error: np.ndarray
    hand: np.ndarray
    hand_error: np.ndarray
    residual: float
    frames: int

    @property
    def off(self) -> float:
        """The larger of the two tips' distances from their place [m]."""
        return float(np.linalg.norm(self.offsets, axis=1).max())

    @property
    def off_error(self) -> float:
        """Standard error of `off` [m]."""
        worst = np.argmax(np.linalg.norm(self.offsets, axis=1))
        return along(self.offsets[worst], self.errors[worst])

    @property
    def hand_off(self) -> float:
        """Distance of the band's end from the tool centre point [m]."""
        return float(np.linalg.norm(self.hand))

    @property
    def hand_off_error(self) -> float:
        """Standard error of `hand_off` [m]."""
        return along(self.hand, self.hand_error)


def along(vector: np.ndarray, errors: np.ndarray) -> float:
    """Standard error of a vector's length, from those of its components."""
    return float(np.linalg.norm(vector * errors) / max(np.linalg.norm(vector), 1e-12))


def measure_tips(
    scene: Scene, times: np.ndarray, clouds: list[np.ndarray], eye: np.ndarray, clamp: np.ndarray
) -> Tips | None:
    """Fit a rigid correction of the clouds and a shift of the hand to all taut frames.

    Points are on the surface, one radius from the line, so that only one side is seen does no harm.

    Args:
        scene: Tips, band, and where the hand is.
        times: Of the clouds [s], shape (K,).
        clouds: Frame O, K arrays of shape (P, 3).
        eye: Position of the depth camera, frame O, shape (3,).
        clamp: How the band leaves the tips, frame O, shape (3,).

    Returns:
        None where too little of the drawn band is seen.
    """
    samples = taut.samples_of(scene, times, clouds, eye, clamp)
    if samples is None:
        return None
    first = _fit(samples, taut.from_middle, PRIOR_MEAN, eye)[0]
    state, covariance, off = _fit(samples, taut.from_surface, first, eye)
    # The law of bending is no exact one, and shifts the line's beginning as a camera would.
    bend = 2 * state[taut.STIFFNESS] / np.sqrt(np.median(samples.tension)) * np.sqrt(0.5)
    spare = np.hypot(FLOOR, MODEL * bend * samples.clamp)
    return _tips(scene, state, covariance, spare, float(np.median(np.abs(off))), samples.frames)


def _fit(
    samples: Samples, model: Callable, state: np.ndarray, eye: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Huber's estimate by reweighting: state (15,), covariance (15, 15), residuals of points."""
    scale, state = taut.WITHIN * float(samples.radius.max()), state.copy()
    left = ROUNDS
    while True:
        off, slopes = model(samples, state, eye)  # (M, P), (M, P, 15)
        scale = _scale(off, scale)
        sure = samples.weight * _huber(off, scale)
        curvature = np.einsum("mpi,mp,mpj->ij", slopes, sure, slopes, optimize=True)
        flat, hung = taut.from_hanging(samples, state)
        light = taut.HUNG / max(len(flat), 1) * _huber(flat, _scale(flat, np.inf))
        curvature += (hung * light[:, None]).T @ hung + np.diag(PRIOR_SPREAD**-2.0)
        pull = hung.T @ (light * flat) + np.einsum("mpi,mp->i", slopes, sure * off)
        pull += (state - PRIOR_MEAN) / PRIOR_SPREAD**2
        step = np.linalg.solve(curvature, pull)
        state -= step
        left -= 1
        if not left or np.abs(step).max() < 1e-7:
            break
    # Cells of the hand's path are independent, and the hanging band; points in them are not.
    pulls = np.zeros((samples.cell.max() + 1, len(state)))
    np.add.at(pulls, samples.cell, np.einsum("mpi,mp->pi", slopes, sure * off))
    pulls = np.vstack([pulls, hung.T @ (light * flat)])
    inverse = np.linalg.inv(curvature)
    covariance = inverse @ (pulls.T @ pulls + np.diag(PRIOR_SPREAD**-2.0)) @ inverse
    return state, covariance, off


def _scale(off: np.ndarray, most: float) -> float:
    """Standard deviation of residuals without their outliers."""
    return max(min(most, 1.4826 * np.median(np.abs(off))), FLOOR) if off.size else 1.0


def _huber(off: np.ndarray, scale: float) -> np.ndarray:
    return 1 / np.maximum(1, np.abs(off) / (SHARP * scale)) / scale**2


def _tips(
    scene: Scene,
    state: np.ndarray,
    covariance: np.ndarray,
    spare: np.ndarray,
    residual: float,
    frames: int,
) -> Tips:
    correction = Transform(Rotation.from_rotvec(state[TURN]), state[SHIFT])
    errors = []
    for x, y, z in scene.tips:
        turn = np.array([[0, z, -y], [-z, 0, x], [y, -x, 0]])  # of the tip, by a rotation vector
        slope = np.hstack([np.eye(3), turn])
        variance = np.diag(slope @ covariance[:6, :6] @ slope.T)
        errors.append(np.sqrt(variance + spare**2))
    spread = np.sqrt(np.diag(covariance))
    return Tips(
        offsets=correction.inverse().apply(scene.tips) - scene.tips,
        errors=np.array(errors),
        correction=correction,
        rotation_error=spread[TURN],
        hand=state[HAND],
        hand_error=np.hypot(spread[HAND], FLOOR),
        residual=residual,
        frames=frames,
    )
