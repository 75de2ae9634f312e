"""Signals of an episode: tared force in frame O, end-effector motion, events, window."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import savgol_filter

from pipeline import signal
from pipeline.errors import UserError
from pipeline.recording.events import LEAD_IN, find_grasp, find_release
from pipeline.recording.geometry import Geometry, turned
from pipeline.recording.reader import Recording

MARGIN = 0.05  # s kept clear of the grasp and of the release when means are taken
MOST_TURN = np.deg2rad(5.0)  # of the hand; beyond it the tool's weight would have to be known
MOST_ASKEW = np.deg2rad(30.0)  # between the held force and the way to the fork
MOST_DRIFT = 0.05  # of the held force: more is no drift of the sensor
SETTLE = 0.4  # s after the release until the hand is free and at rest
SMOOTHING = 0.05  # s window of the derivative of the pose


@dataclass(frozen=True)
class Signals:
    """What the robot felt and did, frame O, times in seconds since the window's start.

    Attributes:
        origin: The window's start on the recording's clock [ns].
        time: Middle of each sample, shape (T,).
        position, velocity, force: Shape (T, 3).
        opening: Shape (T,), NaN where it was not recorded.
        grasp_time, release_time: Events.
        facts: Bias, noise, drift, turn, flip and the like, for the metadata.
        path_time, path: The hand at its native rate, for what needs more than samples.
        tool_axis: Where the hand points to (z of its frame), shape (3,).
    """

    origin: int
    time: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    force: np.ndarray
    opening: np.ndarray
    grasp_time: float
    release_time: float
    facts: dict
    path_time: np.ndarray
    path: np.ndarray
    tool_axis: np.ndarray

    def hand(self, times: np.ndarray) -> np.ndarray:
        """Tool centre point at any times, shape (..., 3)."""
        axes = [np.interp(times, self.path_time, axis) for axis in self.path.T]
        return np.stack(axes, axis=-1)

    def opening_at(self, time: float) -> float:
        """Distance between the fingers [m], 0 where it was not recorded."""
        return float(np.nan_to_num(np.interp(time, self.time, self.opening)))


def signals_of(recording: Recording, geometry: Geometry, episode: object, force: object) -> Signals:
    """Turn raw streams into samples. `episode` and `force` are those sections of params.

    Raises:
        UserError: if the recording cannot be used, in one line that begins with its path.
    """
    try:
        return _signals(recording, geometry, episode, force)
    except UserError as error:
        raise UserError(f"{recording.path}: {error}") from None


def _signals(recording: Recording, geometry: Geometry, episode: object, filter: object) -> Signals:
    origin = int(recording.wrench.stamp[0])
    t = recording.wrench.seconds(origin)
    pose_t = recording.pose.seconds(origin)
    raw = recording.wrench.values
    path = geometry.base.apply(recording.pose.values[:, :3])

    release = find_release(t, raw)
    gripper = recording.gripper and (
        recording.gripper.seconds(origin),
        recording.gripper.values[:, 0],
    )
    grasp = find_grasp(gripper, (pose_t, path[:, 2]), release.time)

    used = (pose_t >= 0) & (pose_t <= release.time)
    if used.sum() < 10:
        raise UserError(f"{recording.pose.topic} stops before the release at {release.time:.3f} s")
    orientation, turn = turned(recording.pose.values[used])
    if turn > MOST_TURN:
        raise UserError(
            f"the hand turns by {np.degrees(turn):.1f} degrees before the release: keep its"
            " orientation, or the weight of the tool leaks into the force"
        )
    rotation = geometry.sensor
    if not geometry.sensor_is_fixed:
        rotation = geometry.base.rotation * orientation * rotation

    force, tare = _tared(t, raw, grasp, release)
    force = rotation.apply(force)
    held = (t > release.time - 0.5) & (t < release.time - MARGIN / 5)
    if not held.any():
        raise UserError(f"no force in the half second before the release at {release.time:.3f} s")
    hold = force[held].mean(axis=0)
    hand = np.array([np.interp(release.time, pose_t, axis) for axis in path.T])
    sign = _sign(hold, hand)

    start = _window(recording, t, pose_t, grasp, release.time, episode)
    period = episode.duration / episode.samples
    rate = 1 / recording.wrench.period
    cutoff = signal.cutoff_hz(filter.cutoff, filter.cutoff_unit)
    grid, even = signal.uniform(t, sign * force, rate)
    smooth = signal.lowpass(even, rate, cutoff)
    pose_grid, position, velocity = _motion(pose_t, path, 1 / recording.pose.period)

    def sampled(times: np.ndarray, values: np.ndarray) -> np.ndarray:
        return signal.average(times, values, start, period, episode.samples)

    facts = {
        "bias": rotation.apply(tare["bias"]).tolist(),
        "drift": rotation.apply(tare["drift"]).tolist(),
        "noise": release.noise,
        "hold_force": (sign * hold).tolist(),
        "peak_force": float(np.linalg.norm(smooth[grid < release.time - MARGIN], axis=1).max()),
        "flipped": bool(sign < 0),
        "turn": turn,
        "rate": rate,
        "cutoff_hz": cutoff,
        "release_resolution": release.resolution,
        "velocity_window": SMOOTHING,
    }
    return Signals(
        origin=origin + round(start * 1e9),
        time=(np.arange(episode.samples) + 0.5) * period,
        position=sampled(pose_grid, position),
        velocity=sampled(pose_grid, velocity),
        force=sampled(grid, smooth),
        opening=sampled(*gripper) if gripper else np.full(episode.samples, np.nan),
        grasp_time=grasp - start,
        release_time=release.time - start,
        facts=facts,
        path_time=pose_t - start,
        path=path,
        tool_axis=(geometry.base.rotation * orientation).apply([0, 0, 1]),
    )


def _tared(t: np.ndarray, raw: np.ndarray, grasp: float, release) -> tuple[np.ndarray, dict]:
    """Take the lead-in's mean away, and the sensor's drift until the free hand at the end."""
    lead_in = t < grasp - MARGIN
    if lead_in.sum() < 20 or grasp - MARGIN - t[0] < LEAD_IN:
        raise UserError(
            f"the band is grasped {grasp - t[0]:.2f} s after the start: record at least"
            f" {LEAD_IN + MARGIN:.2f} s of the empty hand before, to tare the force"
        )
    bias = raw[lead_in].mean(axis=0)
    end = t > release.time + SETTLE
    drift = np.zeros(3)
    if end.sum() >= 20:
        late = raw[end].mean(axis=0) - bias
        if np.linalg.norm(late) < MOST_DRIFT * release.drop:
            drift = late / (t[end].mean() - t[lead_in].mean())
    force = raw - bias - drift * (t - t[lead_in].mean())[:, None]
    return force, {"bias": bias, "drift": drift}


def _sign(hold: np.ndarray, hand: np.ndarray) -> float:
    """+1, or -1 where the sensor reports the force of the gripper on the band."""
    if hand[1] > -0.05:
        raise UserError(
            f"the hand lets go at y = {hand[1]:+.3f} m, not behind the fork: check base_to_fork"
        )
    cosine = hold @ -hand / (np.linalg.norm(hold) * np.linalg.norm(hand))
    angle = np.arccos(np.clip(abs(cosine), 0, 1))
    if angle > MOST_ASKEW:
        raise UserError(
            f"the held force points {np.degrees(angle):.0f} degrees away from the fork: check the"
            " frame of the wrench and its transform to the hand in /tf_static"
        )
    return 1.0 if cosine > 0 else -1.0


def _window(
    recording: Recording,
    t: np.ndarray,
    pose_t: np.ndarray,
    grasp: float,
    release: float,
    episode: object,
) -> float:
    """Start of the window [s]: as much lead-in as the tail after the release leaves room for."""
    streams = [(t[0], t[-1]), (pose_t[0], pose_t[-1])]
    first, last = max(a for a, _ in streams), min(b for _, b in streams)
    start = max(first, release + episode.tail - episode.duration)
    slack = 1.5 * max(recording.wrench.period, recording.pose.period)
    if start + episode.duration > last + slack:
        if last < release + episode.tail:
            raise UserError(
                f"it ends {last - release:.2f} s after the release, episode.tail asks for"
                f" {episode.tail} s: record on for longer"
            )
        raise UserError(
            f"it is {last - first:.2f} s long, episode.duration asks for {episode.duration} s:"
            " record for longer"
        )
    if start > grasp - MARGIN:
        raise UserError(
            f"from grasp to release it takes {release - grasp:.2f} s, more than episode.duration"
            f" {episode.duration} s less episode.tail {episode.tail} s: pull faster, or set them"
        )
    return start


def _motion(t: np.ndarray, path: np.ndarray, rate: float) -> tuple[np.ndarray, ...]:
    """Even times, position and velocity by a local cubic fit (Savitzky-Golay)."""
    grid, even = signal.uniform(t, path, rate)
    window = max(5, 2 * round(SMOOTHING * rate / 2) + 1)
    if len(grid) <= window:
        raise UserError("the pose is too short to differentiate")
    return grid, even, savgol_filter(even, window, 3, deriv=1, delta=1 / rate, axis=0)
