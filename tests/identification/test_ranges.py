"""One function says what is at the edge, for the report's tables and the cards alike."""

import pytest

from pipeline.params import load
from sling2sim2real.identification.results.ranges import SearchedRange, at_edges, searched
from tests.project import DEFAULTS

LOG, SHARE = SearchedRange(1e-4, 1e-2, "log"), SearchedRange(0.0, 1.0)


@pytest.mark.parametrize(
    ("box", "value", "edge"),
    [
        (LOG, 1.01e-4, "lower"),
        (LOG, 1.2e-4, ""),
        (LOG, 1e-2, "upper"),
        (SHARE, 0.995, "upper"),
        (SHARE, 0.98, ""),
        (SHARE, 0.0, ""),  # less there is not
        (SearchedRange(-0.3, 0.9), -0.3, "lower"),
    ],
)
def test_within_a_hundredth_of_an_end_is_its_edge(box, value, edge) -> None:
    assert box.edge(value) == edge
    assert box.at(box.place(value)) == pytest.approx(value)


def test_values_of_theta_at_an_edge_are_named_and_a_natural_0_is_none() -> None:
    theta = {"mooney_share": 0.9, "softening": 0.0, "upturn": 0.1, "poissons_ratio": 0.3}
    assert at_edges(load(DEFAULTS), "posterior", theta) == {"mooney_share": "upper"}


def test_a_methods_own_bounds_stand_and_what_it_fixes_does_not() -> None:
    params = load(DEFAULTS)
    ranges, method = searched(params, "posterior"), params.methods["posterior"]
    assert not set(ranges) & set(method.fixed) and set(method.bounds) <= set(ranges)
    low, high = method.bounds["mooney_share"]
    assert ranges["mooney_share"] == SearchedRange(low, high)
    assert ranges["elasticity_damping"].scale == "log"
