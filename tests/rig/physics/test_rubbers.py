"""The default bands' rubbers against the measurements by others that their numbers are from."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares

from pipeline.params import Params
from rig.physics.elasticity import Law, law_of
from rig.physics.rubber import Rubber, spectrum
from rig.physics.world import pulled, rubber_of, string_of

SHORTEST = 5e-4  # s, of the rig's spectra


def rubber(params: Params, band: str) -> Rubber:
    return rubber_of(params.rig.bands[band], 1.0)


def returned(rubber: Rubber, stretch: np.ndarray, step: float) -> float:
    """Share of the work of a loop's way out that its way back gives."""
    stress = rubber.response(stretch, rubber.history(stretch, step)[1])[0]
    top = stretch.argmax()
    return -np.trapezoid(stress[top:], stretch[top:]) / np.trapezoid(
        stress[: top + 1], stretch[: top + 1]
    )


def slow(rubber: Rubber) -> Rubber:
    """Without what relaxes in seconds."""
    return replace(rubber, relaxation=np.empty((0, 2)), viscosity=0.0)


def test_band1_stiffens_as_a_silicone(params: Params, shared: Path) -> None:
    """PlatSil Gel 10; its own scale is given by the peak force."""
    stretch, stress = silicone(shared / "data/real/srmd_silicones/PlatSil_Gel_10.csv")
    inside = (stretch > 1) & (stretch < 2.2)
    stretch, stress = stretch[inside], stress[inside]

    def misfit(numbers: np.ndarray) -> np.ndarray:
        """The last number is the slack of the grips."""
        taut = np.maximum(stretch / (1 + numbers[2]), 1)
        law = Law("ogden", (numbers[0], numbers[1]))
        return (law.stress(taut)[0] - stress) / stress.max()

    limits = [1e-4, 1.0, 0.0], [1.0, 10.0, 0.03]
    fit = least_squares(misfit, [0.03, 3.0, 0.01], bounds=limits)
    ours = params.rig.bands["band1"].constants
    np.testing.assert_allclose(ours, fit.x[:2], rtol=3e-3)
    assert np.sqrt(np.mean(fit.fun**2)) < 0.004

    slope = law_of("ogden", ours).stress(np.linspace(1, 2.2, 121))[1]
    assert 20 < slope.argmin() < 40 and slope[-1] > 1.4 * slope.min()  # at 1.3, and then up


def silicone(file: Path) -> tuple[np.ndarray, np.ndarray]:
    """Stretch and nominal stress [MPa], by ascending stretch."""
    lines = file.read_text(encoding="utf-8", errors="replace").splitlines()
    begin = next(i for i, line in enumerate(lines) if line.startswith("Time (s)")) + 1
    rows = np.array([line.split(";")[3:5] for line in lines[begin:] if line[:1].isdigit()], float)
    rows = rows[np.argsort(rows[:, 0], kind="stable")]
    return 1 + rows[:, 0], rows[:, 1]


def test_band2_loses_what_a_measured_loop_loses(params: Params, shared: Path) -> None:
    """A rubber band loaded and unloaded by weights: the path is the measured one, ten seconds each.

    Once softened it loses by flow alone, which grows little with the rate and does not vanish.
    """
    file = shared / "data/real/elastic_launches/school_band_loading.csv"
    load, length = np.genfromtxt(file, delimiter=",", skip_header=1, usecols=(1, 2)).T
    top = np.argmax(length)
    loading, unloading = slice(0, top + 1), slice(top + 1, None)
    measured = -np.trapezoid(load[unloading], length[unloading]) / np.trapezoid(
        load[loading], length[loading]
    )
    step, band = 0.05, slow(rubber(params, "band2"))
    times = np.arange(0, 10 * (len(load) - 1) + step / 2, step)
    path = np.interp(times, 10 * np.arange(len(load)), length / length[0])
    assert measured == pytest.approx(0.797, abs=1e-3)
    assert returned(band, path, step) == pytest.approx(measured, abs=5e-3)
    twice = np.concatenate([path, path[1:]])
    memory = band.history(twice, step)[1]
    stress = band.response(twice, memory)[0][len(path) - 1 :]
    peak = path.argmax()
    again = -np.trapezoid(stress[peak:], path[peak:]) / np.trapezoid(
        stress[: peak + 1], path[: peak + 1]
    )
    assert 0.90 < again < 0.93  # (1 - pi/2 tan delta) with 0.05 is 0.92


@pytest.mark.parametrize(("seconds", "least"), [(4.0, 0.09), (400.0, 0.05), (40_000.0, 0.02)])
def test_band2_loses_in_slow_cycles_too(params: Params, seconds: float, least: float) -> None:
    path = np.interp(np.linspace(0, 2, 801), [0, 1, 2], [1.0, 1.627, 1.0])
    flowing = replace(slow(rubber(params, "band2")), softening=None)
    assert 1 - returned(flowing, path, seconds / 800) > least


def test_band3_relaxes_as_latex_in_a_day(params: Params, shared: Path) -> None:
    """A box over all of the day has as much a decade as the rig's, which ends at 10^3 s."""
    file = shared / "data/real/latex_relaxation_24h/latex_relaxation_24h.csv"
    data = np.genfromtxt(file, delimiter=",", names=True)
    begin = np.argmax(data["step"] == 2)
    ramp = data["time_s"][begin]
    held = np.geomspace(2, data["time_s"][-1] - ramp, 120)
    force = np.interp(ramp + held, data["time_s"], data["load_N"]) / data["load_N"][-1]
    weight, times = spectrum(1.0, (SHORTEST, 1e5), 40, 0.0).T
    owed = times / ramp * -np.expm1(-ramp / times) * np.exp(-held[:, None] / times)
    columns = np.stack([np.ones(len(held)), owed @ weight], axis=1)
    level, slope = np.linalg.lstsq(columns, force, rcond=None)[0]
    misfit = columns @ [level, slope] - force
    assert np.sqrt(np.mean(misfit**2)) < 0.018
    a_decade = slope / level / np.log10(1e5 / SHORTEST)
    ours = params.rig.bands["band3"].spectrum
    assert ours is not None and ours.times == (SHORTEST, 1e3) and ours.slope == 0
    assert ours.weight / np.log10(1e3 / SHORTEST) == pytest.approx(a_decade, rel=0.01)


@pytest.mark.parametrize("frequency", [10.0, 30.0, 100.0])
def test_band3s_loss_factor_is_that_of_natural_rubber(params: Params, frequency: float) -> None:
    """0.05 to 0.15 at 10 to 100 Hz (materialmap), by the closed form of its branches."""
    band, rate = rubber(params, "band3"), 2 * np.pi * frequency
    part = rate * band.times
    loss = np.sum(band.weights * part / (1 + part**2)) + band.viscosity * rate
    stored = 1 + np.sum(band.weights * part**2 / (1 + part**2))
    assert 0.045 < loss / stored < 0.15


@pytest.mark.parametrize("band", ["band2", "band3"])
def test_a_minutes_rest_forgets_all_but_the_softening(params: Params, band: str) -> None:
    """What a launch starts with: what is left of the recorded pull moves a held force by 0.2 %."""
    string, step, rest = string_of(params, band), 0.01, 60.0
    recorded = pulled(string, np.array([0.0, -0.4, 0.0]))[1]
    _, stretch, _, memory = pulled(string, np.array([0.0, -0.30, -0.15]), again=True)
    path = np.concatenate([recorded, np.ones(round(rest / step)), stretch])
    true = string.rubber.history(path, step)[1][-1:]
    forces = [string.rubber.response(stretch[-1:], state)[0][0] for state in (true, memory[-1:])]
    assert forces[0] == pytest.approx(forces[1], rel=2.5e-3)
