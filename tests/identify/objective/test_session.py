"""The evaluator of the searching stages: one memory a band, whatever the method; what it says."""

from pathlib import Path

import numpy as np
import pytest

from pipeline.base import machine
from pipeline.base.files import write_json
from pipeline.base.layout import Layout
from pipeline.base.progress import parse
from pipeline.identify.objective import session
from pipeline.params import load
from tests.identify.search import toy
from tests.identify.search.functions import Evaluate, rosenbrock
from tests.project import DEFAULTS, with_

PARAMS = load(DEFAULTS)
UNIT = np.random.default_rng(1).random((4, 5))


@pytest.fixture
def evaluators(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[Evaluate]:
    """A folder with an episode; evaluators of the stages, of a known function."""
    monkeypatch.chdir(tmp_path)
    toy.episode().save(Layout().episode("band1"))
    write_json(Layout().clamps("band1"), {})
    made = []

    def evaluator(params, band: str, method: str) -> Evaluate:
        made.append(Evaluate(rosenbrock, weights=dict(params.methods[method].weights)))
        return made[-1]

    monkeypatch.setattr(session, "evaluator", evaluator)
    return made


def serve(method: str, params=PARAMS, stage: str = "history"):
    return session.logging_evaluator(stage, "band1", method, params, 8)(UNIT)


def test_methods_and_stages_share_what_was_simulated(evaluators: list[Evaluate]) -> None:
    first = serve("sling2sim2real")
    other = serve("no_work", stage="refined")
    assert [evaluator.count for evaluator in evaluators] == [1, 0]
    np.testing.assert_allclose(first.total, 3 * rosenbrock(UNIT), rtol=1e-12)
    np.testing.assert_allclose(other.total, 2 * rosenbrock(UNIT), rtol=1e-12)


def test_other_params_of_the_terms_start_over(evaluators: list[Evaluate]) -> None:
    """Another budget or another weight does not."""
    serve("sling2sim2real")
    serve("no_work", with_(PARAMS, "optimizer", seed=5, k_top=2))
    assert [evaluator.count for evaluator in evaluators] == [1, 0]
    for section, change in (
        ("setup", {"projectile_mass": 0.04}),
        ("sling", {"edges": 30}),
        ("force", {"cutoff": 0.3}),
        ("loss", {"median_window": 5}),
    ):
        serve("sling2sim2real", with_(PARAMS, section, **change))
    assert [evaluator.count for evaluator in evaluators] == [1, 0, 1, 1, 1, 1]


def test_without_the_clamps_nothing_is_shared_and_nothing_lost(evaluators) -> None:
    bare = PARAMS.methods["sling2sim2real"].model_copy(update={"mounting": False})
    methods = {**PARAMS.methods, "bare": bare}
    params = PARAMS.model_copy(update={"methods": methods})
    for method in ("sling2sim2real", "bare", "sling2sim2real", "bare"):
        serve(method, params)
    assert [evaluator.count for evaluator in evaluators] == [1, 1, 0, 0]


def test_another_number_of_gpus_does_not(evaluators: list[Evaluate], monkeypatch) -> None:
    """A GPU instead of the CPU does: it rounds differently."""
    monkeypatch.setattr(machine, "gpus", lambda: ("cuda:0", "cuda:1"))
    for device in ("cpu", "cuda:0", "cuda", "cuda:1,cuda:0"):
        monkeypatch.setenv("SLING_DEVICE", device)
        serve("sling2sim2real")
    assert [evaluator.count for evaluator in evaluators] == [1, 1, 0, 0]


def test_another_episode_starts_over(evaluators: list[Evaluate]) -> None:
    serve("sling2sim2real")
    toy.episode(release_time=1.3).save(Layout().episode("band1"))
    serve("sling2sim2real")
    write_json(Layout().clamps("band1"), {"clamp_angle_deg": 1.0})
    serve("sling2sim2real")
    assert [evaluator.count for evaluator in evaluators] == [1, 1, 1]


def test_all_episodes_of_a_band_come_in_their_order(evaluators: list[Evaluate]) -> None:
    for number in range(2, 12):  # by number, not by name
        toy.episode(release_time=1 + number / 100).save(Layout().episode("band1", number))
    release_times = [episode.release_time for episode in session.load_episodes("band1")]
    assert release_times[0] == session.load_episode("band1").release_time
    assert release_times[1:] == [1 + number / 100 for number in range(2, 12)]


def test_progress_says_how_far_it_is_and_what_was_recalled(
    evaluators: list[Evaluate], capsys: pytest.CaptureFixture
) -> None:
    evaluate = session.logging_evaluator("history", "band1", "de", PARAMS, 12)
    evaluate(UNIT), evaluate(UNIT), evaluate(1 - UNIT)
    summary = [parse(line) for line in capsys.readouterr().err.splitlines()]
    least = [
        f"best {3 * min(rosenbrock(x).min() for x in some):.5g}"
        for some in ([UNIT], [UNIT, 1 - UNIT])
    ]
    assert [step.done for step in summary] == [4, 8, 12] and {step.total for step in summary} == {
        12
    }
    assert summary[0].facts == (
        "generation 0",
        least[0],
        "failed 0/4",
        "4.0 rollouts/s",
        "0:02 left",
    )
    assert summary[1].facts == ("generation 1", least[0], "failed 0/4", "recalled", "0:01 left")
    assert summary[2].facts == ("generation 2", least[1], "failed 0/4", "4.0 rollouts/s")
    log = Path("logs/history-band1-de.log").read_text().splitlines()
    assert log[0].endswith("history-band1-de: 12 rollouts")
    assert [parse(f"history-band1-de {line}") for line in log[1:]] == summary
