"""A planned pull goes through its dips, and lasts as long as its legs."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from pipeline.params import load
from sling2sim2real.episode.planned import leg_time, legs_of, planned_pull
from sling2sim2real.settings.lab import Dip
from tests.project import DEFAULTS

EPISODE = load(DEFAULTS).episode.model_copy(update={"samples": 900})  # 10 ms each
TIMES = st.floats(0.05, 5)
DIPS = st.lists(
    st.builds(
        Dip,
        at=st.floats(0.2, 1) | st.just(1.0),
        depth=st.floats(0.01, 0.07),
        out_time=TIMES,
        back_time=TIMES,
    ),
    max_size=3,
)


@given(DIPS)
def test_legs_lead_from_the_fork_to_the_draw(dips) -> None:
    """The pull's own parts make the draw together; each dip comes back to where it began."""
    legs = legs_of(dips, 0.4)
    pulled = [leg.share for leg in legs if leg.time is None]
    assert pulled[-1] == 1 and np.all(np.diff([0, *pulled]) > 0)
    backs = [i for i, leg in enumerate(legs) if leg.name == "let back"]
    assert len(backs) == len(dips)
    for i, dip in zip(backs, sorted(dips, key=lambda dip: dip.at), strict=True):
        before, back, again = legs[i - 1 : i + 2]
        assert before.share == again.share == dip.at
        assert np.isclose(before.share - back.share, dip.depth / 0.4)
        assert (back.time, again.time) == (dip.out_time, dip.back_time)


def test_a_planned_pull_with_dips() -> None:
    halfway = Dip(at=0.5, depth=0.05, out_time=0.4, back_time=0.6)
    deep = Dip(at=1.0, depth=0.3, out_time=2.0, back_time=3.0)
    draw, times = (-0.32, -0.24), {"pull_time": 4.0, "pause": 1.0}
    plain = planned_pull(EPISODE, "band", -0.2, draw, **times)
    made = planned_pull(EPISODE, "band", -0.2, draw, **times, dips=(deep, halfway))
    assert np.isclose(made.release_time - plain.release_time, 6.0)
    begin = made.release_time - 1.0 - 10.0
    at = begin + np.cumsum([2.0, 0.4, 0.6, 2.0, 2.0, 3.0])
    way = np.hypot(made.position[:, 1], made.position[:, 2])
    reached = np.interp(at, made.time, way)
    np.testing.assert_allclose(reached, [0.2, 0.15, 0.2, 0.4, 0.1, 0.4], atol=1e-4)
    late = made.time > begin
    np.testing.assert_allclose(made.position[late] @ [0, 0.24, -0.32], 0, atol=1e-12)  # straight


def test_a_legs_time_keeps_to_both_limits() -> None:
    """2 L / T is the speed halfway, 8 L / T^2 the acceleration at a quarter."""
    assert leg_time(0.4, 0.2, 10.0) == 4.0
    assert leg_time(0.01, 10.0, 2.0) == 0.2
