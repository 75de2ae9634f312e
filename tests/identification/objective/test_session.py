"""What the searching stages share: an evaluator that reports."""

from pathlib import Path

import numpy as np

from pipeline.params import load
from sling2sim2real.base.progress import parse
from sling2sim2real.identification.objective import session
from tests.identification.searches.functions import Evaluate, rosenbrock
from tests.project import DEFAULTS

PARAMS = load(DEFAULTS)
UNIT = np.random.default_rng(1).random((4, 5))


def test_progress_says_how_far_it_is_and_the_best_so_far(tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    weights = dict(PARAMS.methods["de"].weights)
    monkeypatch.setattr(session, "evaluator", lambda *_: Evaluate(rosenbrock, weights=weights))
    recorded = "band1", "de", None, None
    evaluate = session.logging_evaluator("history-band1-de", PARAMS, *recorded, 12)
    evaluate(UNIT), evaluate(UNIT), evaluate(1 - UNIT)
    summary = [parse(line) for line in capsys.readouterr().err.splitlines()]
    least = [
        f"best {3 * min(rosenbrock(x).min() for x in some):.5g}"
        for some in ([UNIT], [UNIT, 1 - UNIT])
    ]
    assert [(step.done, step.total) for step in summary] == [(4, 12), (8, 12), (12, 12)]
    assert [step.facts[:3] for step in summary] == [  # then rate and time left
        ("generation 0", least[0], "failed 0/4"),
        ("generation 1", least[0], "failed 0/4"),
        ("generation 2", least[1], "failed 0/4"),
    ]
    log = Path("logs/history-band1-de.log").read_text().splitlines()
    assert log[0].endswith("history-band1-de: 12 rollouts")
    assert [parse(f"history-band1-de {line}") for line in log[1:]] == summary
