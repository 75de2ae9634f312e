from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from rig.physics import string as string_module
from rig.physics.elasticity import TRELOAR, law_of
from rig.physics.rubber import Flow, Rubber, Softening
from rig.physics.string import ElasticString
from rig.physics.world import bent_at
from rig.recorder.interaction import hang

ELASTIC = Rubber(2e5, np.zeros((0, 2)), 2e-3)
DRAWN = np.array([0.0, -0.4, 0.0])


@pytest.fixture
def string() -> ElasticString:
    return ElasticString(
        edges=40,
        length=0.52,
        diameter=0.01,
        mass=0.023,
        clamps=np.array([[-0.1375, 0.0, 0.0], [0.1375, 0.0, 0.0]]),
        clamp_direction=np.array([0.0, 0.0, -1.0]),
        rubber=ELASTIC,
    )


@pytest.mark.parametrize(
    ("edges", "diameter", "mass", "error"), [(40, 0.0005, 6e-5, 3e-3), (120, 0.01, 0.023, 6e-3)]
)
def test_a_held_band_pulls_as_two_straight_halves(string, edges, diameter, mass, error) -> None:
    """F = 2 A P cos: a thin band, which bends and weighs next to nothing, and one of a centimetre.

    Clamps and hand bend that, and take no more than a hundredth of its length to stretch. MuJoCo's
    solid of tetrahedra says the same (reports/simulator.md).
    """
    band = replace(string, edges=edges, diameter=diameter, mass=mass)
    y = band.at_rest(bent_at(band, DRAWN), 1e-5, held=True)
    half = np.hypot(0.1375, 0.4)
    stress = 2e5 * TRELOAR.stress(np.array([half / 0.26]))[0][0]
    expected = 2 * np.pi / 4 * diameter**2 * stress * 0.4 / half
    assert np.isclose(band.at_middle(y)[1], expected, rtol=error)
    stretched = band.stretch(y[:, :3]) > 0.95 * half / 0.26
    assert band.sizes[~stretched].sum() < 0.01 * band.length


def test_forces_are_the_energys_gradient(string: ElasticString) -> None:
    rng = np.random.default_rng(0)
    string = replace(string, rubber=replace(ELASTIC, viscosity=0.0))
    x = bent_at(string, DRAWN) + 1e-4 * rng.normal(size=(string.nodes, 3))
    y = string.state(x)
    force = string.forces(y)
    for node in (1, 2, 19, 20, 21, 38, 39):
        for axis in range(3):
            nudge = np.zeros_like(y)
            nudge[node, axis] = 1e-6
            slope = (string.energy(y + nudge) - string.energy(y - nudge)) / 2e-6
            assert np.isclose(force[node, axis], -slope, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("relaxing", [False, True])
def test_energy_never_grows_in_the_recoil(string: ElasticString, relaxing: bool) -> None:
    branches = np.array([[0.05, 0.005], [0.05, 0.05]]) if relaxing else np.zeros((0, 2))
    lossy = replace(string, rubber=replace(ELASTIC, relaxation=branches))
    y = lossy.at_rest(bent_at(lossy, DRAWN), 1e-6, held=True)
    states = lossy.integrate(y, np.linspace(0, 0.4, 201), 1e-6)[1]
    energies = np.array([lossy.energy(state) for state in states])
    lost = -np.diff(energies)
    if relaxing:  # the branches may give back what they hold
        assert (energies <= energies[0] * (1 + 1e-6)).all()
    else:
        assert (lost > -1e-6 * energies[0]).all()
    assert energies[-1] < 0.6 * energies[0]


SOFTENINGS = {
    "softening": Softening(2.0, 0.1, 0.1),
    "by strain": Softening(2.0, 0.3, 0.0, strain=1.0),
}


@pytest.mark.parametrize("kind", ["flow", *SOFTENINGS])
def test_energy_is_balanced_by_what_the_rubber_loses(string, monkeypatch, kind) -> None:
    """The recoil of a band that was drawn on, without air: s sigma e' of each edge, or nothing."""
    monkeypatch.setattr(string_module, "AIR_DENSITY", 0.0)
    flow = Flow(share=0.5, rate=300.0, power=3.0, chain=-0.7, offset=0.05)
    memories = {"flow": flow} if kind == "flow" else {"softening": SOFTENINGS[kind]}
    rubber = replace(ELASTIC, viscosity=0.0, law=law_of("extended_tube"), **memories)
    ratios = np.array([0.6 if kind == "flow" else 1.3])
    band = replace(string, rubber=rubber)
    y = band.at_rest(bent_at(band, DRAWN), 1e-6, held=True, memory=ratios)
    times = np.linspace(0, 0.015, 301)
    states = band.integrate(y, times, 1e-7)[1]
    energies = np.array([band.energy(state) for state in states])
    power = np.zeros(len(times))
    if kind == "flow":
        for i, state in enumerate(states):
            stretch, memory = band.stretch(state[:, :3]), state[:-1, 6:]
            elastic = stretch / np.exp(memory[:, 0])
            rate = rubber.response(stretch, memory)[2][:, 0]
            lost = flow.share * elastic * rubber.law.stress(elastic)[0] * rate
            power[i] = band.stiffness * np.sum(band.sizes * lost)
        assert (power >= 0).all()
    lost = cumulative_trapezoid(power, times, initial=0)
    assert np.abs(energies + lost - energies[0]).max() < 5e-4 * energies[0]
    assert (lost[-1] > 0.01 * energies[0]) == (kind == "flow")


def test_a_held_band_of_any_memory_is_at_rest(string: ElasticString) -> None:
    """No node moves though every edge has another stretch, and the memories have their ratios."""
    rubber = Rubber(
        2e5,
        np.array([[0.2, 0.1]]),
        2e-3,
        flow=Flow(0.5, 300.0, 3.0, -0.7, 0.05),
        softening=Softening(2.0, 0.1, 0.1),
    )
    ratios = np.array([0.8, 0.7, 1.2])
    band = replace(string, rubber=rubber)
    y = band.at_rest(bent_at(band, DRAWN), 1e-6, held=True, memory=ratios)
    force = band.forces(y)
    force[[0, band.middle, -1]] = 0.0
    assert np.abs(force).max() < 1e-6 * np.linalg.norm(band.at_middle(y))
    stretch = band.stretch(y[:, :3])
    np.testing.assert_allclose(y[:-1, 7], 0.7 * np.log(stretch), rtol=1e-12)
    np.testing.assert_allclose(y[:-1, 8], 1.2 * TRELOAR.energy(stretch), rtol=1e-12)


def test_hanging_band(string: ElasticString) -> None:
    """It is at rest and symmetric, and hangs nearly as deep as two straight halves would."""
    nodes = hang(string, 1e-6)
    force = string.forces(string.state(nodes))
    assert np.abs(force[1:-1]).max() < 1e-5
    np.testing.assert_allclose(nodes[:, 0], -nodes[::-1, 0], atol=1e-7)
    assert -0.2207 < nodes[string.middle, 2] < -0.17
    assert np.isclose(np.linalg.norm(np.diff(nodes, axis=0), axis=1).sum(), 0.52, rtol=0.01)


@pytest.mark.parametrize("stretch", [1.0, 2.0])
def test_drag_is_a_cylinders(string: ElasticString, stretch: float) -> None:
    """rho C d L V^2 / 2 of a straight band that moves across itself, none along itself."""
    straight = replace(string, length=0.275 / stretch, clamp_direction=np.array([1.0, 0.0, 0.0]))
    x = (stretch * np.append(0, np.cumsum(straight.sizes)) - 0.1375)[:, None] * [1.0, 0.0, 0.0]
    still, moving, along = (straight.state(x) for _ in range(3))
    moving[:, 4], along[:, 3] = 7.0, 7.0
    at_rest = straight.forces(still)
    expected = -0.5 * 1.2 * 1.1 * 0.01 / np.sqrt(stretch) * 0.275 * 7**2
    drag = (straight.forces(moving) - at_rest).sum(axis=0)
    np.testing.assert_allclose(drag, [0, expected, 0], atol=1e-9)
    np.testing.assert_allclose(straight.forces(along), at_rest, atol=1e-9)
