"""Signals of an episode: tared force in frame O, end-effector motion, events, window."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sling2sim2real.base.errors import UserError
from sling2sim2real.episode import signal
from sling2sim2real.episode.phases import TURN
from sling2sim2real.episode.window import Window, window_of
from sling2sim2real.recording.events import MARGIN, Pull
from sling2sim2real.recording.force import ToolInertia, band_force
from sling2sim2real.recording.frames import turned
from sling2sim2real.recording.motion import Motion, expect_dense, interpolated
from sling2sim2real.settings import Settings
from sling2sim2real.settings.recording import EpisodeParams

MOST_TURN = np.deg2rad(5.0)  # of the hand; beyond it the tool's weight has to be known
LATE = 0.1  # s
MOST_GAP = 0.3  # s over which force and pose may be interpolated


@dataclass(frozen=True)
class ToolFacts:
    """The tool whose load was taken off the force: mass [kg], centre [m], and who tells of it."""

    mass: float
    center: list[float]
    source: str


@dataclass(frozen=True)
class SignalFacts:
    """What was found on the way from streams to samples, for the metadata.

    Attributes:
        bias, drift: Taken off the force, frame O [N], [N/s].
        zero_change: Of the zero, from the lead-in to the free hand at the end, frame O [N]; None
            where the latter says nothing of it.
        zero_error: Standard deviation of its length [N].
        zero_steady: The zero drifts steadily, if at all: `drift` is 0 where it does not.
        noise: Standard deviation of one force sample [N].
        hold_force: Mean just before the release, frame O [N].
        peak_force: Largest of the filtered force while the band is held [N].
        flipped: The sensor reports the force of the gripper on the band.
        turn: Largest turn of the hand before the release [rad].
        tool: None where nothing was taken off.
        longest_gap: In the window, by topic [s].
        release_error, release_fall, release_resolution, release_spread: Of `Release` [s].
        filtered: A filter is between sensor and recording, by how the force falls.
        slips: Sudden drops of the held force before the release, since the window's start [s].
    """

    bias: list[float]
    drift: list[float]
    zero_change: list[float] | None
    zero_error: float
    zero_steady: bool
    noise: float
    hold_force: list[float]
    peak_force: float
    flipped: bool
    turn: float
    tool: ToolFacts | None
    longest_gap: dict[str, float]
    release_error: float
    release_fall: float
    release_resolution: float
    release_spread: float
    filtered: bool
    slips: list[float]


@dataclass(frozen=True)
class Signals:
    """What the robot measured and did, frame O, times in seconds since the window's start.

    Attributes:
        origin: The window's start on the recording's clock [ns].
        duration: Of the window [s].
        time: Middle of each sample, shape (T,).
        position, velocity, force: Shape (T, 3).
        opening: Shape (T,), NaN where it was not recorded.
        grasp_time, release_time: Events.
        path_time, path: The hand at its native rate, for what needs more than samples.
        tool_axis: Where the hand points to (z of its frame), shape (3,).
    """

    origin: int
    duration: float
    time: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    force: np.ndarray
    opening: np.ndarray
    grasp_time: float
    release_time: float
    facts: SignalFacts
    path_time: np.ndarray
    path: np.ndarray
    tool_axis: np.ndarray

    def hand(self, times: np.ndarray | float) -> np.ndarray:
        """Tool centre point at any times, shape (..., 3)."""
        return interpolated(times, self.path_time, self.path)

    def opening_at(self, time: float) -> float:
        """Distance between the fingers [m], 0 where it was not recorded."""
        return float(np.nan_to_num(np.interp(time, self.time, self.opening)))


def signals_of(pull: Pull, params: Settings, inertia: ToolInertia | None = None) -> Signals:
    """Turn raw streams into samples. Raises UserError if the recording cannot be used.

    Args:
        inertia: The tool as the recording shows it; taken off where setup.tool does not say it.
    """
    tool, episode, recording = params.setup.tool, params.episode, pull.recording
    inertia = inertia if tool is None else None
    taken = tool or inertia
    expect_dense(recording.wrench)
    t, force, motion = pull.force_time, pull.force, pull.motion
    grasp, release = pull.grasp, pull.release
    until = (motion.time >= t[0]) & (motion.time <= release.time)
    if until.sum() < 10:
        raise UserError(f"{recording.pose.topic} stops before the release at {release.time:.3f} s")
    orientation, turn = turned(motion.turn[until])
    if turn > MOST_TURN and tool is None:
        raise UserError(
            f"the hand turns by {np.degrees(turn):.1f} degrees before the release, and the weight"
            " of the tool leaks into the force: give its mass and centre of mass as setup.tool in"
            " params.yaml (mass 0 for a force without it), or keep the hand's orientation"
        )
    if inertia is not None:
        force = force - inertia.force(motion, pull.geometry, t, release.time)
    band = band_force(t, force, motion, pull.geometry, tool, grasp, release)

    window = _window(pull, episode)
    start, period = window.start, window.period
    gaps = _gaps(pull, start, start + window.duration)

    def means(times: np.ndarray, values: np.ndarray) -> np.ndarray:
        return signal.average(times, values, start, period, window.samples)

    rate = 1 / recording.wrench.period
    cutoff = signal.cutoff_hz(params.force.cutoff, params.force.cutoff_unit)
    grid, even = signal.uniform(t, band.values, rate)
    smooth = signal.lowpass(even, rate, cutoff)
    pulled = smooth[grid < release.time - MARGIN]
    pose_grid, position, velocity = motion.velocity()
    facts = SignalFacts(
        bias=band.bias.tolist(),
        drift=band.drift.tolist(),
        zero_change=None if band.zero.change is None else band.zero.change.tolist(),
        zero_error=band.zero.error,
        zero_steady=band.zero.steady,
        noise=release.noise,
        hold_force=band.hold.tolist(),
        peak_force=float(np.linalg.norm(pulled, axis=1).max()),
        flipped=band.flipped,
        turn=turn,
        tool=taken
        and ToolFacts(taken.mass, list(taken.center), "setup.tool" if tool else "its inertia"),
        longest_gap=gaps,
        release_error=release.error,
        release_fall=release.fall,
        release_resolution=release.resolution,
        release_spread=release.spread,
        filtered=release.filtered,
        slips=[
            time - start
            for time in release.slips
            if time >= grasp - MARGIN and not _lets_back(motion, time)
        ],
    )
    return Signals(
        origin=recording.origin + round(start * 1e9),
        duration=window.duration,
        time=(np.arange(window.samples) + 0.5) * period,
        position=means(pose_grid, position),
        velocity=means(pose_grid, velocity),
        force=means(grid, smooth),
        opening=means(*pull.opening) if pull.opening else np.full(window.samples, np.nan),
        grasp_time=grasp - start,
        release_time=release.time - start,
        facts=facts,
        path_time=motion.time - start,
        path=motion.path,
        tool_axis=orientation.apply([0, 0, 1]),
    )


def _window(pull: Pull, episode: EpisodeParams) -> Window:
    """Window of the pull, all of which must have been recorded."""
    recording, grasp, release = pull.recording, pull.grasp, pull.release.time
    t, pose_t = pull.force_time, pull.motion.time
    first, last = max(t[0], pose_t[0]), min(t[-1], pose_t[-1])
    ends = recording.wrench.topic if t[-1] < pose_t[-1] else recording.pose.topic
    window = window_of(episode, first, grasp, release, MARGIN)
    slack = 1.5 * max(recording.wrench.period, recording.pose.period)
    if window.start + window.duration > last + slack:
        raise UserError(
            f"{ends} ends {last - release:+.2f} s after the release, after {last - first:.2f} s;"
            f" episode.tail asks for {episode.tail} s, episode.duration for {episode.duration} s:"
            " record for longer"
        )
    return window


def _gaps(pull: Pull, start: float, end: float) -> dict[str, float]:
    """Longest time without a message in the window [s], by topic: values are interpolated."""
    gaps = {}
    for stream in (pull.recording.wrench, pull.recording.pose):
        times = stream.seconds(pull.recording.origin)
        inside = times[(times > start) & (times < end)]
        gap = float(np.diff(inside).max()) if len(inside) > 1 else end - start
        if gap > MOST_GAP:
            raise UserError(
                f"{stream.topic} is missing for {gap:.2f} s between the lead-in and the end: more"
                f" than {MOST_GAP:g} s cannot be filled in, record again"
            )
        gaps[stream.topic] = gap
    return gaps


def _lets_back(motion: Motion, time: float) -> bool:
    """Whether the hand goes towards the fork about then, so that the force falls by itself.

    Its stamps may be late by as much as the times around `time` are apart.
    """
    before, after = motion.position(time + np.array([-LATE, LATE]))
    return bool(np.linalg.norm(before) - np.linalg.norm(after) > TURN / 2)
