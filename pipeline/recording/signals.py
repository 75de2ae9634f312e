"""Signals of an episode: tared force in frame O, end-effector motion, events, window."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from pipeline.base.errors import UserError
from pipeline.episode import signal
from pipeline.recording.events import MARGIN, events_of, opening_of
from pipeline.recording.geometry import Geometry, turned
from pipeline.recording.input.reader import Recording
from pipeline.recording.motion import VELOCITY_WINDOW, Motion, expect_dense
from pipeline.recording.tare import band_force
from pipeline.recording.tool import Wrench
from pipeline.recording.tool_inertia import ToolInertia
from pipeline.recording.window import Window

MOST_TURN = np.deg2rad(5.0)  # of the hand; beyond it the tool's weight has to be known


@dataclass(frozen=True)
class Signals:
    """What the robot measured and did, frame O, times in seconds since the window's start.

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
    filter: object,
    tool: object | None = None,
    inertia: ToolInertia | None = None,
) -> Signals:
    """Turn raw streams into samples.

    Args:
        episode, filter: params.episode and params.force.
        tool: setup.tool, which has mass and center, or None.
        inertia: The tool as the recording shows it; it is taken off where `tool` is None.

    Raises:
        UserError: if the recording cannot be used, in one line that begins with its path.
    """
    inertia = inertia if tool is None else None
    try:
        return _signals(recording, geometry, episode, filter, tool, inertia)
    except UserError as error:
        raise UserError(f"{recording.path}: {error}") from None


def _signals(
    recording: Recording,
    geometry: Geometry,
    episode: object,
    filter: object,
    tool: object | None,
    inertia: ToolInertia | None,
) -> Signals:
    expect_dense(recording.wrench)
    origin = int(recording.wrench.stamp[0])
    t, raw = recording.wrench.seconds(origin), recording.wrench.values
    motion = Motion.of(recording.pose, geometry, origin)
    grasp, release = events_of(recording, motion)
    orientation, turn = _orientation(recording, motion, release.time, tool)

    if inertia is not None:
        raw = raw - inertia.force(motion, geometry, t, release.time)
    wrench = Wrench.of(t, raw, motion, geometry, tool, release.time)
    band = band_force(wrench, motion.position(release.time), tool, grasp, release)
    window = Window.of(recording, grasp, release.time, episode)

    rate = 1 / recording.wrench.period
    cutoff = signal.cutoff_hz(filter.cutoff, filter.cutoff_unit)
    grid, even = signal.uniform(t, band.values, rate)
    smooth = signal.lowpass(even, rate, cutoff)
    pulled = smooth[grid < release.time - MARGIN]
    pose_grid, position, velocity = motion.velocity()
    gripper = opening_of(recording, origin)

    start = window.start
    facts = {
        "bias": band.bias.tolist(),
        "drift": band.drift.tolist(),
        "noise": release.noise,
        "hold_force": band.hold.tolist(),
        "peak_force": float(np.linalg.norm(pulled, axis=1).max()),
        "flipped": band.flipped,
        "turn": turn,
        "tool": _tool_facts(tool, "setup.tool") or _tool_facts(inertia, "its inertia"),
        "rate": rate,
        "longest_gap": window.gaps,
        "cutoff_hz": cutoff,
        "release_error": release.error,
        "release_resolution": release.resolution,
        "slips": [time - start for time in release.slips],
        "velocity_window": VELOCITY_WINDOW,
        "twist_difference": _twist_difference(recording, origin, pose_grid, velocity),
    }
    return Signals(
        origin=origin + round(start * 1e9),
        time=(np.arange(window.samples) + 0.5) * window.period,
        position=window.mean(pose_grid, position),
        velocity=window.mean(pose_grid, velocity),
        force=window.mean(grid, smooth),
        opening=window.mean(*gripper) if gripper else np.full(window.samples, np.nan),
        grasp_time=grasp - start,
        release_time=release.time - start,
        facts=facts,
        path_time=motion.time - start,
        path=motion.path,
        tool_axis=orientation.apply([0, 0, 1]),
    )


def _orientation(
    recording: Recording, motion: Motion, release: float, tool: object | None
) -> tuple[Rotation, float]:
    """Mean orientation of the hand until the release [s], and how far it turns from it [rad]."""
    used = (motion.time >= 0) & (motion.time <= release)
    if used.sum() < 10:
        raise UserError(f"{recording.pose.topic} stops before the release at {release:.3f} s")
    orientation, turn = turned(motion.turn[used])
    if turn > MOST_TURN and tool is None:
        raise UserError(
            f"the hand turns by {np.degrees(turn):.1f} degrees before the release, and the weight"
            " of the tool leaks into the force: give its mass and centre of mass as setup.tool in"
            " params.yaml (mass 0 for a force without it), or keep the hand's orientation"
        )
    return orientation, turn


def _tool_facts(tool: object | None, source: str) -> dict | None:
    return tool and {"mass": tool.mass, "center": list(tool.center), "source": source}


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
