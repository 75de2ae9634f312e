"""Streams of the formulas of `bag`, with a hand that may turn and a tool that the sensor feels.

Nothing is written: what reading does is tested elsewhere.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np
from scipy.spatial.transform import Rotation

from sling2sim2real.recording.frames import Geometry
from sling2sim2real.recording.streams import Stream
from sling2sim2real.recording.transforms import Transform
from validation.recordings.bag import BASE, HAND, SENSOR, START, Truth

GRAVITY = np.array([0, 0, -9.81])
LEVER = np.array([0.0, 0.0, -0.1])  # from the tool centre point to the sensor, in the hand's frame
H = 1e-4  # s, of the differences that stand for derivatives of the formulas


@dataclass(frozen=True)
class Played:
    """What is recorded.

    Attributes:
        turn: Of the hand about its x and z axes while it is lifted and pulled [rad].
        mass, center: Of the tool, in the sensor's frame.
        fixed: The wrench is given in the robot's base.
    """

    truth: Truth = field(default_factory=Truth)
    turn: float = 0.0
    mass: float = 0.0
    center: tuple[float, float, float] = (0.01, -0.02, 0.05)
    fixed: bool = False
    rate: int = 1000
    pose_rate: int = 500

    def hand(self, t: np.ndarray) -> np.ndarray:
        return np.array([self.truth.hand(x) for x in t])

    def orientation(self, t: np.ndarray) -> Rotation:
        """The hand's frame into frame O at times (T,)."""
        x = np.clip((t - 0.8) / 1.6, 0, 1)
        angle = self.turn * x**3 * (10 - 15 * x + 6 * x * x)
        return HAND * Rotation.from_rotvec(angle[:, None] * [0.8, 0.0, 0.6])

    def middle(self, t: np.ndarray) -> np.ndarray:
        """The tool's centre of mass, frame O."""
        return self.hand(t) + self.orientation(t).apply(self.center_in_hand)

    @property
    def center_in_hand(self) -> np.ndarray:
        return SENSOR.apply(self.center) + LEVER

    def wrench(self, t: np.ndarray) -> np.ndarray:
        """Without noise and bias, in the wrench's frame."""
        bent = self.middle(t + H) - 2 * self.middle(t) + self.middle(t - H)
        band = np.array([self.truth.force(x) for x in t])
        response = band + self.mass * (GRAVITY - bent / H**2)
        frame = BASE[0] if self.fixed else self.orientation(t) * SENSOR
        return self.truth.sign * frame.inv().apply(response)

    def recording(self) -> SimpleNamespace:
        """With the streams that signals and delays need."""
        truth, random = self.truth, np.random.default_rng(2)
        t = np.arange(int(truth.end * self.rate)) / self.rate
        wrench = self.wrench(t) + truth.bias
        wrench += random.normal(0, truth.noise, wrench.shape)
        u = np.arange(int(truth.end * self.pose_rate)) / self.pose_rate
        place = BASE[0].inv().apply(self.hand(u) - BASE[1])
        place += random.normal(0, 2e-5, place.shape)
        quats = (BASE[0].inv() * self.orientation(u)).as_quat()
        v = np.arange(int(truth.end * 50)) / 50
        fingers = np.where((v >= truth.grasp) & (v < truth.release + 0.03), 0.016, 0.08)
        return SimpleNamespace(
            path="played.mcap",
            origin=START,
            wrench=stream("/ft/wrench", t, wrench),
            pose=stream("/arm/pose", u, np.hstack([place, quats])),
            gripper=stream("/gripper", v, fingers[:, None]),
        )

    def geometry(self) -> Geometry:
        base = Transform(*BASE)
        sensor = base if self.fixed else Transform(SENSOR, LEVER)
        nowhere = Transform.identity()
        return Geometry(base, nowhere, nowhere, sensor, self.fixed, {})


def stream(topic: str, t: np.ndarray, values: np.ndarray) -> Stream:
    return Stream(topic, "", START + np.round(t * 1e9).astype(np.int64), values, 0.0, 0)
