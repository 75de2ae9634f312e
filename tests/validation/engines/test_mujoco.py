"""Our simulator against MuJoCo's 3D flex, at the tolerances of the report; shorter runs of it."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from sling2sim2real.exporting.mesh import Tube
from tests.validation.engines.test_mesh import elastic_force
from validation.engines import checks
from validation.engines.mujoco_flex import FlexBand
from validation.simulator.finding import unmet


@pytest.fixture(scope="module")
def held(bench):
    return checks.pull(bench, checks.THETA, step=2e-3)


def test_its_law_is_ours(bench):
    tube = Tube.of(checks.band_of(bench), edges=4)
    band = FlexBand(tube, checks.THETA, 5e-4)
    moved = tube.rest + 0.002 * np.random.default_rng(1).standard_normal(tube.rest.shape)
    band.data.qpos[:] = (moved - tube.rest).ravel()
    mujoco.mj_forward(band.model, band.data)
    force = band.data.qfrc_passive.reshape(tube.rest.shape)
    expected = elastic_force(tube, moved, checks.THETA)
    assert force == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


def test_force_and_centre_line_while_held(held):
    assert not unmet(checks.pull_checks(held, ""))
    assert np.linalg.norm(held.force[:, -1], axis=1).min() > 15  # N: it was pulled


def test_other_forces_and_lines_would_be_noticed(held):
    other = replace(
        held,
        force=held.force * np.array([1.0, 1.03])[:, None, None],
        lines=held.lines + np.array([0.0, 0.005])[:, None, None, None],
    )
    assert len(unmet(checks.pull_checks(other, ""))) == 2


def test_a_launch_lands_at_the_same_place(bench):
    check = checks.launch_check(bench, checks.LAUNCHES[:1], step=5e-4)
    assert check.met, check


@pytest.mark.validation
def test_the_whole_comparison(bench):
    section = checks.section(bench)
    assert len(section.checks) == 2 * len(checks.PULLS) + 1
    assert not unmet(section.checks)
