"""The mounting is found again from a slack band that hangs by another angle and bends stiffer."""

from dataclasses import replace

import numpy as np
import pytest

from sling2sim2real.base.errors import UserError
from sling2sim2real.episode.episode import Episode
from sling2sim2real.identification.clamps import calibrate_clamps, nominal_young, slack_part
from sling2sim2real.identification.results.theta import Mounting
from sling2sim2real.simulator.model import ClampedBand
from sling2sim2real.simulator.parameters import Parameters
from tests.identification.objective.pulls import PARAMS, pulled, sling_of
from validation.synthetic import own_law_episode

YOUNG = 3e5
THETA = Parameters.of("neo_hookean", [YOUNG, 0.45, 4e-3, 1.0, 1.0])
SOLID = YOUNG * np.pi * 0.005**4 / 4
ANGLE, RIGIDITY = np.deg2rad(15.0), 3.0


@pytest.fixture(scope="module")
def sling() -> ClampedBand:
    return sling_of(0.03)


@pytest.fixture(scope="module")
def episode(sling: ClampedBand) -> Episode:
    """Hang, grasp at 0.6 s, lift by 1.6 s, pull to 0.4 m by 4 s, hold, release at 4.8 s."""
    direction = (np.sin(ANGLE), 0.0, -np.cos(ANGLE))
    clamps = Mounting(clamp_direction=direction, flexural_rigidity=RIGIDITY * SOLID)
    truth = sling_of(0.03, clamps)
    empty = pulled(190, 170, 0.6, (0.6, 1.6), (1.6, 4.0), 4.8)
    return own_law_episode(truth, empty, THETA, cutoff=35.65, force_noise=0.0, depth_noise=0.0)


def test_angle_and_rigidity_are_found(sling, episode):
    calibration = calibrate_clamps(PARAMS, sling, episode, workers=2)
    assert calibration.clamp_angle_deg == pytest.approx(15.0, abs=5.0)
    assert calibration.flexural_rigidity == pytest.approx(RIGIDITY * SOLID, rel=0.25)
    assert calibration.loss["fitted"] < calibration.loss["solid_and_vertical"]


def test_the_slack_part_ends_before_the_band_is_taut(sling, episode):
    """And the taut one tells the modulus within 5 %: the string leaves out bending and weight."""
    part = slack_part(episode)
    assert 1.6 < part.time[-1] < 4.0
    assert np.abs(part.force).max() < 0.1 * np.abs(episode.force).max()
    assert part.cloud_time[-1] <= part.time[-1] + 0.03
    assert nominal_young(sling, episode) == pytest.approx(YOUNG, rel=0.05)


def test_a_recording_without_slack_is_refused(episode):
    with pytest.raises(UserError, match="hanging slack"):
        slack_part(replace(episode, grasp_time=3.0))
