"""The hand's path with dips: where it is when, against the dips themselves."""

import numpy as np
import pytest

from pipeline.params import Params
from rig.physics.motion import OPEN, PULLED, HandMotion
from rig.physics.world import string_of
from rig.recorder.interaction import hang, pull_and_release
from sling2sim2real.base.errors import UserError
from sling2sim2real.settings.lab import Dip
from tests.project import with_

HALFWAY = Dip(at=0.5, depth=0.05, out_time=0.25, back_time=0.5)
TWICE = (Dip(at=1.0, depth=0.1, out_time=1.0, back_time=1.5), HALFWAY)


def motion_of(*dips: Dip) -> HandMotion:
    rng = np.random.default_rng(0)
    return HandMotion.through(np.array([0.0, 0.0, -0.2]), 0.0, (0.004, 1.0), rng, dips)


def deep(dip: Dip, depth: float) -> Dip:
    return dip.model_copy(update={"depth": depth})


def test_all_that_follows_is_later_by_the_dips() -> None:
    plain, dipped = motion_of(), motion_of(*TWICE)
    late = 0.75 + 2.5
    assert (plain.opens, plain.end) == (8.0, 10.0)
    assert (dipped.opens, dipped.end) == (8.0 + late, 10.0 + late)
    after = np.linspace(PULLED, plain.end, 50)
    np.testing.assert_allclose(plain.position(after), dipped.position(after + late), atol=1e-12)
    for state in ("grip", "finger"):
        opening = np.linspace(OPEN - 0.01, OPEN + 0.2, 50)
        values = getattr(dipped, state)(opening + late)
        np.testing.assert_allclose(values, getattr(plain, state)(opening), atol=1e-9)


def test_a_dip_beyond_the_fork_is_refused() -> None:
    motion_of(deep(HALFWAY, 0.2))
    with pytest.raises(UserError, match=r"plan\.dips: a dip of 0\.21 m leads beyond the fork"):
        motion_of(deep(HALFWAY, 0.21))


def test_the_band_follows_a_dip_and_pulls_less_there(coarse: Params) -> None:
    """It slips after the dip's fingers open; pads that are too weak are reported with dips too."""
    string = string_of(coarse, "band1")
    hanging = hang(string, 1e-4)
    dip = Dip(at=1.0, depth=0.1, out_time=1.0, back_time=1.0)
    motion = motion_of(dip)
    at = [0.0, dip.out_time, dip.out_time + dip.back_time, 4.1, 4.2, 4.3]
    times = PULLED + np.array(at)
    happened = pull_and_release(string, hanging, motion, times, np.array([1.5]), coarse)
    pull = np.linalg.norm(happened.force, axis=1)
    assert pull[1] < 0.7 * pull[0] and pull[1] < 0.7 * pull[2] < 0.7 * pull[0]
    np.testing.assert_allclose(-happened.hand[:3, 1], [0.4, 0.3, 0.4], atol=2e-3)
    assert motion.opens < happened.slip_time < motion.opens + 0.004 and not pull[3:].any()
    weak = with_(coarse, "rig.pads", force=5.0)
    with pytest.raises(UserError, match="lets the band slip out at"):
        pull_and_release(string, hanging, motion, times, np.array([1.5]), weak)
