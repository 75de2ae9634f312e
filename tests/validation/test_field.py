"""The campaign of faults: what it does to a recording, and how it judges."""

import numpy as np

from tests.recording.conftest import blind
from validation.campaigns import field
from validation.campaigns.field import CORRECT, FAULTS, SILENT, is_right
from validation.recordings.streams import FORCE, POSE, Bag

__all__ = ["blind"]


def summary(modulus: float, damping: float, width: float = 0.05) -> dict:
    return {
        name: [value, value * (1 - width), value * (1 + width)]
        for name, value in (("modulus", modulus), ("damping", damping))
    }


def test_a_value_is_right_within_its_limits_and_interval() -> None:
    sound = summary(2e5, 2e-3)
    assert is_right(sound, summary(2.04e5, 2.05e-3))
    assert not is_right(sound, summary(2.06e5, 2e-3))  # 3 %
    assert not is_right(sound, summary(2.02e5, 2e-3, width=0.005))  # sure of another value
    assert not is_right(sound, summary(2e5, 4e-3, width=0.9))


def test_a_wrong_fit_that_did_not_settle_is_not_silent() -> None:
    assert field.outcome_of(right=True, settled=False, found=False) == CORRECT
    assert field.outcome_of(right=False, settled=False, found=False) == field.CAUTIONED
    assert field.outcome_of(right=False, settled=True, found=True) == field.MISNAMED
    assert field.outcome_of(right=False, settled=True, found=False) == SILENT


def test_a_fault_changes_what_it_says(blind) -> None:
    sound = Bag.read(blind[0])

    def made(name: str, size: float) -> Bag:
        bag = Bag.read(blind[0])
        FAULTS[name].make(bag, size)
        return bag

    late = made("force_late", 10)
    moved = [a.stamp - b.stamp for a, b in zip(late.of(FORCE), sound.of(FORCE), strict=True)]
    assert set(moved) == {10_000_000}
    assert [message.stamp for message in late.of(POSE)] == [
        message.stamp for message in sound.of(POSE)
    ]
    turned = made("turned", 10).force
    sizes = np.linalg.norm(turned, axis=1), np.linalg.norm(sound.force, axis=1)
    np.testing.assert_allclose(*sizes)
    assert np.abs(turned - sound.force).max() > 0.1
    most = made("saturated", 0.6).force
    assert np.ptp(most, axis=0).max() < np.ptp(sound.force, axis=0).max()
    assert made("filtered", 100).force.shape == sound.force.shape
    assert len(made("another_arm", 0.05).of(FORCE)) == 2 * len(sound.of(FORCE))
