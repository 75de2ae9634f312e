"""Each elastic law against closed forms, Treloar's points and its own integral."""

import csv
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq, least_squares

from rig.physics.elasticity import LAWS, TRELOAR, Law, law_of

JONES = (0.69, 1.3, 0.01, 4.0, -0.0122, -2.0)
ALL = [*map(law_of, LAWS), law_of("ogden", JONES)]
every_law = pytest.mark.parametrize("law", ALL, ids=lambda law: law.name)


def treloar(shared: Path, test: str) -> tuple[np.ndarray, np.ndarray]:
    with open(shared / "data" / "treloar_1944.csv") as stream:
        rows = [row for row in csv.DictReader(stream) if row["test"] == test]
    pairs = [(float(row["stretch"]), float(row["nominal_stress_MPa"])) for row in rows]
    return tuple(np.array(pairs).T)


def test_law_follows_treloar(shared: Path) -> None:
    """Within 5 % of every uniaxial point; neo-Hookean rubber cannot come within 20 %."""
    stretch, stress = treloar(shared, "uniaxial")
    error = TRELOAR.stress(stretch)[0] / stress - 1
    assert np.abs(error).max() < 0.05
    assert np.sqrt(np.mean(error**2)) < 0.02
    shape = stretch - stretch**-2
    best = least_squares(lambda mu: mu * shape / stress - 1, 0.3)
    assert np.abs(best.fun).max() > 0.2


@every_law
def test_derivatives(law: Law) -> None:
    """P grows with l; its slope and its integral are what they are called."""
    stretch, nudge = np.linspace(0.5, 5, 40), 1e-5
    stress, slope = law.stress(stretch)
    ahead, behind = law.stress(stretch + nudge)[0], law.stress(stretch - nudge)[0]
    np.testing.assert_allclose((ahead - behind) / (2 * nudge), slope, rtol=1e-6)
    assert (slope > 0).all()
    work = [quad(lambda x: float(law.stress(np.array(x))[0]), 1, end)[0] for end in stretch]
    np.testing.assert_allclose(law.energy(stretch), work, rtol=1e-7)
    assert np.isclose(law.stress(np.ones(1))[1][0], law.modulus, rtol=1e-12)
    assert np.isclose(float(law.stress(np.array(1.0))[0]), 0.0, atol=1e-12)


def test_moduli_are_the_textbooks() -> None:
    """3/2 sum mu a; 3 G; 3 G (1 + 3/(5 N) + 99/(175 N^2) + ...); 3 (Gc (1 - 2 e^2) + Ge); 6 W'."""
    assert np.isclose(law_of("ogden", JONES).modulus, 1.5 * np.dot(JONES[::2], JONES[1::2]))
    assert np.isclose(law_of("gent", (30.0, 0.4)).modulus, 1.2)
    chain, n = law_of("arruda_boyce", (50.0, 0.4)), 50.0
    series = 1 + 3 / 5 / n + 99 / 175 / n**2 + 513 / 875 / n**3  # exact inverse Langevin function
    assert np.isclose(chain.modulus, 1.2 * series, rtol=2e-3)
    tube = law_of("extended_tube", (0.1, 0.3, 0.8, 0.2))
    assert np.isclose(tube.modulus, 3 * (0.2 * (1 - 2 * 0.01) + 0.16))
    carroll = law_of("carroll", (0.2, 1e-3, 0.1))  # dW/dI1 + dW/dI2 at rest
    assert np.isclose(carroll.modulus, 6 * (0.2 + 4e-3 * 27 + 0.1 / (2 * np.sqrt(3))))
    assert np.isclose(law_of("lopez_pamies", (0.2, 0.6, 0.1, 3.0)).modulus, 3 * 0.3)


def test_eight_chains_by_the_exact_inverse_langevin_function() -> None:
    """Arruda and Boyce's own form, the root of coth b - 1/b = y: Cohen's fraction is within 5 %."""
    segments, shear = 12.0, 0.3
    law = law_of("arruda_boyce", (segments, shear))
    for stretch in (1.2, 1.7, 2.5, 4.0, 5.0):
        chain = np.sqrt((stretch**2 + 2 / stretch) / 3)
        y = chain / np.sqrt(segments)
        root = brentq(lambda b, y=y: 1 / np.tanh(b) - 1 / b - y, 1e-6, 1e4)
        exact = shear / 3 * np.sqrt(segments) / chain * root * (stretch - stretch**-2)
        assert np.isclose(float(law.stress(np.array(stretch))[0]), exact, rtol=0.05)


def test_the_extended_tube_is_kaliskes_energy() -> None:
    """Written out by principal stretches, as the paper's formula stands in FElupe."""
    e, b, share, shear = 0.09, 0.3, 0.9, 0.2
    law = law_of("extended_tube", (e, b, share, shear))
    for stretch in (0.7, 1.3, 2.2):
        stretches = np.array([stretch, stretch**-0.5, stretch**-0.5])
        d, e2 = np.sum(stretches**2) - 3, e**2
        chains = (1 - e2) * d / (1 - e2 * d) + np.log(1 - e2 * d)
        tubes = 2 * share * shear / b**2 * np.sum(stretches**-b - 1)
        assert np.isclose(float(law.energy(np.array(stretch))), shear / 2 * chains + tubes)
