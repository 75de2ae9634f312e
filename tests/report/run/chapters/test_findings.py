"""The sentences of the first chapter say what the launches allow, and no more."""

import math
from types import SimpleNamespace

import numpy as np

from pipeline.params import load
from pipeline.report.drawing.styles import styles
from pipeline.report.run.chapters.findings import CAVEAT, CLAIMS, OWN, doubts, findings
from tests.project import DEFAULTS
from tests.report.run.conftest import confidence
from tests.report.run.tables.toy_results import floor, launches, result, results

NOISE = np.random.default_rng(0).normal(0, 0.01, (3, 5))
MAIN, THEIRS = "least_squares", "sling2sim2real"


def run(*some, floors=None, unused=None) -> SimpleNamespace:
    references = tuple(
        m for m in (MAIN, THEIRS) if any(method_result.method == m for method_result in some)
    )
    outcome = results(*some, floors=floors)
    outcome.unused.update(unused or {})
    named = styles(dict.fromkeys(method_result.method for method_result in some))
    params = SimpleNamespace(trials=load(DEFAULTS).trials)
    return SimpleNamespace(
        results=outcome,
        styles=named,
        params=params,
        main=references[0],
        references=references,
        repeated=None,
    )


def band(name: str, **errors) -> list[SimpleNamespace]:
    return [result(name, method, launches(some)) for method, some in errors.items()]


def test_errors_beside_the_floor() -> None:
    some = band("band1", least_squares=[[0.03, -0.01]] * 3, sling2sim2real=[[0.1] * 2] * 3)
    some += band("band2", least_squares=[[0.04, -0.04]] * 3, sling2sim2real=[[0.2] * 2] * 3)
    floors = {name: floor((0.01,) * 3, (0.01,) * 3) for name in ("band1", "band2")}
    first, *_ = findings(run(*some, floors=floors))
    assert first == (
        "Mean distance of virtual launches from their target: **ours** 2.0 to 4.0 cm (2.0 to 4.0"
        " times the actuation floor), **Sling2Sim2Real** 10.0 to 20.0 cm."
    )
    assert "floor" not in findings(run(*some))[0]


def test_predictions_and_how_sure_they_were() -> None:
    """Landings 2 % short of where they were predicted."""
    trials = launches([[0.0] * 5] * 3)
    trials = trials.assign(predicted_y=1.02 * trials.landing_y)
    for half, words in ((0.03, ""), (0.2, ": wider than such errors call for")):
        ranged = trials.assign(
            predicted_low=(1.02 - half) * trials.landing_y,
            predicted_high=(1.02 + half) * trials.landing_y,
        )
        _, predicted, held, *_ = findings(run(result("band1", MAIN, ranged)))
        assert predicted == (
            "Ours predicts where its virtual launches land within 2.0 % of the distance on average"
            " (bias +2.0 %)."
        )
        lies = "15 of these 15 landings lie in their 90 % interval, which is"
        assert held == f"{lies} {200 * half:.1f} % wide{words}."
    narrow = trials.assign(predicted_low=1.01 * trials.landing_y, predicted_high=9.0)
    narrow = narrow.assign(predicted_high=1.03 * trials.landing_y)
    assert "0 of these 15" in findings(run(result("band1", MAIN, narrow)))[2]
    assert "too narrow" in findings(run(result("band1", MAIN, narrow)))[2]
    bare = run(result("band1", MAIN, narrow, confidence={}))
    assert not any("90 %" in line for line in findings(bare))  # of the draw's error alone


def test_ours_stands_beside_the_papers() -> None:
    near, far = 0.05 + NOISE, 0.2 + NOISE
    some = band("band1", least_squares=near, sling2sim2real=far)
    some += band("band2", least_squares=far, sling2sim2real=near)
    some += band("band3", least_squares=near, sling2sim2real=0.05 - NOISE)
    (line,) = [line for line in findings(run(*some)) if line.startswith("Beside")]
    assert line == (
        "Beside Sling2Sim2Real, ours lands nearer on band1 by 15.0 cm, further off on band2 by"
        " 15.0 cm and no different within the noise of launches on band3."
    )


def claims(*some) -> list[str]:
    return [line for line in findings(run(*some)) if line.startswith("The paper's finding")]


def test_whether_the_papers_findings_hold() -> None:
    near, far, lost = 0.05 + NOISE, 0.2 + NOISE, launches(NOISE, failed=15)
    some = band("band1", sling2sim2real=near, package_si=far, least_squares=near)
    some += band("band2", sling2sim2real=far, package_si=near, least_squares=near)
    some.insert(2, result("band1", "real2sim2real", lost))
    first, *rest = CLAIMS
    assert claims(*some) == [
        f"The paper's finding that {first} holds against Package SI (band1) and Real2Sim2Real"
        " (band1), nearer by 15.0 cm; does not hold against Package SI (band2), further off by"
        " 15.0 cm."
    ]
    ablated = band("band1", sling2sim2real=near, de=far, bo=near - 0.02, no_work=0.05 - NOISE)
    ablated.append(result("band1", MAIN, launches(near)))
    searches, terms = claims(*ablated)
    assert searches == (
        f"The paper's finding that {rest[0]} on band1 holds against DE_L, nearer by 15.0 cm; does"
        " not hold against BO_L, further off by 2.0 cm."
    )
    assert terms == f"The paper's finding that {rest[1]} on band1 is open against −L_work."


def test_at_most_eight_sentences_of_a_whole_run() -> None:
    near = 0.05 + NOISE
    some = band("band1", **{m: near for m in (MAIN, THEIRS, "package_si", "de", "no_work")})
    message = findings(run(*some))
    assert len(message) <= 8 and message[-1] == f"{CAVEAT}."


def test_nothing_is_said_of_nothing() -> None:
    nothing = launches([[math.nan]] * 3, "predicted")
    assert findings(run(result("mine", MAIN, nothing))) == []


def test_what_went_wrong_is_said() -> None:
    card = {"training": {"converged": False, "mean_error_m": 0.05}}
    trials = launches([[0.0] * 2] * 3).assign(predicted_y=math.nan)
    posterior = confidence() | {"steps": 14, "settled": False}
    posterior["recordings"][0]["pictures"] = []
    lines = doubts(
        run(result("mine", MAIN, trials, card=card, confidence=posterior), unused={"x": 3})
    )
    assert len(lines) == 5 and all(line.startswith("⚠ ") for line in lines)
    unpredicted, policy, fit, recoil, unused = lines
    assert unpredicted == "⚠ mine, ours: 6 of 6 launches could not be predicted."
    assert "did **not** converge" in policy and "**not settled** after 14 steps" in fit
    assert "no camera frame shows the recoil" in recoil
    assert unused.startswith("⚠ x: 3 measured launches name a method")
    good = trials.assign(predicted_y=1.9)
    assert doubts(run(result("mine", MAIN, good))) == []


def test_that_the_rig_was_seen_is_said_where_it_launched() -> None:
    some = band("band1", least_squares=NOISE, sling2sim2real=NOISE)
    floors = {"band1": floor((0.01,) * 3, (0.01,) * 3)}
    assert OWN in findings(run(*some, floors=floors))[-1]
    assert OWN not in findings(run(*some))[-1]
