"""Table 2: identified parameters with their intervals, and the paper's loss, by hand."""

import math
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from pipeline.identify.objective.box import SearchBox
from pipeline.params import load
from pipeline.report.drawing.styles import styles
from pipeline.report.run.tables.parameters import as_table, at_edge, identified, records
from tests.project import DEFAULTS, with_
from tests.report.run.conftest import THETA, confidence
from tests.report.run.tables.toy_results import launches, result, results

PARAMS, NAMED = load(DEFAULTS), styles(["sling2sim2real", "package_si", "adam"])
TRIALS = launches([[0.0]] * 3)


def table_of(**more) -> list[list[str]]:
    """Rows of band1's Sling2Sim2Real, ours first."""
    outcome = results(result("band1", "sling2sim2real", TRIALS, **more))
    rows = as_table(identified(outcome, PARAMS), NAMED)[1]
    return [row for row in rows if row[:2] == ["Band 1 (soft)", "Sling2Sim2Real"]]


def test_edge_of_the_box_on_both_scales() -> None:
    box = SearchBox(
        ("d", "s"), np.array([1e-4, 0.0]), np.array([1e-2, 1.0]), np.array([True, False])
    )
    assert at_edge(1.01e-4, "d", box) and not at_edge(1.2e-4, "d", box) and at_edge(1e-2, "d", box)
    assert at_edge(0.995, "s", box) and not at_edge(0.98, "s", box)


def test_the_edge_is_that_of_the_methods_own_bounds() -> None:
    """A method that searches ν within 0.44 to 0.45005 ended at its side at 0.45; others did not."""
    bounds = {"poissons_ratio": (0.44, 0.45005)}
    close = with_(PARAMS, "methods.sling2sim2real", bounds=bounds)
    ran = results(result("band1", "sling2sim2real", TRIALS))
    for params, expected in ((PARAMS, False), (close, True)):
        (ours,) = [row for row in identified(ran, params) if row.source == "virtual"]
        assert ours.values["poissons_ratio"].at_edge == expected


def test_the_papers_numbers_stand_below_ours_in_its_format() -> None:
    ours, theirs = table_of()
    assert ours[2:] == [
        "virtual",
        "300 (270 – 330)",
        "0.45 (0.41 – 0.50)",
        "3.00 (2.70 – 3.30)",
        "0.50, not identifiable",
        "0.70 (0.63 – 0.77)",
        "1.7500",
    ]
    assert theirs[2:8] == ["paper, real robot", "929", "0.46", "11.1", "0.80", "0.79"]
    assert theirs[8] == "1.9785"


def test_the_least_loss_of_a_bands_methods_is_bold() -> None:
    better = {"theta": THETA, "loss": {"geom": 0.5, "force": 0.25, "work": 0.125}}
    two = result("band1", "sling2sim2real", TRIALS), result("band1", "adam", TRIALS, theta=better)
    rows = as_table(identified(results(*two), PARAMS), NAMED)[1]
    assert [row[8] for row in rows if row[2] == "virtual"] == ["1.7500", "**0.8750**"]


def test_what_no_posterior_knows_is_a_number_alone() -> None:
    ours, _ = table_of(confidence={})
    assert ours[3:8] == ["300", "0.45", "3.00", "0.50", "0.70"]


def test_a_theta_outside_its_interval_and_at_an_edge() -> None:
    posterior = confidence()
    posterior["parameters"]["poissons_ratio"] |= {"low": 0.4891, "high": 0.4899}
    posterior["parameters"]["youngs_modulus"] |= {"low": 3.0011e5, "high": 3.0014e5}
    theta = {"theta": THETA | {"damping_scale": 0.999}}
    ours, _ = table_of(confidence=posterior, theta=theta)
    assert ours[3] == "300 † (300.11 – 300.14)"
    assert ours[4] == "0.45 † (0.489 – 0.490)"
    assert ours[7] == "1.00 ⚠ † (0.63 – 0.77)" and ours[8] == "–"


def test_the_loss_is_the_papers_whatever_a_method_minimised() -> None:
    loss = {"geom": 0.5, "force": 0.25, "work": 0.125, "glow": 9.0, "total": 9.5}
    ours, _ = table_of(theta={"theta": THETA, "loss": loss})
    assert ours[8] == "0.8750"


def test_only_what_ran_has_rows() -> None:
    outcome = results(result("band1", "adam", TRIALS), result("orange", "package_si", TRIALS))
    bands = {**PARAMS.bands, "orange": SimpleNamespace(source="recording")}
    rows = as_table(
        identified(
            outcome,
            SimpleNamespace(bands=bands, methods=PARAMS.methods, parameters=PARAMS.parameters),
        ),
        NAMED,
    )[1]
    (adam, orange) = rows
    assert adam[:3] == ["Band 1 (soft)", "Adam_L", "virtual"]
    assert orange[:3] == ["orange", "Package SI", "measured"]
    assert orange[4] == "0.45, fixed" and orange[6] == "0.50, fixed"


def test_machines_read_the_same(tmp_path) -> None:
    rows = identified(results(result("band1", "sling2sim2real", TRIALS)), PARAMS)
    records(rows).to_csv(tmp_path / "table2.csv", index=False)
    read = pd.read_csv(tmp_path / "table2.csv").set_index(["band", "method", "source"])
    ours = read.loc["band1", "sling2sim2real", "virtual"]
    assert ours.youngs_modulus_pa == pytest.approx(3e5) and ours.loss == 1.75
    assert ours.elasticity_damping_low_s == pytest.approx(2.7e-3)
    assert ours.dynamic_friction_state == "not identifiable"
    theirs = read.loc["band1", "sling2sim2real", "paper, real robot"]
    assert theirs.youngs_modulus_pa == 9.29e5 and theirs.loss == 1.9785
    assert math.isnan(theirs.youngs_modulus_low_pa)
