"""How policies converged, the robust ones beside the plain."""

from __future__ import annotations

from pipeline.report.styles import styles
from pipeline.report.tables.policies import policies
from tests.report.tables.toy_results import launches, result, results

MAP = {"target_range": {"draws": 9, "mean_error_m": 3e-4, "max_error_m": None}}


def card(**training) -> dict:
    usual = {"converged": True, "mean_error_m": 0.004, "max_error_m": 0.01, "failed_targets": 2}
    return {"training": usual | training, "landing_map": MAP}


def test_a_robust_policy_is_a_row_with_what_both_are_expected_to_miss() -> None:
    trials, named = launches([[0.0]] * 3), styles(["package_si", "sling2sim2real"])
    robust = card(converged=False, expected_error_m=0.03, plain_expected_error_m=0.04)
    ran = results(
        result("band1", "sling2sim2real", trials, card=card(), robust_card=robust),
        result("band1", "package_si", trials, card=card(mean_error_m=None)),
    )
    _, (plain, second, other) = policies(ran, named)
    assert plain[1:] == [
        "Sling2Sim2Real", "plain", "yes", "0.40", "1.00", "2", "0.03", "–", "4.00",
    ]  # fmt: skip
    assert second[2:4] == ["robust", "**no**"] and second[-1] == "3.00"
    assert other[3:5] == ["yes", "–"] and other[-1] == "–"
