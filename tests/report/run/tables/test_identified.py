"""Tables of what was identified, against values by hand."""

import re
from types import SimpleNamespace

import pytest

from pipeline.report.drawing.styles import styles
from pipeline.report.run.tables.cells import markdown
from pipeline.report.run.tables.identified import (
    derived,
    losses,
    methods,
    observed,
    recordings,
)
from pipeline.report.run.tables.policies import policies
from tests.hostile import MARKUP
from tests.project import with_
from tests.report.run.conftest import BAND, METHOD
from tests.report.run.tables.toy_results import launches, result
from tests.report.run.tables.toy_results import results as all_of

MAP = {"target_range": {"draws": 9, "mean_error_m": 3e-4, "max_error_m": None}}


@pytest.fixture
def named(params):
    return styles(params.run.methods)


def ran(regions: dict[str, list[int]]) -> list[SimpleNamespace]:
    """Results, as far as the table of methods looks: how many regions a method found on bands."""
    return [
        SimpleNamespace(method=method, regions=[None] * count)
        for method, counts in regions.items()
        for count in counts
    ]


def column(table, heading: str) -> list[str]:
    heads, rows = table
    return [row[heads.index(heading)] for row in rows]


def test_what_a_method_holds_fixed(results, params, named) -> None:
    """In the notation of table 2, with the digits that a setting has."""
    fixed = {"poissons_ratio": 0.45, "elasticity_damping": 5e-3, "dynamic_friction": 0.125}
    params = with_(params, f"methods.{METHOD}", fixed=fixed)
    assert column(methods(results, params, named), "held fixed") == [
        "ν 0.45, d 5.00 ms, friction 0.125"
    ]


def test_what_a_method_minimises_and_by_what_search(params) -> None:
    counts = {m: [1] for m in params.methods} | {"sling2sim2real": [4, 3, 4], "no_work": [2]}
    table = methods(ran(counts), params, styles(params.methods))
    minimises = dict(zip(column(table, "method"), column(table, "minimises"), strict=True))
    search = dict(zip(column(table, "method"), column(table, "search"), strict=True))
    assert minimises["Sling2Sim2Real"] == "geom + force + work"
    assert minimises["−L_work"] == "geom + force" and minimises["Package SI"] == "geom"
    assert search["Sling2Sim2Real"] == "DE, then CMA-ES in 3 to 4 regions"  # as found, not asked
    assert search["−L_work"] == "DE, then CMA-ES in 2 regions"
    assert search["−c, −m"] == "DE, then CMA-ES in 1 region, isotropic starts"
    assert search["DE_L"] == "differential evolution"


def test_derived_quantities_keep_the_digits_that_their_width_deserves(results, named) -> None:
    table = derived(results, named)
    assert column(table, "damping s·d [ms]") == ["2.10 (1.90 – 2.30)"]
    assert column(table, "returned share [%]") == ["100.0 (97.0 – 103.0)"]
    results.methods[BAND][METHOD].theta["confidence"] = None
    assert derived(results, named) is None and recordings(results, named)[1] == []


def test_what_a_recording_leaves_and_how_the_others_would_have_it(results, named) -> None:
    table = recordings(results, named)
    assert column(table, "force [mN]") == ["41"] and column(table, "recoil [mm]") == ["2.1"]
    assert column(table, "recoil seen after [ms]") == ["12"]
    assert column(table, "misfit without it") == ["–"]
    confidence = results.methods[BAND][METHOD].theta["confidence"]
    without = {"misfit": 3.21, "moved": {"mooney_share": 0.4, "log_loss_factor": -1.26}}
    confidence["recordings"][0]["without_it"] = without
    table = recordings(results, named)
    assert column(table, "misfit without it") == ["3.2"]
    assert column(table, "which moves") == ["log loss factor -1.3 sd"]


def test_launches_that_were_evidence_are_named(results, named) -> None:
    assert observed(results, named) is None
    confidence = results.methods[BAND][METHOD].theta["confidence"]
    confidence["launches"] = [{"draw": [-0.3, -0.15], "landing": 1.9, "left": 0.021}]
    table = observed(results, named)
    assert column(table, "draw (y, z) [m]") == ["-0.300, -0.150"]
    assert column(table, "farther than simulated") == ["+2.1 %"]


def test_losses_say_what_each_term_weighs(results, params, named) -> None:
    table = losses(results, params, named)
    assert column(table, "geom [cm]") == column(table, "work [J]") == ["0.5 (40 %)"]
    assert column(table, "printed loss") == ["1.25"] and column(table, "rollouts") == ["5"]
    results.methods[BAND][METHOD].theta["rollouts"] = 246  # a fit keeps one row of many
    assert column(losses(results, params, named), "rollouts") == ["246"]


def test_a_fit_that_minimises_no_sum_of_terms_has_no_shares(results, params, named) -> None:
    params = with_(params, f"methods.{METHOD}", search="least_squares")
    table = losses(results, params, named)
    assert column(table, "geom [cm]") == ["0.5"] and column(table, "total of its own loss") == ["–"]


def test_a_term_of_another_name_has_a_column_too(results, params, named) -> None:
    results.methods[BAND][METHOD].theta["loss"]["glow"] = 0.7
    assert column(losses(results, params, named), "glow") == ["0.7 (unused)"]


def card(**training) -> dict:
    usual = {"converged": True, "mean_error_m": 0.004, "max_error_m": 0.01, "failed_targets": 2}
    return {"training": usual | training, "landing_map": MAP}


def test_policies_stand_with_their_errors() -> None:
    trials, named = launches([[0.0]] * 3), styles(["package_si", "sling2sim2real"])
    ours = result("band1", "sling2sim2real", trials, card=card(converged=False))
    theirs = result("band1", "package_si", trials, card=card(mean_error_m=None))
    _, (first, other) = policies(all_of(ours, theirs), named)
    assert first[1:3] == ["Sling2Sim2Real", "**no**"]
    assert first[3:] == ["0.40", "1.00", "2", "0.03", "–"]
    assert other[2:4] == ["yes", "–"]


@pytest.mark.parametrize("name", MARKUP)
def test_a_file_of_any_name_has_one_cell(results, named, name) -> None:
    confidence = results.methods[BAND][METHOD].theta["confidence"]
    confidence["recordings"][0]["source"] = {"file": name}
    heads, rows = recordings(results, named)
    text = markdown((heads, rows))
    assert text.replace("\n", "").isprintable() and text.count("\n") == 2 + len(rows)
    assert len(re.findall(r"(?<!\\)\|", text.splitlines()[2])) == len(heads) + 1
