"""Signals of an episode: tared force in frame O, end-effector motion, events, window."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.base.errors import UserError
from pipeline.episode import signal
from pipeline.recording.events import (
    LEAD_IN,
    MARGIN,
    SETTLE,
    Release,
    events_of,
    opening_of,
)
from pipeline.recording.geometry import Geometry, turned
from pipeline.recording.input.reader import Recording
from pipeline.recording.motion import VELOCITY_WINDOW, Motion, expect_dense
from pipeline.recording.tool import Wrench
from pipeline.recording.tool_inertia import Felt

MOST_TURN = np.deg2rad(5.0)  # of the hand; beyond it the tool's weight has to be known
MOST_ASKEW = np.deg2rad(30.0)  # between the held force and the way to the fork
MOST_DRIFT = 0.05  # of the held force: more is no drift of the sensor
STRAIGHT = np.deg2rad(1.0)  # of a hand whose weight, if unknown, may be compared with the lead-in's
MOST_GAP = 0.3  # s over which force and pose may be interpolated


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


def signals_of(
    recording: Recording,
    geometry: Geometry,
    episode: object,
    force: object,
    tool: object | None = None,
    felt: Felt | None = None,
) -> Signals:
    """Turn raw streams into samples.

    Args:
        episode, force: Those sections of params.
        tool: setup.tool, which has mass and center, or None.
        felt: The tool as its inertia shows; that is taken off where `tool` is None.

    Raises:
        UserError: if the recording cannot be used, in one line that begins with its path.
    """
    try:
        return _signals(recording, geometry, episode, force, tool, felt)
    except UserError as error:
        raise UserError(f"{recording.path}: {error}") from None


def _signals(
    recording: Recording,
    geometry: Geometry,
    episode: object,
    filter: object,
    tool: object | None,
    felt: Felt | None,
) -> Signals:
    expect_dense(recording.wrench)
    origin = int(recording.wrench.stamp[0])
    t = recording.wrench.seconds(origin)
    motion = Motion.of(recording.pose, geometry, origin)
    gripper = opening_of(recording, origin)
    grasp, release = events_of(recording, motion)

    used = (motion.time >= 0) & (motion.time <= release.time)
    if used.sum() < 10:
        raise UserError(f"{recording.pose.topic} stops before the release at {release.time:.3f} s")
    orientation, turn = turned(motion.turn[used])
    if turn > MOST_TURN and tool is None:
        raise UserError(
            f"the hand turns by {np.degrees(turn):.1f} degrees before the release, and the weight"
            " of the tool leaks into the force: give its mass and centre of mass as setup.tool in"
            " params.yaml (mass 0 for a force without it), or keep the hand's orientation"
        )
    raw = recording.wrench.values
    felt = felt if tool is None else None
    if felt is not None:
        raw = raw - felt.inertia(motion, geometry, t, release.time)
    wrench = Wrench.of(t, raw, motion, geometry, tool, release.time)
    held = (t > release.time - 0.5) & (t < release.time - MARGIN / 5)
    if not held.any():
        raise UserError(f"no force in the half second before the release at {release.time:.3f} s")
    hand = motion.position(release.time)

    force, tare = _tared(wrench, 1.0, grasp, release)
    sign = _sign(force[held].mean(axis=0), hand)
    if sign < 0 and tool is not None:  # the sensor feels its tool with the other sign, too
        force, tare = _tared(wrench, sign, grasp, release)
        if _sign(force[held].mean(axis=0), hand) > 0:
            raise UserError(
                f"a tool of {tool.mass:.3g} kg hides which sign the force has: check setup.tool and"
                " the wrench's frame"
            )
    force = sign * force
    hold = force[held].mean(axis=0)

    start = _window(recording, t, motion.time, grasp, release.time, episode)
    period = episode.duration / episode.samples
    gaps = {
        stream.topic: _longest_gap(times, start, start + episode.duration)
        for stream, times in ((recording.wrench, t), (recording.pose, motion.time))
    }
    for topic, gap in gaps.items():
        if gap > MOST_GAP:
            raise UserError(
                f"{topic} is missing for {gap:.2f} s between the lead-in and the end: more than"
                f" {MOST_GAP:g} s cannot be filled in, record again"
            )
    rate = 1 / recording.wrench.period
    cutoff = signal.cutoff_hz(filter.cutoff, filter.cutoff_unit)
    grid, even = signal.uniform(t, force, rate)
    smooth = signal.lowpass(even, rate, cutoff)
    pose_grid, position, velocity = motion.velocity()

    def sampled(times: np.ndarray, values: np.ndarray) -> np.ndarray:
        return signal.average(times, values, start, period, episode.samples)

    facts = {
        **tare,
        "noise": release.noise,
        "hold_force": hold.tolist(),
        "peak_force": float(np.linalg.norm(smooth[grid < release.time - MARGIN], axis=1).max()),
        "flipped": bool(sign < 0),
        "turn": turn,
        "tool": _told(tool, "setup.tool") or _told(felt, "its inertia"),
        "rate": rate,
        "longest_gap": gaps,
        "cutoff_hz": cutoff,
        "release_error": release.error,
        "release_resolution": release.resolution,
        "slips": [time - start for time in release.slips],
        "velocity_window": VELOCITY_WINDOW,
        "twist_difference": _twist_difference(recording, origin, pose_grid, velocity),
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
        path_time=motion.time - start,
        path=motion.path,
        tool_axis=orientation.apply([0, 0, 1]),
    )


def _tared(wrench: Wrench, sign: float, grasp: float, release: Release) -> tuple[np.ndarray, dict]:
    """The band's force in frame O (S, 3), with the sensor's sign, and what was taken away.

    Taken away are the tool's load, then, in the sensor's frame, the lead-in's mean and the drift
    until the free hand at the end.
    """
    t, rest = wrench.time, wrench.raw - sign * wrench.load
    lead_in = t < grasp - MARGIN
    if lead_in.sum() < 20 or grasp - MARGIN - t[0] < LEAD_IN:
        raise UserError(
            f"the band is grasped {grasp - t[0]:.2f} s after the start: record at least"
            f" {LEAD_IN + MARGIN:.2f} s of the empty hand before, to tare the force"
        )
    bias = rest[lead_in].mean(axis=0)
    turn, end = wrench.turn[lead_in].mean(), t > release.time + SETTLE
    if not wrench.load.any():
        end &= (turn.inv() * wrench.turn).magnitude() < STRAIGHT
    drift = np.zeros(3)
    if end.sum() >= 20:
        late = rest[end].mean(axis=0) - bias
        if np.linalg.norm(late) < MOST_DRIFT * release.drop:
            drift = late / (t[end].mean() - t[lead_in].mean())
    force = rest - bias - drift * (t - t[lead_in].mean())[:, None]
    tare = {"bias": turn.apply(bias).tolist(), "drift": turn.apply(drift).tolist()}
    return wrench.turn.apply(force), tare


def _told(tool: object | None, source: str) -> dict | None:
    return tool and {"mass": tool.mass, "center": list(tool.center), "source": source}


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
    first, last = max(t[0], pose_t[0]), min(t[-1], pose_t[-1])
    ends = recording.wrench.topic if t[-1] < pose_t[-1] else recording.pose.topic
    start = max(first, release + episode.tail - episode.duration)
    slack = 1.5 * max(recording.wrench.period, recording.pose.period)
    if start + episode.duration > last + slack:
        if last < release + episode.tail:
            side = "after" if last >= release else "before"
            raise UserError(
                f"{ends} ends {abs(last - release):.2f} s {side} the release, episode.tail asks"
                f" for {episode.tail} s after it: record on for longer"
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


def _longest_gap(times: np.ndarray, start: float, end: float) -> float:
    """Between samples of a window [s]; values are interpolated over it."""
    inside = times[(times > start) & (times < end)]
    return float(np.diff(inside).max()) if len(inside) > 1 else end - start


def _twist_difference(
    recording: Recording, origin: int, times: np.ndarray, velocity: np.ndarray
) -> float | None:
    """Median difference of speed to a recorded twist [m/s], in whatever frame that is given.

    The derivative of the pose is used all the same: a robot filters its twist, nobody says how.
    """
    twist = recording.twist
    if twist is None or twist.topic == recording.pose.topic:
        return None
    said = np.linalg.norm(twist.values[:, :3], axis=1)
    speed = np.interp(twist.seconds(origin), times, np.linalg.norm(velocity, axis=1))
    return float(np.median(np.abs(said - speed)))
