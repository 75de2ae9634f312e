"""What rubber remembers, at one point, against integrals and SciPy's own solution."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid, quad, solve_ivp
from scipy.special import exp1, gamma, gammaincc

from rig.physics.elasticity import TRELOAR, law_of
from rig.physics.rubber import Flow, Rubber, Softening, spectrum

NONE = np.empty((0, 2))
FLOW = Flow(share=0.4, rate=100.0, power=4.0, chain=-0.7, offset=0.05)
MULLINS = Softening(damage=2.0, energy=0.1, growth=0.1)
STRAINED = Softening(damage=2.0, energy=0.3, growth=0.0, strain=1.0)
FLOWING = Rubber(1.0, NONE, 0.0, flow=FLOW)
SOFT = Rubber(1.0, NONE, 0.0, softening=MULLINS)


def stress(stretch: np.ndarray | float) -> np.ndarray:
    return TRELOAR.stress(np.asarray(stretch, float))[0]


def followed(rubber: Rubber, stretch, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Stress and memories (T, M) along `stretch(time)`, by the rates that the rubber gives."""
    at = lambda time: np.array([stretch(time)])  # noqa: E731

    def rates(time: float, memory: np.ndarray) -> np.ndarray:
        return rubber.response(at(time), memory[None])[2][0]

    start = rubber.remembering(at(times[0]), np.ones(rubber.memories))[0]
    tight = {"rtol": 1e-9, "atol": 1e-11, "max_step": (times[-1] - times[0]) / 200}
    path = solve_ivp(rates, (times[0], times[-1]), start, "LSODA", times, **tight).y.T
    return rubber.response(stretch(times), path)[0], path


def test_memory_is_the_convolution() -> None:
    """w(T) = P(0) + integral of (1 - exp(-(T - s)/tau)) dP/ds, by quadrature."""
    rubber = Rubber(1.0, np.array([[0.1, 0.2], [0.2, 3.0]]), 0.0)
    step, end = 1e-3, 2.0
    time = np.arange(0, end + step / 2, step)
    stretch = 1.2 + 0.5 * np.sin(time)
    memory = rubber.history(stretch, step)[1][-1]
    for value, tau in zip(memory, rubber.times, strict=True):

        def remembered(s: float, tau: float = tau) -> float:
            slope = TRELOAR.stress(np.array(1.2 + 0.5 * np.sin(s)))[1]
            return float(slope) * 0.5 * np.cos(s) * (1 - np.exp(-(end - s) / tau))

        assert np.isclose(value, stress(1.2) + quad(remembered, 0, end)[0], rtol=1e-5)


@pytest.mark.parametrize("slope", [0.0, 0.3])
def test_a_step_relaxes_as_its_spectrum(slope: float) -> None:
    """Box and wedge, continuous: the integral of exp(-t/tau) tau^(-slope - 1) is known.

    Between its ends a box relaxes by as much in every decade, a wedge as t^-slope.
    """
    low, high, weight = 1e-3, 1e3, 0.3
    rubber = Rubber(1.0, spectrum(weight, (low, high), 24, slope), 0.0)
    held, start = np.array([1.6]), rubber.remembering(np.array([1.0]), np.ones(24))
    times = np.geomspace(1e-4, 1e2, 13)
    memory = stress(1.6) * (1 - np.exp(-times[:, None] / rubber.times))
    share = rubber.response(np.full(13, 1.6), memory)[0] / stress(1.6) - 1

    def upper(x: float) -> float:
        """Of exp(-u) u^(slope - 1), from x on."""
        return exp1(x) if slope == 0 else gamma(slope) * gammaincc(slope, x)

    total = np.log(high / low) if slope == 0 else (low**-slope - high**-slope) / slope
    expected = [weight / total * t**-slope * (upper(t / high) - upper(t / low)) for t in times]
    np.testing.assert_allclose(share, expected, rtol=2e-2, atol=1e-4)
    fresh = rubber.response(held, start)[0][0]
    assert np.isclose(fresh, (1 + weight) * stress(1.6), rtol=1e-12)


def bergstrom_boyce(rate: float, end: float, flow: Flow) -> float:
    """Overstress of one network at `end`, written out anew: f itself, not its logarithm."""

    def flowing(time: float, f: np.ndarray) -> np.ndarray:
        elastic = np.exp(rate * time) / f
        true = elastic * stress(elastic) / TRELOAR.modulus
        chain = np.sqrt((f**2 + 2 / f) / 3) - 1 + flow.offset
        return f * flow.rate * chain**flow.chain * abs(true) ** flow.power * np.sign(true)

    until = np.log(end) / rate
    f = solve_ivp(flowing, (0, until), [1.0], "Radau", rtol=1e-9, atol=1e-11).y[0, -1]
    return float(flow.share * stress(end / f) / f)


@pytest.mark.parametrize("rate", [1e-3, 0.1, 10.0])
def test_flow_at_a_constant_strain_rate_is_another_solvers(rate: float) -> None:
    times = np.linspace(0, np.log(1.8) / rate, 50)
    stresses, path = followed(FLOWING, lambda time: np.exp(rate * time), times)
    over = stresses - stress(np.exp(rate * times))
    assert np.isclose(over[-1], bergstrom_boyce(rate, 1.8, FLOW), rtol=1e-5)
    memory = FLOWING.history(np.exp(rate * times), times[1])[1][:, 0]
    np.testing.assert_allclose(memory, path[:, 0], rtol=2e-4, atol=1e-5)


def test_a_second_loading_follows_the_first_unloading() -> None:
    """Ogden and Roxburgh: softer below the old maximum, the virgin curve beyond it."""
    slow = replace(SOFT, softening=replace(MULLINS, lag=1e-5))
    there, back = np.linspace(1.0, 1.6, 61), np.linspace(1.6, 1.0, 61)
    further = np.linspace(1.0, 1.9, 91)
    path = np.concatenate([there, back[1:], further[1:]])
    times = np.linspace(0, 10, len(path))
    stresses = followed(slow, lambda time: np.interp(time, times, path), times)[0]
    first, unloading, second = stresses[:61], stresses[60:121], stresses[120:]
    np.testing.assert_allclose(first, stress(there), rtol=1e-3, atol=1e-6)
    np.testing.assert_allclose(second[:60], unloading[::-1][:60], rtol=1e-3, atol=1e-6)
    np.testing.assert_allclose(second[62:], stress(further[62:]), rtol=1e-3)
    assert (unloading[10:-1] < 0.9 * stress(back[10:-1])).all()
    retained = unloading[30] / stress(1.3)
    worst, energy = TRELOAR.energy(1.6), TRELOAR.energy(1.3)
    width = 0.1 * TRELOAR.modulus + 0.1 * worst
    erf = quad(lambda u: 2 / np.sqrt(np.pi) * np.exp(-(u**2)), 0, (worst - energy) / width)[0]
    assert np.isclose(retained, 1 - erf / 2, rtol=1e-3)


def test_the_history_softens_as_the_rates_do() -> None:
    times = np.linspace(0, 4, 401)
    path = 1.3 - 0.3 * np.cos(2 * np.pi * times / 4)
    both = replace(SOFT, relaxation=np.array([[0.2, 0.1]]), flow=FLOW)
    _, expected = followed(both, lambda time: 1.3 - 0.3 * np.cos(2 * np.pi * time / 4), times)
    relaxed, memory = both.history(path, times[1])
    np.testing.assert_allclose(memory, expected, rtol=2e-3, atol=2e-4)
    np.testing.assert_allclose(relaxed[-100:, 2], TRELOAR.energy(path[-100:]))
    ratios = memory[300] / relaxed[300]
    np.testing.assert_allclose(both.remembering(path[300:301], ratios)[0], memory[300])
    worn = both.history(path, times[1], worst=1.9)[1]
    assert (worn[:, 2] == TRELOAR.energy(1.9)).all() and (worn[100:, 0] < memory[100:, 0]).all()


KINDS = {
    "relaxing": Rubber(1.0, np.array([[0.3, 0.1], [0.2, 2.0]]), 0.0),
    "flowing": FLOWING,
    "softening": SOFT,
    "softening by strain": Rubber(1.0, NONE, 0.0, softening=STRAINED),
    "all": Rubber(1.0, np.array([[0.3, 0.1]]), 0.0, law_of("gent", [30.0]), FLOW, MULLINS),
}


@pytest.mark.parametrize("kind", KINDS)
def test_a_closed_cycle_costs_work(kind: str) -> None:
    """From rest to rest, also through compression; again where not only virgin rubber loses."""
    times = np.linspace(0, 12, 6001)
    path = lambda time: 1 + 0.8 * np.sin(np.pi * time / 3) ** 3 * (time < 9)  # noqa: E731
    stresses = followed(KINDS[kind], lambda time: np.maximum(path(time), 0.7), times)[0]
    stretch = np.maximum(path(times), 0.7)
    work = cumulative_trapezoid(stresses, stretch, initial=0)
    first, again = np.diff(work[[0, 3000, 6000]])
    assert first > 1e-2
    assert abs(again) < 1e-9 if kind.startswith("softening") else again > 1e-2


def test_a_law_whose_energy_at_rest_is_rounded_below_zero_softens_by_strain() -> None:
    law = law_of("lopez_pamies", [0.3388, 0.717, 0.002875, 2.444])
    rubber = Rubber(1.0, NONE, 0.0, law, softening=STRAINED)
    stretch = np.append(1.0, np.nextafter(1.0, 2.0) + np.linspace(-1e-8, 1e-8, 101))
    assert law.energy(stretch).min() < 0  # else this test would show nothing
    memory = law.energy(stretch)[:, None]
    assert all(np.isfinite(array).all() for array in rubber.response(stretch, memory))
    assert np.isfinite(rubber.stored(stretch, memory)).all()
