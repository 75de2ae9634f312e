"""A robot's loop: aim, launch, observe, and aim better.

    python examples/robot_loop.py

The robot is SIMULATED: a model whose launches get 4 % less energy than any pull can show, and an
arm that misses the draw by a millimetre. Put your own in place of `SimulatedRobot`.
"""

from dataclasses import replace

import numpy as np

import sling2sim2real as s2s

BAND = s2s.Band(mass=0.023, diameter=0.010, rest_length=0.52)  # kg, m, m
SETTINGS = s2s.Settings.default()
TRUE = {"mooney_share": 0.3, "relaxation": 0.01, "returned_share": 0.96}
TARGET, LAUNCHES = 2.0, 3  # m


class SimulatedRobot:
    """It records a pull, and launches; it knows what nobody else does."""

    def __init__(self) -> None:
        theta = s2s.Theta(2.2e5, 0.47, 2.4e-3, 0.7, 0.6, **TRUE)
        self.world = s2s.Model(BAND, theta, settings=SETTINGS)
        self.rng = np.random.default_rng(1)

    def record(self) -> s2s.Episode:
        return s2s.episode_from_arrays(**s2s.rehearse(self.world), settings=SETTINGS)

    def launch(self, aimed: s2s.Aim) -> float:
        """Draw and wait as long as the aim says, then let go; where the projectile lands [m]."""
        y, z = np.array(aimed.draw) + self.rng.normal(0, SETTINGS.trials.actuation_error, 2)
        hand = s2s.LaunchHistory(*aimed.pull_and_pause)
        return s2s.launch(replace(self.world, history=hand), (y, z)).landing


def main() -> None:
    robot = SimulatedRobot()
    episode, identification, seen = robot.record(), None, []
    for number in range(1, LAUNCHES + 1):
        identification = s2s.identify(
            [episode], BAND, launches=seen, settings=SETTINGS, start=identification
        )
        aimed = s2s.aim(identification, TARGET)
        for warning in aimed.warnings:
            print("warning:", warning)
        low, high = aimed.interval_90
        landing = robot.launch(aimed)
        print(
            f"launch {number}: draw {aimed.draw[0]:.3f}, {aimed.draw[1]:.3f} m, expected"
            f" {low:.2f} to {high:.2f} m, landed at {landing:.2f} m ({landing - TARGET:+.2f})"
        )
        seen.append(s2s.Observed(aimed.draw, SETTINGS.trials.actuation_error, landing))


if __name__ == "__main__":
    main()
