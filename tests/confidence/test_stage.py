"""The stage theta where simulations around θ* fail: θ* all the same, without a confidence."""

import json
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from pipeline.base.layout import Layout
from pipeline.confidence import rounds
from pipeline.objective.evaluate import Evaluation
from pipeline.objective.loss import TERMS
from pipeline.objective.space import Space
from pipeline.params import load
from pipeline.search.history import History
from pipeline.sling.theta import law_discrepancy, load_samples, load_theta
from stages import theta
from tests.project import ROOT
from tests.search.toy import episode

METHOD = "sling2sim2real"


@pytest.fixture
def searched(tmp_path: Path, monkeypatch) -> Space:
    """A folder in which a search of three rows is done, and the arguments of the stage."""
    (tmp_path / "params.yaml").write_bytes((ROOT / "params.yaml").read_bytes())
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["", "band1", METHOD])
    space = Space.of(load().parameters)
    unit, total = np.full((3, 5), 0.5), np.array([3.0, 1.0, 2.0])
    unit[:, 0] = [0.4, 0.45, 0.5]
    terms = dict.fromkeys(TERMS, total / 4)
    history = History(METHOD, space.names)
    history.save(Path(f"data/refined/band1/{METHOD}.parquet"))
    found = Evaluation(unit, space.to_physical(unit), terms, total, [None] * 3)
    history.add(found, phase="de", generation=0)
    history.save(Path(f"data/history/band1/{METHOD}.parquet"))
    episode(band="band1").save(Layout().episode("band1"))
    monkeypatch.setattr(theta, "promising", lambda *_: ([], 0))  # refined: nothing more
    return space


def test_a_theta_whose_neighbours_fail_has_no_confidence(searched, monkeypatch, capsys) -> None:
    """One method less to trust; what follows from it and the other methods goes on."""

    def slips(sling, episode, thetas):
        return SimpleNamespace(failure=["the band slips out of the fingers"] * len(thetas))

    monkeypatch.setattr(rounds, "interact", slips)
    theta.main()
    content = load_theta(Path(f"data/theta/band1/{METHOD}.json"), "band1")
    best = searched.to_physical(np.array([[0.45, 0.5, 0.5, 0.5, 0.5]]))[0]
    assert content["theta"] == pytest.approx(dict(zip(searched.names, best, strict=True)))
    assert content["confidence"] is None and law_discrepancy(content) == 0.0
    kept = Path(f"data/confidence/band1/{METHOD}.json")
    assert json.loads(kept.read_text()) == {"band": "band1", "samples": []}
    assert load_samples(kept) is None
    said = capsys.readouterr()
    assert f"warning: {METHOD}: episode of band1: 80 of 80 simulations near the best" in said.err
    assert "loss 1" in said.out and "(" not in said.out  # no interval beside a value
