"""From an episode to θ by both stages of a search, with the calibrated clamps and without them."""

import json
import runpy
import sys
from pathlib import Path

import pytest
from ruamel.yaml import YAML

from pipeline.layout import Layout
from pipeline.params import load
from sling2sim2real.base.files import write_json
from sling2sim2real.identification.results.theta import calibrated, load_theta
from sling2sim2real.simulator.parameters import Parameters
from tests.project import DEFAULTS
from validation.synthetic import own_law_episode, recorded_yardstick

BUDGET = {"population": 5, "generations": 2, "k_top": 1, "k_nn": 6, "cma_population": 4}
SHOWN = {"clamp_direction": [0.6, 0.0, -0.8], "flexural_rigidity": 2e-3}


@pytest.mark.parametrize("mounting", [True, False])
def test_what_a_method_leaves_out_is_left_out_everywhere(
    mounting: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    yaml = YAML()
    content = yaml.load(DEFAULTS)
    content["optimizer"].update({**BUDGET, "cma_rollouts": 4})
    content["methods"]["paper"]["mounting"] = mounting
    yaml.dump(content, tmp_path / "params.yaml")
    params, layout = load(), Layout()
    sling, episode = recorded_yardstick(params)
    truth = Parameters.of(sling.law, [2e5, 0.45, 2e-3, 0.7, 0.6])
    episode = own_law_episode(sling, episode, truth, cutoff=35.0)
    pair = params.run.pairs["band1-paper"]
    episode.save(layout.episode(pair))
    write_json(layout.clamps(pair), SHOWN)
    monkeypatch.setattr(sys, "argv", ["stage", pair.key])
    for stage in ("history", "clusters", "cma", "theta"):
        with pytest.raises(SystemExit) as ended:
            runpy.run_module(f"stages.{stage}", run_name="__main__")
        assert not ended.value.code
    path = layout.theta(pair)
    saved = load_theta(path, "band1")
    shown = json.loads(layout.metrics(pair).read_text())[pair.key]  # of `dvc metrics diff`
    assert shown["E_kPa"] == pytest.approx(1e-3 * saved["theta"]["youngs_modulus"], rel=1e-3)
    terms = (saved["loss"][term] for term in ("geom", "force", "work"))
    assert shown["loss"] == pytest.approx(sum(terms), rel=1e-3)
    assert json.loads(path.read_text()).get("mounted") == (None if mounting else False)
    sling = calibrated(params, "band1", saved, layout.clamps(pair))
    assert (sling.flexural_rigidity == 2e-3) == mounting
