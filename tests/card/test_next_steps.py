"""What would help most next: cures, then what narrows a landing's interval."""

import re
from types import SimpleNamespace

import numpy as np
import pytest

from sling2sim2real.card.next_steps import next_steps, relaxing
from sling2sim2real.card.verdict import Reason
from sling2sim2real.identification.posterior.gain import LandingModel
from tests.identification.posterior.toy_landings import GRADIENT, NAMES, landing_model


def still(fall: float) -> SimpleNamespace:
    """A pull of 10 N whose force falls by so much in the last half second."""
    time = np.arange(0, 4, 0.03)
    force = np.zeros((len(time), 3))
    force[:, 1] = 10 - fall * np.clip((time - 2.5) / 0.5, 0, 1)
    return SimpleNamespace(time=time, force=force, position=0 * force, release_time=3.0)


def test_a_force_that_still_falls_is_seen() -> None:
    assert relaxing(still(0.5)) and not relaxing(still(0.02))
    dips = still(0.5)
    dips.position[(dips.time > 2.3) & (dips.time < 2.6), 1] = 0.05
    assert not relaxing(dips)


def test_steps_are_cures_and_then_gains_the_largest_first() -> None:
    model = landing_model()
    reasons = [Reason(False, "why", "Do this."), Reason(False, "too", "Do this.")]
    steps = next_steps(reasons, model, np.array([1.7, 1.9]), [still(0.0)])
    assert steps[0] == "Do this." and steps.count("Do this.") == 1
    after = [float(re.search(r" to (?:about )?([\d.]+)", step)[1]) for step in steps[1:]]
    assert len(after) >= 2 and after == sorted(after)
    assert "Measure a launch and add it with `sling observe`" in " ".join(steps)
    more = next_steps(reasons, model, np.array([1.7, 1.9]), [still(0.0)], launches=2)
    assert "Measure another launch" in " ".join(more)
    assert "1.9 m" in steps[1]


def test_a_dip_is_recommended_where_no_pull_unloads() -> None:
    """With its gain where softening is a coordinate, and without where it is fixed."""
    model, targets, pulls = landing_model(), np.array([1.7, 1.9]), [still(0.0)]
    fixed = next_steps([], model, targets, pulls, unloaded=False)
    assert fixed[0] == (
        "Record a pull with dips (`sling plan` writes it): it shows how the band unloads, which a"
        " launch depends on."
    )
    assert "dip" not in " ".join(next_steps([], model, targets, pulls))
    assert "dip" not in " ".join(next_steps([], model, targets, pulls, 1, unloaded=False))
    names = [*NAMES, "softening"]
    covariance, gradient = np.eye(5) * 0.1**2, np.column_stack([GRADIENT, [-2.0, -2.2]])
    covariance[:4, :4] = model.covariance
    spread = np.sqrt(np.einsum("td,de,te->t", gradient, covariance, gradient) + model.draw**2)
    free = LandingModel(names, covariance, gradient, model.draw, 1.645 * spread)
    (explained,) = [
        step for step in next_steps([], free, targets, pulls, unloaded=False) if "dip" in step
    ]
    less = free.after(free.known("softening"))[1]
    after = float(re.search(r" to about ([\d.]+) cm", explained)[1]) / 200
    assert less <= after + 5e-4 and after < 0.8 * free.half_width[1]
    assert after == pytest.approx(less, abs=0.01)


def test_what_speaks_against_any_use_is_mended_first() -> None:
    model = landing_model()
    reasons = [Reason(True, "why", "Do this."), Reason(False, "too", "And that.")]
    requested = reasons, model, np.array([1.7, 1.9]), [still(0.0)]
    assert next_steps(*requested) == ["Do this.", "And that."]
