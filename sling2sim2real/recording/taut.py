"""The taut band as the camera sees it: a heavy, slightly stiff string from each tip to the hand."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from sling2sim2real.recording.motion import interpolated
from sling2sim2real.recording.view import Scene

PULLED = 1.1  # least stretch: a band that is drawn less sags
CLEAR = (0.015, 0.045)  # m of each line left out at its tip (the clamp) and at the hand (fingers)
WITHIN = 3.5  # diameters from the line: what is further off is no band
FAST = 0.4  # m/s of the hand, from which the band swings, and a millisecond is half a millimetre
SPAN = 0.02  # s before and after a picture that tell its hand's speed
CELL = 0.01  # m of the hand's path whose frames count as one: they share their errors
LEAST_FRAMES, LEAST_POINTS, MOST_POINTS = 5, 20, 150
HUNG = 4.0  # cells of the drawn band that the hanging band counts as
FREE = 0.15  # s before the grasp in which the hand may touch it
IN_PLANE = 0.1  # sine of the angle to the plane y = 0 that the clamps may have
SEEN = 0.7  # radii by which the middle of what is seen lies before the line
# What is fitted, with prior knowledge of it: shift [m] and turn [rad] of the clouds, shift of the
# hand [m], weight of the band [N/m], its radius less the one given [m], half the width that the
# fingers hold [m], root of its stiffness in bending [sqrt(N) m], how far the clamps point inwards,
# and how far inwards of the tips the band begins (an error of the fork's width) [m].
SHIFT, TURN, HAND = slice(0, 3), slice(3, 6), slice(6, 9)
WEIGHT, RADIUS, PADS, STIFFNESS, TILT, INWARDS = range(9, 15)
PRIOR_MEAN = np.array([0, 0, 0, 0, 0, 0, 0, 0, 0, 0.4, 0, 0.003, 0.015, 0, 0])
PRIOR_SPREAD = np.array(
    [0.03, 0.03, 0.03, 0.03, 0.03, 0.03, 0.01, 0.01, 0.01, 0.3, 0.0003, 0.003, 0.01, 0.25, 0.002]
)


@dataclass(frozen=True)
class Samples:
    """Points of the drawn band with what is known of each, frame O, SI units.

    Attributes:
        points: Shape (P, 3).
        tip, hand: Between which its half of the band runs, shape (P, 3).
        tension, stretch, radius: Of the band then, shape (P,).
        weight: A cell of the hand's path has 1 in all, shape (P,).
        cell: Number of that cell, shape (P,).
        clamp: How the band leaves the tips, shape (3,).
        hanging: Points before the grasp, shape (H, 3).
        bulge: By how many radii the side that is seen has another y than the line, shape (H,).
        thick: Radius at rest.
        frames: Pictures of the drawn band.
    """

    points: np.ndarray
    tip: np.ndarray
    hand: np.ndarray
    tension: np.ndarray
    radius: np.ndarray
    weight: np.ndarray
    cell: np.ndarray
    stretch: np.ndarray
    clamp: np.ndarray
    hanging: np.ndarray
    bulge: np.ndarray
    thick: float
    frames: int


def samples_of(
    scene: Scene, times: np.ndarray, clouds: list[np.ndarray], eye: np.ndarray, clamp: np.ndarray
) -> Samples | None:
    """Samples of what `tips.measure_tips` gets; None where too little of the drawn band is seen."""
    signals, parts = scene.signals, []
    for time, cloud in zip(times, clouds, strict=True):
        if not (scene.taut(time) and scene.stretch(time) > PULLED and len(cloud)):
            continue
        before, hand, after = (signals.hand(time + late) for late in (-SPAN, 0.0, SPAN))
        if np.linalg.norm(after - before) > 2 * SPAN * FAST:
            continue
        ways = hand - scene.tips
        lengths = np.linalg.norm(ways, axis=1)
        both = np.linalg.norm((ways / lengths[:, None]).sum(axis=0))
        tension = np.linalg.norm(interpolated(time, signals.time, signals.force)) / both
        away = (cloud[:, None] - scene.tips).astype(float)  # (P, 2, 3)
        along = np.einsum("psi,si->ps", away, ways / lengths[:, None])
        aside = np.linalg.norm(away - along[..., None] * ways / lengths[:, None], axis=-1)
        side = np.argmin(aside, axis=1)
        point = np.arange(len(cloud))
        clear = (along[point, side] > CLEAR[0]) & (along[point, side] < lengths[side] - CLEAR[1])
        retained = clear & (aside[point, side] < WITHIN * scene.diameter)
        if tension <= 0 or min(np.sum(retained & (side == s)) for s in (0, 1)) < LEAST_POINTS:
            continue
        retained = np.flatnonzero(retained)[:: max(1, int(retained.sum()) // MOST_POINTS)]
        points, tips = cloud[retained].astype(float), scene.tips[side[retained]]
        parts.append((points, tips, hand, tension, scene.stretch(time)))
    if len(parts) < LEAST_FRAMES:
        return None
    hanging, bulge = _hanging(scene, times, clouds, eye)
    if abs(clamp[1]) > IN_PLANE:
        hanging, bulge = hanging[:0], bulge[:0]  # the clamps bend it out of their plane
    points, tips, hands, tensions, stretches = zip(*parts, strict=True)
    sizes, hands = list(map(len, points)), np.array(hands)
    radii = scene.diameter / 2 / np.sqrt(stretches)  # rubber keeps its volume
    _, cells = np.unique(np.round(hands / CELL), axis=0, return_inverse=True)
    shares = 1 / np.bincount(cells)[cells] / np.array(sizes)
    return Samples(
        points=np.concatenate(points),
        tip=np.concatenate(tips),
        hand=np.repeat(hands, sizes, axis=0),
        tension=np.repeat(tensions, sizes),
        radius=np.repeat(radii, sizes),
        weight=np.repeat(shares, sizes),
        cell=np.repeat(cells.ravel(), sizes),
        stretch=np.repeat(stretches, sizes),
        clamp=np.asarray(clamp, float),
        hanging=hanging,
        bulge=bulge,
        thick=scene.diameter / 2,
        frames=len(parts),
    )


def from_middle(samples: Samples, state: np.ndarray, eye: np.ndarray) -> tuple:
    """Linear, and so without wrong minima: what is seen lies SEEN radii before the line."""
    away, way, slope = _aside(samples, state)
    sight = eye - samples.points
    sight -= np.einsum("pi,pi->p", sight, way)[:, None] * way
    sight /= np.linalg.norm(sight, axis=1)[:, None]
    across = np.cross(way, sight)
    off = np.stack(
        [
            np.einsum("pi,pi->p", away, sight) - SEEN * (samples.radius + state[RADIUS]),
            np.einsum("pi,pi->p", away, across),
        ]
    )
    return off, np.stack([slope(sight, SEEN), slope(across, 0)])


def from_surface(samples: Samples, state: np.ndarray, _: np.ndarray) -> tuple:
    """Points are one radius from the line, on whichever side."""
    away, _, slope = _aside(samples, state)
    distance = np.linalg.norm(away, axis=1)
    normal = away / np.maximum(distance, 1e-9)[:, None]
    return (distance - samples.radius - state[RADIUS])[None], slope(normal, 1)[None]


def from_hanging(samples: Samples, state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Residuals (H,), derivatives (H, 15) of the hanging band, of which only y is known."""
    points = Rotation.from_rotvec(state[TURN]).apply(samples.hanging) + state[SHIFT]
    off = points[:, 1] - samples.bulge * samples.thick
    slopes = np.zeros((len(points), len(PRIOR_MEAN)))
    slopes[:, 1] = 1
    slopes[:, TURN] = np.cross(points - state[SHIFT], [0.0, 1.0, 0.0])
    return off, slopes


def _aside(samples: Samples, state: np.ndarray) -> tuple[np.ndarray, np.ndarray, Callable]:
    """Offsets of corrected points from the line (P, 3), the lines' directions (P, 3), derivatives.

    The string sags by w x (L - x) / 2T. At its ends it is clamped and bends into its way within a
    few l = sqrt(EI / T): its line passes 2 l sin(phi / 2) beside the clamp, phi being the angle
    between clamp and line (the elastica of a long rod under tension T).
    """
    points = Rotation.from_rotvec(state[TURN]).apply(samples.points) + state[SHIFT]
    side = np.sign(samples.tip[:, :1]) * [1.0, 0.0, 0.0]
    way = samples.hand + state[HAND] + (state[PADS] + state[INWARDS]) * side - samples.tip
    length = np.linalg.norm(way, axis=1)
    way /= length[:, None]
    away = points - samples.tip + state[INWARDS] * side
    along = np.einsum("pi,pi->p", away, way)
    share = (along / length)[:, None]
    sag = along * (length - along) / (2 * samples.tension)
    # Neo-Hookean: the section shrinks faster than the tangent modulus grows.
    thinner = np.sqrt((2 * samples.stretch**2 + 1 / samples.stretch) / 3) / samples.stretch
    root = (2 * thinner / np.sqrt(samples.tension))[:, None]
    clamp = samples.clamp - state[TILT] * side
    tip = root * (1 - share) * _beside(clamp, way)
    bend = tip + root * share * _beside(side, -way)
    more = root * (1 - share) * _beside(samples.clamp - (state[TILT] + 0.01) * side, way)
    tilted = state[STIFFNESS] * (more - tip) / 0.01
    away[:, 2] += state[WEIGHT] * sag
    away -= state[STIFFNESS] * bend
    away -= np.einsum("pi,pi->p", away, way)[:, None] * way

    def slope(normal: np.ndarray, radii: float) -> np.ndarray:
        """Derivative of `away` along `normal` less so many radii, (P, 15)."""
        slopes = np.empty((len(points), len(PRIOR_MEAN)))
        slopes[:, SHIFT] = normal
        slopes[:, TURN] = np.cross(points - state[SHIFT], normal)
        slopes[:, HAND] = -normal * share
        slopes[:, WEIGHT] = normal[:, 2] * sag
        slopes[:, RADIUS] = -radii
        slopes[:, PADS] = np.einsum("pi,pi->p", slopes[:, HAND], side)
        slopes[:, STIFFNESS] = -np.einsum("pi,pi->p", normal, bend)
        slopes[:, TILT] = -np.einsum("pi,pi->p", normal, tilted)
        slopes[:, INWARDS] = np.einsum("pi,pi->p", normal, side * (1 - share))
        return slopes

    return away, way, slope


def _hanging(
    scene: Scene, times: np.ndarray, clouds: list[np.ndarray], eye: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Points of the band before the grasp, whose line lies in the plane y = 0."""
    free = scene.signals.grasp_time - FREE
    before = [cloud for time, cloud in zip(times, clouds, strict=True) if time < free]
    points = np.concatenate([np.zeros((0, 3)), *before])
    half, low = scene.tips[1, 0], scene.tips[1, 2] - 0.5 * scene.rest_length - 0.02
    retained = (np.abs(points[:, 0]) < half) & (np.abs(points[:, 1]) < 3.5 * scene.diameter)
    retained &= (points[:, 2] < scene.tips[1, 2] - CLEAR[0]) & (points[:, 2] > low)
    points = points[retained].astype(float)
    # A catenary's slope grows in proportion to the arc from its lowest point.
    depth = 0.9 * np.sqrt(max((scene.rest_length / 2) ** 2 - half**2, 0)) / half**2
    way = np.stack([np.ones(len(points)), 0 * points[:, 0], 2 * depth * points[:, 0]], axis=1)
    way /= np.linalg.norm(way, axis=1)[:, None]
    sight = eye - points
    sight -= np.einsum("pi,pi->p", sight, way)[:, None] * way
    return points, SEEN * sight[:, 1] / np.linalg.norm(sight, axis=1)


def _beside(clamp: np.ndarray, way: np.ndarray) -> np.ndarray:
    """sin(phi / 2) towards where the clamp points to, across the line, shape (P, 3)."""
    clamp = clamp / np.linalg.norm(clamp, axis=-1, keepdims=True)
    cosine = np.einsum("pi,pi->p", np.broadcast_to(clamp, way.shape), way)[:, None]
    aside = clamp - cosine * way
    aside /= np.maximum(np.linalg.norm(aside, axis=1), 1e-9)[:, None]
    return np.sqrt(np.maximum((1 - cosine) / 2, 0)) * aside
