"""What a recording says of the law's error: gaps of known size come back."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from pipeline.confidence.discrepancy import energy_gap, recoil_gap
from pipeline.confidence.residuals import Group
from pipeline.confidence.summary import corrected
from pipeline.objective.nuisance import along_axes
from tests.search.toy import episode


def pulled():
    """A hand that moves back at 0.1 m/s against 5 N, and moves on without a band afterwards."""
    plan = episode()
    velocity = np.tile([0.0, -0.1, 0.0], (len(plan.time), 1))
    return replace(plan, velocity=velocity, force=np.tile([0.0, 5.0, 0.0], (len(plan.time), 1)))


@pytest.mark.parametrize("share", [-0.1, 0.0, 0.02])
def test_energy_gap_of_a_force_that_is_off_by_a_share(share: float) -> None:
    plan = pulled()
    across = np.array([3.0, 0.0, -2.0])  # does no work
    assert energy_gap(plan, (1 + share) * plan.force + across) == pytest.approx(abs(share))


def recoil(distance: float, noise: float, way: float = 0.2):
    """Recoil `distance` from a middle that has travelled `way` [m], after a held band's noise."""
    grid = np.stack(np.meshgrid(np.arange(120), np.arange(20), indexing="ij"), axis=-1)
    rng, groups, parts, count = np.random.default_rng(1), [], [], 0
    for channel in ("cloud_depth", "cloud_side"):
        for phase, frames in (("taut", range(100)), ("recoil", range(100, 120))):
            where = grid[list(frames)].reshape(-1, 2)
            groups.append(Group(channel, phase, 0, count + np.arange(len(where)), where))
            offset = distance / np.sqrt(2) if phase == "recoil" else 0.0
            parts.append(offset + noise * rng.normal(size=len(where)))
            count += len(where)
    plan, line = episode(), np.zeros((120, 5, 3))
    start = [np.interp(plan.release_time, plan.time, axis) for axis in plan.position.T]
    line[:, 2] = start + np.array([0, way, 0])
    return SimpleNamespace(groups=groups), np.concatenate(parts), plan, line


@pytest.mark.parametrize(("distance", "noise"), [(0.01, 0.0), (0.01, 0.005), (0.004, 0.002)])
def test_recoil_gap_is_what_is_beyond_noise_over_the_way(distance: float, noise: float) -> None:
    assert recoil_gap(*recoil(distance, noise)) == pytest.approx(distance / 0.2, rel=0.1)


def test_noise_alone_is_no_gap() -> None:
    assert recoil_gap(*recoil(0.0, 0.003)) < 0.3 * 0.003 / 0.2


def test_without_a_picture_of_the_recoil_there_is_no_gap() -> None:
    residuals, residual, plan, line = recoil(0.01, 0.0)
    held = [group for group in residuals.groups if group.phase == "taut"]
    assert recoil_gap(SimpleNamespace(groups=held), residual, plan, line) is None


def test_without_a_picture_of_the_held_band_noise_counts_as_gap() -> None:
    residuals, residual, plan, line = recoil(0.01, 0.005)
    seen = [group for group in residuals.groups if group.phase == "recoil"]
    gap = recoil_gap(SimpleNamespace(groups=seen), residual, plan, line)
    assert gap == pytest.approx(np.hypot(0.01, 0.005 * np.sqrt(2)) / 0.2, rel=0.1)


def test_what_instruments_add_is_taken_off() -> None:
    """The forward model of the nuisances, applied to what is left, gives the recording back."""
    plan = pulled()
    ramp = np.stack([plan.time, 2 * plan.time, -plan.time], axis=1)
    clouds = [np.ones((3, 3), np.float32) for _ in plan.cloud_time]
    plan = replace(plan, force=ramp, clouds=clouds)
    said = {"force_gain": 1.1, "force_bias_y": 0.3, "force_delay": 0.004}
    said |= {"camera_delay": 0.003, "cloud_shift_z": 0.01, "air_drag": 2.0}
    found = corrected(plan, said)
    inner = slice(2, -2)
    again = 1.1 * (found.force - 0.004 * np.array([1, 2, -1]) / 1.1)
    again += along_axes({"force_bias_y": np.array([0.3])}, "force_bias")
    np.testing.assert_allclose(again[inner], plan.force[inner], atol=1e-9)
    np.testing.assert_allclose(found.cloud_time, plan.cloud_time - 0.003)
    for one in found.clouds:
        np.testing.assert_allclose(one, [[1, 1, 0.99]] * 3, rtol=1e-6)
    same = corrected(plan, {})
    np.testing.assert_array_equal(same.force, plan.force)
