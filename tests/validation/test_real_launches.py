"""Fits to measured launches: against energy's conservation, and on the measurements themselves."""

import numpy as np
import pytest

from pipeline.layout import ROOT
from validation import real_launches
from validation.real_launches import FILE, Slingshot

DATA = ROOT.parent / "shared/data/real" / FILE
DAMPING = 1e-3  # s


@pytest.fixture
def band() -> Slingshot:
    """A slingshot that was never measured, with pellets from a quarter to eight times its mass."""
    return Slingshot(
        name="band_A", draw=0.8, slack=0.268, weight=10.0, mass=2e-3 * np.array([0.25, 1, 2, 4, 8]),
        speed=np.ones(5), scatter=np.zeros(5), sized_mass=2e-3, section=4e-6,
    )  # fmt: skip


def test_speeds_follow_from_the_energy_of_the_stretched_band(band) -> None:
    """A heavy pellet's, hardly damped: all energy is in it and, a third of its mass, the band."""
    modulus, fork = 1.3e6, real_launches.HALF_FORK
    stretch = np.hypot(fork, band.draw) / np.hypot(fork, band.slack)
    shear, length = modulus / 3, 2 * np.hypot(fork, band.slack)
    energy = shear / 2 * (stretch**2 + 2 / stretch - 3) * band.section * length
    expected = np.sqrt(2 * energy / (band.mass + band.sized_mass / 3))
    done = real_launches.launches(band, modulus, band.sized_mass, 1e-5, band.mass)
    assert done.speed[-2:] == pytest.approx(expected[-2:], rel=0.02)
    pull = 2 * shear * (stretch - stretch**-2) * band.section * band.draw
    assert done.hold_force == pytest.approx(pull / np.hypot(fork, band.draw), rel=0.02)


def test_a_fit_finds_the_modulus_and_the_mass_that_made_the_speeds(band) -> None:
    made = real_launches.launches(band, 1.1e6, 2.6e-3, DAMPING, band.mass)
    measured = Slingshot(**{**vars(band), "speed": made.speed, "weight": made.hold_force[0]})
    fit = real_launches.fitted(measured, DAMPING, np.array([True, False, True, False, True]))
    assert (fit.modulus, fit.mass) == pytest.approx((1.1e6, 2.6e-3), rel=0.01)
    assert np.abs(real_launches.off(measured, fit, DAMPING)).max() < 0.1  # %
    assert real_launches.modulus_by_weight(measured, DAMPING) == pytest.approx(1.1e6, rel=0.002)


@pytest.mark.skipif(not DATA.is_file(), reason=f"measured launches are not there: {DATA}")
def test_three_pellets_tell_the_speeds_of_the_others() -> None:
    band = next(band for band in real_launches.read(DATA) if band.name == "band_B")
    chosen = real_launches.SPLITS["lightest, middle, heaviest"](len(band.mass))
    fit = real_launches.fitted(band, 1.15e-3, chosen)
    rod = real_launches.rms(real_launches.off(band, fit, 1.15e-3)[~chosen])
    assert rod < 1 < real_launches.rms(real_launches.formula_off(band, chosen)[~chosen])
