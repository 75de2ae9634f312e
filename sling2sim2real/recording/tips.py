"""How far the extrinsics are off, from the drawn band, which is two straight lines.

Each line runs from a fork tip to the hand. A camera that is misplaced moves and turns all of them
alike; a hand that is misplaced moves their common end and leaves the tips. At different draws the
lines turn about the tips, and so the two errors come apart.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from sling2sim2real.recording import taut
from sling2sim2real.recording.input.frames import Transform
from sling2sim2real.recording.taut import HAND, PRIOR_MEAN, PRIOR_SPREAD, SHIFT, TURN, Samples
from sling2sim2real.recording.view import Scene

ROUNDS = 25
SHARP = 1.345  # scales from which Huber's weights fall
FLOOR = 0.0003  # m: systematic errors of depth that no repetition shows
SURE = 3.5  # standard errors from which one of several components is more than noise
TURN_FLOOR = np.deg2rad(0.1)  # as FLOOR, of a turn
LENS_FLOOR = 0.001  # as FLOOR, of a factor
MATTERS = 0.004  # m
LITTLE = 0.2  # of what is off, that a factor may leave
TRY = 0.01  # by which a factor is changed to see what it does
MODEL = 0.15  # of the bending at the tips that its law may be wrong by


@dataclass(frozen=True)
class LensFactor:
    """One factor of what the depth camera sees that explains what is off without another pose.

    Attributes:
        kind: "depth": of all distances from it; "width": across its sight (its focal length).
        factor: Over the true one.
        error: Standard deviation of it.
    """

    kind: str
    factor: float
    error: float


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
        reach: From the tips' middle to the hand where it was furthest [m].
        lens: What explains it if it `is_off`, where one factor does.
    """

    offsets: np.ndarray
    errors: np.ndarray
    correction: Transform
    rotation_error: np.ndarray
    hand: np.ndarray
    hand_error: np.ndarray
    residual: float
    frames: int
    reach: float
    lens: LensFactor | None = None

    @property
    def sure(self) -> np.ndarray:
        """The offsets' components that are more than noise [m], shape (2, 3); others are 0."""
        return np.where(np.abs(self.offsets) > SURE * self.errors, self.offsets, 0.0)

    @property
    def turned(self) -> np.ndarray:
        """The correction's turns that are more than noise [rad], shape (3,); others are 0."""
        turn = self.correction.rotation.as_rotvec()
        error = np.hypot(self.rotation_error, TURN_FLOOR)
        return np.where(np.abs(turn) > SURE * error, turn, 0.0)

    @property
    def is_off(self) -> bool:
        """More than noise, and enough to matter."""
        far = float(np.linalg.norm(self.sure, axis=1).max())
        return max(far, float(np.linalg.norm(self.turned)) * self.reach) > MATTERS

    @property
    def parts(self) -> tuple[np.ndarray, np.ndarray]:
        """What may be off [m], and its standard errors, both (9,): tips, and turns at the hand."""
        turn = self.correction.rotation.as_rotvec() * self.reach
        spread = np.hypot(self.rotation_error, TURN_FLOOR) * self.reach
        return np.append(self.offsets, turn), np.append(self.errors, spread)

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
    tips = _of_samples(scene, samples, eye)
    if not tips.is_off:
        return tips

    def seen_by(kind: str, factor: float) -> Tips:
        """What would be off if the camera saw by so much more."""
        sight = samples.points.mean(axis=0) - eye
        points = _seen_by(kind, factor, samples.points, eye, sight)
        hanging = _seen_by(kind, factor, samples.hanging, eye, sight)
        return _of_samples(scene, replace(samples, points=points, hanging=hanging), eye)

    return replace(tips, lens=_lens(tips, seen_by))


def _of_samples(scene: Scene, samples: Samples, eye: np.ndarray) -> Tips:
    """Fit the points' middle first, which is linear, and then their surface; without `lens`."""
    first = _fit(samples, taut.from_middle, PRIOR_MEAN, eye)[0]
    state, covariance, off = _fit(samples, taut.from_surface, first, eye)
    # The law of bending is no exact one, and shifts the line's beginning as a camera would.
    bend = 2 * state[taut.STIFFNESS] / np.sqrt(np.median(samples.tension)) * np.sqrt(0.5)
    spare = np.hypot(FLOOR, MODEL * bend * samples.clamp)
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
        residual=float(np.median(np.abs(off))),
        frames=samples.frames,
        reach=float(np.linalg.norm(samples.hand, axis=1).max()),
    )


def _seen_by(
    kind: str, factor: float, points: np.ndarray, eye: np.ndarray, sight: np.ndarray
) -> np.ndarray:
    """Points (P, 3) as a camera at `eye` that looks along `sight` (3,) sees them by this factor."""
    away = points - eye
    if kind == "depth":
        return eye + factor * away
    axis = sight / np.linalg.norm(sight)
    deep = (away @ axis)[:, None] * axis
    return eye + deep + factor * (away - deep)


def _lens(tips: Tips, seen_by: Callable[[str, float], Tips]) -> LensFactor | None:
    """The factor that leaves least of what is off, where it leaves little; it acts linearly."""
    off, errors = tips.parts
    fitted: list[tuple[float, LensFactor]] = []
    for kind in ("depth", "width"):
        slope = (seen_by(kind, 1 + TRY).parts[0] - off) / TRY
        variance = 1 / float(np.sum((slope / errors) ** 2))
        more = -variance * float(np.sum(slope * off / errors**2))
        left = off + more * slope
        beyond = np.where(np.abs(left) > SURE * errors, left, 0.0)
        little = max(MATTERS, LITTLE * float(np.linalg.norm(off)))
        error = float(np.hypot(np.sqrt(variance), LENS_FLOOR))
        if np.linalg.norm(beyond) <= little and abs(more) > SURE * error:
            lens = LensFactor(kind, 1 / (1 + more), error)
            fitted.append((float(np.sum((left / errors) ** 2)), lens))
    return min(fitted, key=lambda pair: pair[0])[1] if fitted else None


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
