"""What would help most next: cures, then what narrows a landing's interval."""

from types import SimpleNamespace

import numpy as np
import pytest

from pipeline.identify.posterior.gain import LandingModel
from pipeline.report.card.next_steps import next_steps, relaxing
from pipeline.report.card.verdict import Reason
from tests.identify.posterior.toy_landings import GRADIENT, NAMES, landing_model


def still(fall: float) -> SimpleNamespace:
    """A pull of 10 N whose force falls by so much in the last half second."""
    time = np.arange(0, 4, 0.03)
    force = np.zeros((len(time), 3))
    force[:, 1] = 10 - fall * np.clip((time - 2.5) / 0.5, 0, 1)
    return SimpleNamespace(time=time, force=force, release_time=3.0)


def test_a_force_that_still_falls_is_seen() -> None:
    assert relaxing(still(0.5)) and not relaxing(still(0.02))


def test_steps_are_cures_and_then_gains_the_largest_first() -> None:
    model = landing_model()
    reasons = [Reason(False, "why", "Do this."), Reason(False, "too", "Do this.")]
    steps = next_steps("toy", reasons, model, np.array([1.7, 1.9]), [still(0.0)])
    assert steps[0] == "Do this." and steps.count("Do this.") == 1
    after = [float(step.split("±")[2].split()[0]) for step in steps[1:]]
    assert len(after) >= 2 and after == sorted(after)
    assert "Measure a launch and tell it with `sling observe --band toy`" in " ".join(steps)
    more = next_steps("toy", reasons, model, np.array([1.7, 1.9]), [still(0.0)], launches=2)
    assert "Measure another launch" in " ".join(more)
    assert "1.9 m" in steps[1]


def test_what_speaks_against_any_use_is_mended_first() -> None:
    model = landing_model()
    reasons = [Reason(True, "why", "Do this."), Reason(False, "too", "And that.")]
    asked = "toy", reasons, model, np.array([1.7, 1.9]), [still(0.0)]
    assert next_steps(*asked) == ["Do this.", "And that."]


def test_where_nothing_helps_it_says_so() -> None:
    known = LandingModel(NAMES, 1e-12 * np.eye(4), GRADIENT, np.zeros(2), np.ones(2))
    exact = LandingModel(NAMES, 1e-12 * np.eye(4), GRADIENT, np.full(2, 1e-9), np.ones(2))
    assert next_steps("toy", [], None, np.array([1.7]), [still(0.0)]) == [
        "Nothing more would narrow the landings by much: launch."
    ]
    assert known.after(draw=0.0)[0] == pytest.approx(1.0)
    assert len(next_steps("toy", [], exact, np.array([1.7, 1.9]), [still(0.0)])) >= 1
