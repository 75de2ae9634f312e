"""Names and colours: one for each method, whatever else runs."""

from hypothesis import given
from hypothesis import strategies as st

from pipeline.params import load
from pipeline.report import paper
from sling2sim2real.drawing.styles import KNOWN, styles
from tests.project import DEFAULTS

METHODS = st.lists(st.sampled_from([*KNOWN, "mine", "yours", "theirs"]), unique=True, min_size=1)


def test_every_method_of_the_project_has_its_own_name_and_colour() -> None:
    named = styles(load(DEFAULTS).methods).values()
    assert (
        len({style.name for style in named}) == len({style.color for style in named}) == len(named)
    )
    assert set(KNOWN) == set(load(DEFAULTS).methods)
    assert {method for _, method in paper.LANDING} <= set(KNOWN)


@given(METHODS)
def test_a_method_looks_the_same_in_every_company(methods: list[str]) -> None:
    named = styles(methods)
    assert list(named) == methods
    assert len({style.color for style in named.values()}) == len(methods)
    for method in set(methods) & set(KNOWN):
        assert named[method] == styles([method])[method]
    others = [method for method in methods if method not in KNOWN]
    assert all(named[method].name == method for method in others)
