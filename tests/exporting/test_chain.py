"""The chain: its springs, its time step, its shapes."""

import re
from dataclasses import replace

import numpy as np
import pytest

from pipeline.layout import ROOT
from sling2sim2real import Band, Model, Theta
from sling2sim2real.base.errors import UserError
from sling2sim2real.exporting.chain import TIME_STEPS_S, SpringChain

PLAIN = str.maketrans({"λ": "l", "−": "-", "⁻": "^-", "²": "^2"})


@pytest.fixture(scope="module")
def chain() -> SpringChain:
    return SpringChain(
        edges=20, rest_length=0.52, mass=0.023, half_width=0.1375, floor=-0.52,
        projectile_mass=0.039, arm_stiffness=None, strength=17.0, mooney_share=0.4,
        upturn=0.0, damping_time=1.5e-3, largest_strain=1.1, step=1e-4,
    )  # fmt: skip


def pulled_by_two(chain: SpringChain, strain: np.ndarray) -> np.ndarray:
    """What the two cubic springs of an edge pull by, as MuJoCo computes it [N]."""
    first, second, knee, _ = chain.cubic_springs()
    rest, powers = chain.spring_length, np.arange(1, 4)
    whole = rest * np.maximum(strain, 0)
    beyond = rest * np.maximum(strain - knee, 0)
    return whole[:, None] ** powers @ first + beyond[:, None] ** powers @ second


@pytest.mark.parametrize(
    ("share", "upturn"), [(-0.3, 0.0), (-0.3, 0.25), (0.0, 0.1), (0.4, 0.0), (0.9, 0.05)]
)
def test_two_cubic_springs_pull_as_the_law(chain, share, upturn) -> None:
    chain = replace(chain, mooney_share=share, upturn=upturn)
    strain = np.linspace(0.1, chain.largest_strain, 50)
    error = pulled_by_two(chain, strain) / chain.pull(strain) - 1
    summary = chain.cubic_springs()[3]
    assert np.abs(error).max() <= summary * (1 + 1e-9) and summary < 0.006  # both sums round
    assert (pulled_by_two(chain, np.array([-0.5, 0.0])) == 0).all()  # it never pushes


@pytest.mark.parametrize("file", ["chain.py", "newton_band.py", "chain.md.j2"])
def test_each_text_has_the_law_that_is_computed(chain, file: str) -> None:
    chain = replace(chain, mooney_share=0.3, upturn=0.2)
    text = (ROOT / "sling2sim2real/exporting" / file).read_text("utf-8").translate(PLAIN)
    law = re.search(r"K/3 \(l.*?\)(?=;| \+ K tau)", text)[0].replace("^-^", "^-").replace("^", "**")
    law = re.sub(r"(?<=[\w)]) ?\(", " * (", law)  # what stands side by side is multiplied
    stretch = np.linspace(1.1, 2.0, 5)
    names = {"l": stretch, "K": chain.strength, "m": chain.mooney_share, "c": chain.upturn}
    assert eval(law, names) == pytest.approx(chain.pull(stretch - 1), rel=1e-12)


def test_the_first_guess_is_the_law_of_a_stretched_string() -> None:
    """Without relaxation: E A, Mooney's share and the upturn."""
    theta = Theta(2.2e5, 0.47, 2e-3, 0.7, 0.6, mooney_share=0.3, upturn=0.1, relaxation=0.0)
    model = Model(Band(mass=0.023, diameter=0.010, rest_length=0.52), theta)
    draws = np.array([[-0.30, 0.0], [-0.35, 0.0], [-0.40, 0.0]])
    chain = SpringChain.of(model, draws, model.launches(draws).hold_force)
    assert chain.strength == pytest.approx(2.2e5 * np.pi * 0.005**2, rel=0.02)
    assert (chain.mooney_share, chain.upturn, chain.floor) == (0.3, 0.1, -0.52)
    assert 1 + chain.largest_strain == pytest.approx(2 * np.hypot(0.1375, 0.40) / 0.52)


def test_a_stiffer_band_needs_shorter_steps(chain) -> None:
    steps = [replace(chain, strength=k).stable_step for k in (17.0, 51.0, 170.0)]
    assert steps == sorted(steps, reverse=True) and {*steps} <= {*TIME_STEPS_S}
    assert replace(chain, damping_time=5e-3).stable_step < steps[0]
    with pytest.raises(UserError, match="time steps below"):
        _ = replace(chain, strength=1e9).stable_step
