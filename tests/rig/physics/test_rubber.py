import csv
from pathlib import Path

import numpy as np
from scipy.integrate import quad
from scipy.optimize import least_squares

from pipeline.rig.physics.rubber import UNIT_MODULUS, Rubber, energy_density, nominal_stress


def treloar(shared: Path, test: str) -> tuple[np.ndarray, np.ndarray]:
    with open(shared / "data" / "treloar_1944.csv") as stream:
        rows = [row for row in csv.DictReader(stream) if row["test"] == test]
    pairs = [(float(row["stretch"]), float(row["nominal_stress_MPa"])) for row in rows]
    return tuple(np.array(pairs).T)


def test_law_follows_treloar(shared: Path) -> None:
    """Within 5 % of every uniaxial point; neo-Hookean rubber cannot come within 20 %."""
    stretch, stress = treloar(shared, "uniaxial")
    error = nominal_stress(stretch)[0] / stress - 1
    assert np.abs(error).max() < 0.05
    assert np.sqrt(np.mean(error**2)) < 0.02
    shape = stretch - stretch**-2
    best = least_squares(lambda mu: mu * shape / stress - 1, 0.3)
    assert np.abs(best.fun).max() > 0.2


def test_refit_from_ogdens_own_numbers_gives_the_same_law(shared: Path) -> None:
    stretch, stress = treloar(shared, "uniaxial")
    biaxial, biaxial_stress = treloar(shared, "equibiaxial")
    squeezed = biaxial**-2.0  # equal to uniaxial compression, true stress -sigma
    stretches = np.concatenate([stretch, squeezed])
    stresses = np.concatenate([stress, -biaxial_stress * biaxial / squeezed])
    weights = np.concatenate([np.ones(len(stretch)), np.full(len(biaxial), 0.1)])

    def ogden(numbers: np.ndarray, at: np.ndarray) -> np.ndarray:
        pairs = zip(numbers[:3], numbers[3:], strict=True)
        return sum(mu * (at ** (a - 1) - at ** (-a / 2 - 1)) for mu, a in pairs)

    start = np.array([0.618, 0.00118, -0.00981, 1.3, 5.0, -2.0])
    fit = least_squares(
        lambda numbers: weights * (ogden(numbers, stretches) / stresses - 1),
        start,
        x_scale=np.abs(start),
        max_nfev=20_000,
    )
    at = np.linspace(0.5, 7.5, 50)
    at = at[np.abs(at - 1) > 0.05]
    np.testing.assert_allclose(ogden(fit.x, at), nominal_stress(at)[0], rtol=5e-3)


def test_derivatives() -> None:
    stretch, nudge = np.linspace(0.5, 7, 40), 1e-5
    stress, slope = nominal_stress(stretch)
    ahead, behind = nominal_stress(stretch + nudge)[0], nominal_stress(stretch - nudge)[0]
    np.testing.assert_allclose((ahead - behind) / (2 * nudge), slope, rtol=1e-6)
    assert (slope > 0).all()
    work = [quad(lambda x: float(nominal_stress(np.array(x))[0]), 1, end)[0] for end in stretch]
    np.testing.assert_allclose(energy_density(stretch), work, rtol=1e-8)
    assert np.isclose(nominal_stress(np.ones(1))[1][0], UNIT_MODULUS)


def test_memory_is_the_convolution() -> None:
    """w(T) = P(0) + integral of (1 - exp(-(T - s)/tau)) dP/ds, by quadrature."""
    rubber = Rubber(1.0, np.array([[0.1, 0.2], [0.2, 3.0]]), 0.0)
    step, end = 1e-3, 2.0
    time = np.arange(0, end + step / 2, step)
    stretch = 1.2 + 0.5 * np.sin(time)
    memory = rubber.memory(stretch, step)[-1]
    for value, tau in zip(memory, rubber.times, strict=True):

        def remembered(s: float, tau: float = tau) -> float:
            slope = nominal_stress(np.array(1.2 + 0.5 * np.sin(s)))[1]
            return float(slope) * 0.5 * np.cos(s) * (1 - np.exp(-(end - s) / tau))

        start = float(nominal_stress(np.array(1.2))[0])
        assert np.isclose(value, start + quad(remembered, 0, end)[0], rtol=1e-5)
