"""The rod with led ends: a chain whose top is shaken, a hanging rope, a fit, and a real rope."""

import json

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import j0

from pipeline.base.code import ROOT
from pipeline.simulator.model import GRAVITY
from pipeline.simulator.parameters import Parameters
from pipeline.simulator.records import Grip
from pipeline.simulator.rubber import NEO_HOOKEAN
from pipeline.simulator.schedule import steps
from validation.real import data
from validation.real.ropes import POISSON, YOUNG, begun, chords_of, fitted, inner, rope_of, swing
from validation.simulator.march import Driven, march
from validation.simulator.reference import ReferenceRod

MEASURED = ROOT / "../shared/data/real"
FREE = {"bending_length": 0.02, "damping": 1e-4, "drag": 1e-3}


def test_a_chain_whose_top_is_shaken_moves_as_bessel_says(params) -> None:
    """Small ones: x(s, t) = A J0(2 w sqrt(s / g)) / J0(2 w sqrt(L / g)) cos(w t), s from below."""
    length, count, shaken = 0.9, 12, 0.004
    from_below = length * (1 - np.arange(count + 1) / count)
    omega = 1.7 / 2 * np.sqrt(GRAVITY / length)
    shape = shaken * j0(2 * omega * np.sqrt(from_below / GRAVITY)) / j0(1.7)
    places = np.stack([shape, 0 * shape, from_below], axis=1)
    chords = np.linalg.norm(np.diff(places, axis=0), axis=1)
    rope = rope_of(chords, 1, FREE["bending_length"], params.sling)
    time = np.arange(0, 0.6 * 2 * np.pi / omega, 0.01)
    table = steps(time, 0.01, grip=Grip.FREE, order=2)
    table["past"][0], table["beta"][0] = 0, 1
    start, rates = begun(np.tile(places, (20, 1, 1)), chords, 1)
    top = np.zeros((len(time) - 1, 1, 3))
    top[:, 0] = np.outer(np.cos(omega * time[1:]), [shaken, 0, 0]) + [0, 0, length]
    theta = Parameters.of(NEO_HOOKEAN, [YOUNG, POISSON, 1e-4, 0.0, 1.0])
    done = march(
        ReferenceRod(rope, theta), table, start, friction=0.0,
        driven=Driven(np.array([0]), top, rates), exact=1e-8,
    )  # fmt: skip
    expected = np.outer(np.cos(omega * time[1:]), shape)
    assert np.abs(shape).max() > 2 * shaken
    off = done.x[:, :, 0] - expected
    assert np.abs(off).max() < 0.03 * np.abs(shape).max()


def hanging(span: float, length: float, count: int) -> np.ndarray:
    """Markers (count, 3) of a catenary."""
    a = brentq(lambda a: 2 * a * np.sinh(span / 2 / a) - length, 0.05 * span, 50 * span)
    along = np.linspace(-length / 2, length / 2, count)
    return np.stack([a * np.arcsinh(along / a), 0 * along, np.hypot(a, along)], axis=1)


def test_a_rope_that_hangs_at_rest_stays_a_catenary_and_one_that_bends_hard_rises(params) -> None:
    run = np.tile(hanging(0.5, 0.9, 13), (41, 1, 1))
    chords = chords_of([run])
    still = swing(run, chords, FREE | {"drag": 2.0}, params.sling)
    assert np.abs(still - run).max() < 0.01 * np.ptp(run[0, :, 2])
    stiff = swing(run, chords, FREE | {"bending_length": 0.3, "drag": 2.0}, params.sling)
    assert np.abs(stiff - run).max() > 0.03 * np.ptp(run[0, :, 2])


def test_a_fit_finds_what_a_rope_was_made_with_and_predicts_another_run(params) -> None:
    run = np.tile(hanging(0.5, 0.7, 8), (25, 1, 1))
    other, begins = run.copy(), (np.linspace(0, 1, 25) ** 4)[:, None]  # gently
    run[..., 1] += 0.15 * begins
    other[..., 0] += 0.15 * begins
    chords = chords_of([run])
    true = {"bending_length": 0.15, "damping": 0.04, "drag": 0.8}
    made = swing(run, chords, true, params.sling)
    begin = {"bending_length": 0.18, "damping": 0.03, "drag": 0.5}
    fit = fitted(made, chords, params.sling, start=begin)
    for name in ("bending_length", "damping"):  # a fifth of a second tells little of the drag
        assert fit[name] == pytest.approx(true[name], rel=0.02)
    first, last, limp = (
        swing(other, chords, candidate, params.sling) for candidate in (true, fit, true | begin)
    )
    assert np.abs(last - first).max() < 0.1 * np.abs(limp - first).max()


def test_a_real_rope_is_followed_as_the_report_says_and_without_stiffness_is_not(params) -> None:
    runs = data.ropes(MEASURED).get("DLO2")
    if not runs:
        pytest.skip("needs ../shared/data/real/deform_dlo_mocap, which is not part of the project")
    report = json.loads((ROOT / "reports/validation/real-ropes.json").read_text())["ropes"]["DLO2"]
    run, chords, values = runs[1][:50], chords_of(runs[:1]), report["values"]
    assert report["length_m"] == pytest.approx(chords.sum(), abs=1e-3)
    off, worse = (
        1e3
        * np.sqrt(((inner(swing(run, chords, candidate, params.sling) - run)) ** 2).sum(2).mean())
        for candidate in (values, values | {"bending_length": 0.03})
    )
    assert off < 1.2 * report["predicted_run"]["by_second_mm"][0] and worse > 2 * off
