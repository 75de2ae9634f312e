"""The verdict: one thing that is wrong turns it, and is named."""

from dataclasses import replace

import numpy as np
import pytest

from sling2sim2real.card.findings import carried, findings
from sling2sim2real.card.verdict import (
    CARE,
    NO,
    TRUSTED,
    Findings,
    judge,
    question,
    reasons_of,
)
from tests.card.conftest import trials

GOOD = Findings(
    cautions=(),
    settled=True, effective=150.0,
    force=0.05, held=8e-4, recoil=2e-3, recoil_seen=True, disagreement=1.1, odd="",
    at_sides=(),
    stretch=1.5, recorded_stretch=1.6, hold_force=9.0, max_force=30.0, failures=(), converged=True,
    miss=0.004, half_width=0.1, sides="−14/+6", outside=1, scores=15, off=0.03, bias=-0.01,
    bias_error=0.01, bias_of_half=-0.2, kind="virtual", left=0.01, observed=0, surprising=0,
    carried=1.1, density=1e3, unloaded=True,
)  # fmt: skip
CASES = [
    ({"cautions": (("In pull 1 of a.mcap, the force drifts.", "Warm up."),)}, CARE, "force drifts"),
    ({"settled": None}, CARE, "no uncertainty"),
    ({"settled": False}, CARE, "not settled"),
    ({"effective": 3.2}, CARE, "sample size is 3,"),
    ({"force": 0.2}, CARE, "force of the pull: it is 0.2 N off"),
    ({"force": 0.9}, NO, "does not match the force"),
    ({"held": 3e-3}, CARE, "drawn band: it is 3 mm off"),
    ({"recoil": 8e-3}, CARE, "recoil: it is 8 mm off"),
    ({"recoil": 0.03}, NO, "does not match the recoil"),
    ({"disagreement": 2.6, "odd": "pull 2 of b.mcap"}, CARE, "pull 2 of b.mcap"),
    ({"at_sides": (("relaxation", "upper end of its bounds, 0 to 20 %"),)}, CARE, "relaxation"),
    (
        {"settled": False, "at_sides": (("flow", "upper end of its bounds, 0 to 60 %"),)},
        CARE,
        "fitted flow is at the upper end",
    ),
    ({"stretch": 1.7}, CARE, "1.70 times its length, the recording only to 1.60"),
    ({"stretch": 2.2}, NO, "2.20 times"),
    ({"hold_force": 28.0}, CARE, "28.0 N"),
    ({"failures": ("The launch at 1.7 m fails in simulation: short.",)}, NO, "short"),
    ({"converged": False}, CARE, "did not converge"),
    ({"miss": 0.2}, NO, "misses a target by 20 cm"),
    ({"half_width": 0.2, "sides": "−35/+5"}, CARE, "−35/+5 cm only"),
    ({"half_width": 0.6, "sides": "−70/+50"}, NO, "−70/+50 cm only"),
    ({"half_width": np.nan}, CARE, "not known"),
    ({"outside": 6}, CARE, "6 of 15 virtual launches"),
    ({"outside": 6, "off": 0.3}, NO, "30 cm off on average"),
    ({"left": 0.09}, CARE, "9 % off"),
    ({"left": 0.4}, NO, "40 % off"),
    ({"scores": 1, "outside": 1, "off": 0.3}, CARE, "30 cm off"),
    ({"scores": 1, "outside": 1, "off": 1.2}, NO, "120 cm off"),
    ({"recoil": 0.0, "recoil_seen": False}, CARE, "No picture shows the recoil"),
    ({"outside": 0, "scores": 0}, CARE, "No launch was measured."),
    (
        {"outside": 0, "scores": 0, "unloaded": False},
        CARE,
        "No launch was measured, and no recording unloads the band",
    ),
    ({"bias": -0.02, "bias_error": 0.004, "bias_of_half": -0.5}, CARE, "landed 2.0 % short"),
    ({"bias": 0.03, "bias_error": 0.004, "bias_of_half": 0.6}, CARE, "landed 3.0 % long"),
    ({"observed": 1, "surprising": 1}, CARE, "1 of 1 launch used for the fit lie outside"),
    ({"carried": 0.1}, CARE, "was 0.1 times"),
    ({"carried": 1.7}, CARE, "was 1.7 times"),
]
NO_REASON = [
    {"bias": -0.02, "bias_error": 0.02, "bias_of_half": -0.5},  # chance
    {"bias": -0.02, "bias_error": 0.004, "bias_of_half": -0.2},  # of no weight
    {"scores": 4, "outside": 0, "bias": -0.02, "bias_error": 0.004, "bias_of_half": -0.5},  # few
    {"observed": 5, "surprising": 1},  # of five, nine of ten inside
    {"carried": None},
    {"unloaded": False},  # launches tell
]


def test_nothing_speaks_against_a_good_band() -> None:
    assert judge(GOOD) == (TRUSTED, [])


@pytest.mark.parametrize(("change", "verdict", "words"), CASES)
def test_one_thing_turns_the_verdict(change, verdict, words) -> None:
    result, reasons = judge(replace(GOOD, **change))
    assert result == verdict
    assert len(reasons) == 1 and words in reasons[0].text
    assert reasons[0].against == (verdict == NO)


@pytest.mark.parametrize("change", NO_REASON)
def test_what_chance_explains_is_no_reason(change) -> None:
    assert judge(replace(GOOD, **change)) == (TRUSTED, [])


def test_causes_come_first_and_the_worst_is_said_first() -> None:
    bad = replace(GOOD, settled=False, miss=0.2, left=0.09)
    verdict, reasons = judge(bad)
    assert verdict == NO and [reason.against for reason in reasons] == [False, True, False]
    assert reasons_of(bad, reasons)[0] == reasons[1].text


def test_several_misses_ask_for_mass_and_size_first() -> None:
    _, reasons = judge(replace(GOOD, force=0.9, recoil=0.03, miss=0.2))
    assert "Weigh and measure the band again" in reasons[0].cure
    assert "clock" in reasons[1].cure and "box of draws" in reasons[2].cure


@pytest.mark.parametrize(("density", "requested"), [(1000.0, False), (833.0, True), (1400.0, True)])
def test_a_density_that_no_solid_rubber_has_is_asked_about(density, requested) -> None:
    case = replace(GOOD, density=density)
    assert bool(question(case)) is requested and judge(case) == (TRUSTED, [])
    assert not requested or f"{density:.0f} kg/m³" in question(case)
    assert question(replace(GOOD, density=None)) == ""


def test_one_launch_is_called_one() -> None:
    assert reasons_of(GOOD, [])[-1] == (
        "14 of 15 virtual launches landed inside their 90 % intervals, -1.0 % from the prediction"
        " on average."
    )
    single = replace(GOOD, scores=1, outside=0, kind="measured")
    assert "The only measured launch landed inside" in reasons_of(single, [])[-1]
    assert "only one measured launch" in reasons_of(replace(GOOD, observed=1), [])[-1]


def test_the_weight_that_the_hand_carries(summary) -> None:
    episode = summary.episode
    weight = np.tile([0.0, 0.0, -0.2], (len(episode.time), 1))
    same = replace(episode, force=0.7 * weight)
    assert carried(same, weight) == pytest.approx(0.7)
    assert carried(same, 0.1 * weight) is None  # less than a sensor's zero is known to
    drawn = weight + [0.0, 0.5, 0.0]
    assert carried(same, drawn) is None


def test_findings_are_those_of_the_files(summary) -> None:
    result = findings(summary)
    assert result.settled and result.force == 0.05 and result.recoil == 2e-3
    assert (result.outside, result.scores, result.kind) == (0, 2, "measured")
    assert result.off == pytest.approx(0.02)
    assert result.at_sides == []
    half = np.hypot(0.1375, np.linalg.norm(summary.aims.draw, axis=1))
    assert result.stretch == pytest.approx(2 * half.max() / 0.52, rel=1e-6)
    assert result.recorded_stretch == pytest.approx(2 * np.hypot(0.1375, 0.38) / 0.52, rel=1e-3)


def test_findings_tell_what_was_odd_of_a_recording(summary) -> None:
    caution = {"about": "gap", "what": "/a*b <x> has a gap of 0.1 s", "cure": "record it again"}
    source = {"file": "a.mcap", "pull": 2}
    odd = replace(summary.episode, metadata={"input": source, "cautions": [caution]})
    sound = replace(odd, metadata={"input": source})
    assert findings(replace(summary, episodes=[sound])).cautions == []
    assert findings(replace(summary, episodes=[sound, odd])).cautions == [
        (
            r"In pull 2 of `a.mcap`, /a\*b &lt;x> has a gap of 0.1 s.",
            "For pull 2 of `a.mcap`: record it again.",
        )
    ]


def test_findings_see_a_bad_score_a_side_and_odd_evidence(summary) -> None:
    rows = trials().assign(landing_y=[1.5, 2.1])
    launches = [
        {"left": {"landing": None}, "z_without_it": {"landing": None}},
        {"left": {"landing": -0.07}, "z_without_it": {"landing": -1.8}},
        {"left": {"landing": 0.01, "speed": -0.02}, "z_without_it": {"landing": 0, "speed": -1.8}},
        {"left": {"speed": -0.02, "angle": 0.3}, "z_without_it": {"speed": 1, "angle": -2.1}},
    ]
    recordings = [
        {"force_rms": force, "held_rms": 0, "recoil_rms": 0, "pictures": []}
        | {"source": {"file": f"{force}.mcap", "pull": 3}, "misfit_without": force}
        for force in (0.1, 0.3)
    ]
    confidence = summary.confidence | {"launches": launches, "recordings": recordings}
    theta = replace(summary.found.theta, relaxation=0.1996)
    found = replace(summary.found, theta=theta, confidence=confidence)
    result = findings(replace(summary, launched=rows, found=found))
    assert (result.outside, result.left, result.force) == (1, 0.07, 0.3)
    assert (result.observed, result.surprising) == (3, 2)
    assert result.bias == pytest.approx(np.mean([1.5 / 1.92, 2.1 / 2.08]) - 1)
    assert result.bias_of_half == pytest.approx(np.mean([-4.2, 0.2]))
    assert result.density == pytest.approx(summary.params.bands[summary.band].density)
    assert result.odd == "pull 3 of `0.3.mcap`"
    assert result.at_sides == [
        ("stress relaxation per decade of time", "upper end of its bounds, 0 to 20 %")
    ]
