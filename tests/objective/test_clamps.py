"""The mounting is found again from a slack band that hangs by another angle and bends stiffer."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from pipeline.base.errors import UserError
from pipeline.episode.episode import Episode
from pipeline.episode.signal import average, uniform
from pipeline.objective.clamps import calibrate_clamps, nominal_young, slack_part
from pipeline.objective.loss import EpisodeLoss
from pipeline.params import load
from pipeline.sling.interaction import interact
from pipeline.sling.model import Sling

PARAMS = load("params.yaml")
BAND = SimpleNamespace(mass=0.03, diameter=0.01, rest_length=0.52)
THETA = np.array([3e5, 0.45, 4e-3, 1.0, 1.0])
SOLID = THETA[0] * np.pi * 0.005**4 / 4
ANGLE, RIGIDITY = np.deg2rad(15.0), 3.0


def surface(line: np.ndarray, radius: float, rng) -> np.ndarray:
    """Random points on the tube around a centre line (L, 3), as a camera would see it."""
    part = rng.uniform(0, len(line) - 1, 400)
    first = np.minimum(part.astype(int), len(line) - 2)
    edge = line[first + 1] - line[first]
    point = line[first] + (part - first)[:, None] * edge
    away = rng.normal(size=point.shape)
    away -= (away * edge).sum(1, keepdims=True) * edge / (edge**2).sum(1, keepdims=True)
    return (point + radius * away / np.linalg.norm(away, axis=1, keepdims=True)).astype(np.float32)


@pytest.fixture(scope="module")
def episode() -> Episode:
    """Hang, grasp at 0.6 s, lift by 1.6 s, pull to 0.4 m by 4 s, hold, release at 4.8 s."""
    time = 0.015 + 0.03 * np.arange(190)

    def smooth(start: float, end: float) -> np.ndarray:
        part = np.clip((time - start) / (end - start), 0, 1)
        return part**3 * (10 - 15 * part + 6 * part**2)

    position = np.stack([0 * time, -0.4 * smooth(1.6, 4.0), -0.2 * (1 - smooth(0.6, 1.6))], axis=1)
    empty = Episode(
        band="known",
        time=time,
        position=position,
        velocity=np.gradient(position, 0.03, axis=0),
        force=np.zeros((190, 3)),
        opening=np.full(190, np.nan),
        cloud_time=np.arange(170) / 30,
        clouds=[np.zeros((0, 3), np.float32)] * 170,
        grasp_time=0.6,
        release_time=4.8,
        camera=np.array([0.8, 0.3, 0.5]),
    )
    clamps = {"clamp_direction": [np.sin(ANGLE), 0.0, -np.cos(ANGLE)]}
    clamps["flexural_rigidity"] = RIGIDITY * SOLID
    truth = Sling.of(BAND, PARAMS.setup, PARAMS.sling, clamps)
    rollouts = interact(truth, empty, THETA)
    rng = np.random.default_rng(0)
    grid, force = uniform(rollouts.times, rollouts.force[0], 1000.0)
    return replace(
        empty,
        force=average(grid, force, 0.0, 0.03, 190),
        clouds=[surface(line, 0.005, rng) for line in rollouts.center_line[0]],
    )


def test_angle_and_rigidity_are_found(episode):
    sling = Sling.of(BAND, PARAMS.setup, PARAMS.sling)
    found = calibrate_clamps(
        sling, episode, lambda part: EpisodeLoss.plain(PARAMS, part, sling), workers=2
    )
    assert found["clamp_angle_deg"] == pytest.approx(15.0, abs=5.0)
    assert found["flexural_rigidity"] == pytest.approx(RIGIDITY * SOLID, rel=0.25)
    assert found["loss"]["fitted"] < found["loss"]["solid_and_vertical"]


def test_the_slack_part_ends_before_the_band_is_taut(episode):
    """And the taut one tells the modulus within 5 %: the string leaves out bending and weight."""
    part = slack_part(episode)
    assert 1.6 < part.time[-1] < 4.0
    assert np.abs(part.force).max() < 0.1 * np.abs(episode.force).max()
    assert part.cloud_time[-1] <= part.time[-1] + 0.03
    sling = Sling.of(BAND, PARAMS.setup, PARAMS.sling)
    assert nominal_young(sling, episode) == pytest.approx(THETA[0], rel=0.05)


def test_a_recording_without_slack_is_refused(episode):
    with pytest.raises(UserError, match="hanging slack"):
        slack_part(replace(episode, grasp_time=3.0))
