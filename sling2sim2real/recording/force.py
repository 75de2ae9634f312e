"""The band's force on the gripper: the raw force less the tool, bias and drift, in frame O."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import savgol_filter
from scipy.spatial.transform import Rotation

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.events import LEAST_LEAD_IN, MARGIN, SETTLE, Pull, Release
from sling2sim2real.recording.frames import Geometry
from sling2sim2real.recording.motion import Motion, interpolated
from sling2sim2real.settings.lab import Tool

GRAVITY = np.array([0.0, 0.0, -9.81])  # m/s^2, frame O
MOST_ASKEW = np.deg2rad(30.0)  # between the held force and the way to the fork
STRAIGHT = np.deg2rad(1.0)  # of a hand whose weight, if unknown, may be compared with the lead-in's


@dataclass(frozen=True)
class BandForce:
    """What the band does to the gripper.

    Attributes:
        values: Frame O, shape (S, 3) [N].
        flipped: The sensor reports the force of the gripper on the band.
        hold: Mean just before the release, shape (3,) [N].
        bias, drift: What was taken away beside the tool's load, in frame O [N], [N/s].
        zero: How the zero moved, in frame O.
    """

    values: np.ndarray
    flipped: bool
    hold: np.ndarray
    bias: np.ndarray
    drift: np.ndarray
    zero: Drift


def band_force(
    t: np.ndarray,
    raw: np.ndarray,
    motion: Motion,
    geometry: Geometry,
    tool: Tool | None,
    grasp: float,
    release: Release,
) -> BandForce:
    """Take the tool, the bias and the drift from a raw force, and find its sign.

    Taken away are the tool's load, then, in the sensor's frame, the lead-in's mean and the drift
    until the free hand at the end where that is steady (`drift_of`).

    Args:
        t: Times [s], shape (S,).
        raw: The wrench's frame, shape (S, 3) [N].
        tool: None where it is not known.
        grasp: Time [s].

    Raises:
        UserError: where the lead-in is too short, or the held force does not point to the fork.
    """
    load = np.zeros_like(raw)
    if tool is not None:
        center = np.array(tool.center)
        load = tool.mass * load_per_mass(motion, geometry, t, center, jump=release.time)
    turn, hand = sensor_turns(motion, geometry, t), motion.position(release.time)
    held = (t > release.time - 0.5) & (t < release.time - MARGIN / 5)
    lead_in, end = t < grasp - MARGIN, t > release.time + SETTLE
    if not held.any():
        raise UserError(f"no force in the half second before the release at {release.time:.3f} s")
    if lead_in.sum() < 20 or grasp - MARGIN - t[0] < LEAST_LEAD_IN:
        raise UserError(
            f"the band is grasped {grasp - t[0]:.2f} s after the start: record at least"
            f" {LEAST_LEAD_IN + MARGIN:.2f} s of the empty hand before, to tare the force"
        )
    usual = turn[lead_in].mean()  # pyright: ignore[reportArgumentType]

    def tared(sign: float) -> tuple[np.ndarray, np.ndarray, Drift]:
        """The force in frame O (S, 3), with the sensor's sign, and the bias and drift in it."""
        rest = raw - sign * load
        bias, late = rest[lead_in].mean(axis=0), end
        if not load.any():
            late = late & ((usual.inv() * turn).magnitude() < STRAIGHT)
        zero = drift_of(t, rest, lead_in, late, release.drop)
        force = rest - bias - zero.rate * (t - t[lead_in].mean())[:, None]
        return turn.apply(force), usual.apply(bias), zero.seen_from(usual)

    force, bias, zero = tared(1.0)
    sign = _sign(force[held].mean(axis=0), hand)
    if sign < 0 and tool is not None:  # the sensor feels its tool with the other sign, too
        force, bias, zero = tared(sign)
        if _sign(force[held].mean(axis=0), hand) > 0:
            raise UserError(
                f"a tool of {tool.mass:.3g} kg hides which sign the force has: check setup.tool and"
                " the wrench's frame"
            )
    force = sign * force
    return BandForce(force, sign < 0, force[held].mean(axis=0), bias, zero.rate, zero)


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
            f"the held force points {np.degrees(angle):.0f} degrees away from the fork: the sensor"
            " is turned otherwise than /tf_static says, or was zeroed while the band was loaded:"
            " check the wrench's frame there, zero the sensor before the grasp"
        )
    return 1.0 if cosine > 0 else -1.0


def sensor_turns(motion: Motion, geometry: Geometry, times: np.ndarray) -> Rotation:
    """The wrench's frame into frame O at times (T,): T rotations."""
    if geometry.sensor_is_fixed:
        return Rotation.from_quat(np.tile(geometry.sensor.rotation.as_quat(), (len(times), 1)))
    return motion.orientation(times) * geometry.sensor.rotation


def load_per_mass(
    motion: Motion,
    geometry: Geometry,
    times: np.ndarray,
    center: np.ndarray,
    *,
    gravity: np.ndarray = GRAVITY,
    jump: float | None = None,
) -> np.ndarray:
    """Force on the sensor of each kilogram of tool, gravity less acceleration [N/kg].

    Args:
        times: Shape (T,) [s].
        center: Of mass, in the wrench's frame [m], shape (3,); in the hand's frame where the
            wrench is given in one that does not move with the hand.
        gravity: Frame O [m/s^2]; 0 leaves the inertia alone.
        jump: When the acceleration may jump, because the hand starts back [s].

    Returns:
        Shape (T, 3), in the wrench's frame.
    """
    point = np.asarray(center) if geometry.sensor_is_fixed else geometry.sensor.apply(center)
    specific = gravity - motion.acceleration(times, point, jump)
    return sensor_turns(motion, geometry, times).inv().apply(specific)


BLOCK = 0.05  # s: means over so long are independent of one another
LEAST_BLOCKS = 6
SURE = 4.0  # standard errors
MATTERS = 0.01  # of the drop, from which a drift's course is looked at
OTHER = 0.5  # of a steady drift, by which its slope in a window may differ


@dataclass(frozen=True)
class Drift:
    """The sensor's zero before and after the load, in its own frame.

    Attributes:
        rate: Of a steady drift, that is to be taken out (3,) [N/s]; 0 where it is not steady.
        change: From the lead-in to the free hand at the end (3,) [N]; None where that says nothing.
        error: Standard deviation of its length [N].
        steady: Whether the course within both windows agrees with a steady drift, and that within
            one of them shows it.
    """

    rate: np.ndarray
    change: np.ndarray | None = None
    error: float = 0.0
    steady: bool = True

    def seen_from(self, turn: Rotation) -> Drift:
        """The drift in another frame, into which `turn` turns the sensor's."""
        change = None if self.change is None else turn.apply(self.change)
        return replace(self, rate=turn.apply(self.rate), change=change)


def drift_of(
    t: np.ndarray, rest: np.ndarray, lead_in: np.ndarray, end: np.ndarray, drop: float
) -> Drift:
    """How the zero moves between two windows in which the hand is free.

    Args:
        t: Times [s], shape (S,).
        rest: The sensor's force without the tool's load [N], shape (S, 3).
        lead_in, end: The windows, shape (S,).
        drop: Of the force at the release [N].
    """
    if end.sum() < 20:
        return Drift(np.zeros(3))
    change = rest[end].mean(axis=0) - rest[lead_in].mean(axis=0)
    size = float(np.linalg.norm(change))
    rate = change / (t[end].mean() - t[lead_in].mean())
    along = rest @ (change / max(size, 1e-12))
    courses = [course(t[which], along[which]) for which in (lead_in, end)]
    error = float(np.hypot(courses[0][2], courses[1][2]))
    speed = float(np.linalg.norm(rate))
    other = any(
        abs(slope - speed) > max(SURE * spread, OTHER * speed) for slope, spread, _ in courses
    )
    shown = any(SURE * spread < speed for _, spread, _ in courses)
    if size > max(MATTERS * drop, SURE * error) and (other or not shown):
        return Drift(np.zeros(3), change, error, steady=False)
    return Drift(rate, change, error)


def course(t: np.ndarray, x: np.ndarray) -> tuple[float, float, float]:
    """Slope of x (S,) [N/s], its standard error, and that of the mean [N], by means of blocks."""
    count = int((t[-1] - t[0]) / BLOCK)
    if count < LEAST_BLOCKS:
        return 0.0, np.inf, float(np.std(x))
    blocks = np.array_split(np.arange(len(t)), count)
    at, averages = (np.array([v[block].mean() for block in blocks]) for v in (t - t.mean(), x))
    slope, middle = np.polyfit(at, averages, 1)
    spread = float(np.sqrt(np.sum((averages - slope * at - middle) ** 2) / (count - 2)))
    # A slow swing makes neighbouring blocks alike: there are fewer that are independent.
    left = averages - slope * at - middle
    alike = np.clip(np.sum(left[1:] * left[:-1]) / max(np.sum(left**2), 1e-30), 0, 0.95)
    spread *= np.sqrt((1 + alike) / (1 - alike))
    return float(slope), spread / float(np.sqrt(np.sum(at**2))), spread / float(np.sqrt(count))


LONGEST = 0.1  # s of either sign
SMOOTH = 0.2  # s in which errors of the smoothed force go together
LEAST_LOAD = 8.0  # standard deviations by which the tool's mass must show
LEAST_MASS = 0.01  # kg: what weighs less is no tool
WINDOW = 0.15  # s of the fits by which the load changes
STEP = 0.002  # s of the grid on which the load is tabulated
ROUNDS = 8


@dataclass(frozen=True)
class ToolInertia:
    """The tool that the force sensor carries, as its inertia shows it.

    Attributes:
        mass, mass_error: Of the tool, and its standard deviation [kg]; negative where the sensor
            has the other sign, or takes off more than there is.
        delay, delay_error: By which the pose's stamps are late, and its standard deviation [s].
        center: Of mass [m], as in setup.tool.
    """

    mass: float
    mass_error: float
    delay: float
    delay_error: float
    center: tuple[float, ...] = (0.0, 0.0, 0.0)

    def force(
        self, motion: Motion, geometry: Geometry, times: np.ndarray, release: float
    ) -> np.ndarray:
        """Part of the raw force at times (T,) [s] that is the tool's inertia, shape (T, 3) [N].

        Not the weight: a sensor may know that, and the hand does not turn. The hand may start back
        at `release` [s].
        """
        at, jump = times + self.delay, release + self.delay
        center = np.array(self.center)
        return self.mass * load_per_mass(
            motion, geometry, at, center, gravity=np.zeros(3), jump=jump
        )


def estimate_tool_inertia(pull: Pull, tool: Tool | None) -> ToolInertia | None:
    """None where the tool does not show: the sensor knows it already, or the hand hardly moves.

    Args:
        tool: setup.tool; only its centre of mass is used, the mass is fitted.
    """
    t, raw, motion = pull.force_time, pull.force, pull.motion
    grasp, release = pull.grasp, pull.release.time
    sure = MARGIN + WINDOW / 2
    inside = (t > max(t[0], motion.time[0]) + sure) & (t < min(t[-1], motion.time[-1]) - sure)
    free = np.flatnonzero(inside & ((t < grasp - sure) | (t > release + SETTLE + sure)))
    if len(free) * pull.recording.wrench.period < WINDOW:
        return None
    center = np.zeros(3) if tool is None else np.array(tool.center)
    grid = np.arange(motion.time[0], motion.time[-1], STEP)
    load = load_per_mass(motion, pull.geometry, grid, center)
    width = 2 * round(WINDOW / STEP / 2) + 1
    change = np.asarray(savgol_filter(load, width, 3, deriv=1, delta=STEP, axis=0))
    table = np.hstack([load, change])
    t, force, late = t[free], raw[free], t[free] > release

    blocks = np.unique((t / SMOOTH).astype(int), return_inverse=True)[1]
    delay, mass, errors = 0.0, 0.0, np.full(2, np.inf)
    for _ in range(ROUNDS):  # Gauss-Newton
        at = t + delay  # stamps that are late say later what happens now
        seen = np.hstack([interpolated(at, grid, table), force])
        for part in (late, ~late):  # each has a bias of its own
            seen[part] -= seen[part].mean(axis=0) if part.any() else 0.0
        columns, right = seen[:, :6].reshape(-1, 2, 3), seen[:, 6:]
        normal = np.einsum("tic,tjc->ij", columns, columns)
        if np.linalg.cond(normal) > 1e10:
            return None  # the hand rests all the time
        inverse = np.linalg.inv(normal)
        mass, product = inverse @ np.einsum("tic,tc->i", columns, right)
        left = right - np.einsum("tic,i->tc", columns, [mass, product])
        errors = _noise(left, blocks, 2 + 3 * len(np.unique(late))) * np.sqrt(np.diag(inverse))
        delay = float(np.clip(delay + product / mass, -LONGEST, LONGEST))
    if abs(delay) >= LONGEST or abs(mass) < max(LEAST_MASS, LEAST_LOAD * errors[0]):
        return None
    mass, delay_error = float(mass), float(errors[1] / abs(mass))
    return ToolInertia(mass, float(errors[0]), delay, delay_error, tuple(center.tolist()))


def _noise(left: np.ndarray, blocks: np.ndarray, fitted: int) -> float:
    """Standard deviation of residuals (T, 3), as if white: by samples or by means of blocks.

    The means tell errors that go together for longer; `fitted` parameters have made them smaller.
    """
    sizes = np.bincount(blocks)[:, None]
    means = np.stack([np.bincount(blocks, axis) for axis in left.T], axis=1) / sizes
    slow = np.sum(sizes * means**2) / max(means.size - fitted, 1)
    return float(np.sqrt(max(np.mean(left**2), slow)))


NOISE_WINDOW = 0.05  # s in which noise is looked for
LEAST_SAMPLES = 20  # in it
SLOW_WINDOW = 0.3  # s of so many samples, in which the hand moves: then only equal values tell
QUIET = 0.25  # share of the free hand's noise, below which there is none
NEAR_TOP = 0.05  # of an axis' way to its extreme value


@dataclass(frozen=True)
class FlatTop:
    """The sensor's range ends, or it stopped.

    Attributes:
        axis: Of the wrench's frame: 0, 1 or 2.
        value: At which it stops [N].
        begin, end: When it does [s].
    """

    axis: int
    value: float
    begin: float
    end: float


def flat_top(pull: Pull) -> FlatTop | None:
    """Where the noise disappears at an extreme value of the raw force, before the release."""
    t, raw = pull.force_time, pull.force
    free, until = t < pull.grasp - MARGIN, t < pull.release.time - MARGIN / 5
    count = max(LEAST_SAMPLES, round(NOISE_WINDOW / pull.recording.wrench.period))
    if free.sum() < count or until.sum() < 2 * count:
        return None
    noise = _scatter(_windows(raw[free], count)).min(axis=0)  # while it rests
    parts = _windows(raw[until], count)
    quick = count * pull.recording.wrench.period < SLOW_WINDOW
    still = _scatter(parts) <= (QUIET if quick else 0.0) * noise
    rest = raw[free].mean(axis=0)
    far = np.abs(parts.mean(axis=1) - rest)
    top = far > (1 - NEAR_TOP) * far.max(axis=0)
    loaded = far.max(axis=0) > 0.2 * far.max()
    flat = still & top & loaded & (noise > 0)
    if not flat.any():
        return None
    axis = int(np.argmax(flat.sum(axis=0)))
    flat_samples = np.flatnonzero(flat[:, axis])
    begin, end = t[flat_samples[0] * count], t[(flat_samples[-1] + 1) * count - 1]
    value = float(np.median(parts[flat_samples, :, axis]))
    return FlatTop(axis, value, float(begin), float(end))


def _windows(x: np.ndarray, count: int) -> np.ndarray:
    """Samples (S, 3) in windows, shape (W, count, 3)."""
    whole = len(x) // count
    return x[: whole * count].reshape(whole, count, 3)


def _scatter(windows: np.ndarray) -> np.ndarray:
    """Scatter of single samples in each window, (W, 3), beside what changes steadily."""
    return np.std(np.diff(windows, axis=1), axis=1) / np.sqrt(2)
