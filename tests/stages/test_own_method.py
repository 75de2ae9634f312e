"""docs/own-method.md, as a newcomer follows it: its words are put into files, and stages run."""

import json
import re
import runpy
import sys
from pathlib import Path

import pytest

from pipeline.layout import Layout
from pipeline.params import load
from sling2sim2real.simulator.parameters import Parameters
from tests.project import DEFAULTS, ROOT
from validation.synthetic import own_law_episode, recorded_yardstick

PAGE = (ROOT / "docs/own-method.md").read_text(encoding="utf-8")
METHOD, OF_RUBBER, SEARCH = re.findall(r"```yaml\n(.*?)```", PAGE, re.DOTALL)
(CODE,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
PAIR = "    " + re.findall(r"`(band1-mine: .*?)`", PAGE)[0] + "\n"
NAME = "  mine:\n"
BUDGET = {"cma_rollouts: 420": "cma_rollouts: 15", "population: 20": "population: 5"}
BUDGET |= {"generations: 8": "generations: 1"}
BUDGET |= {"k_nn: 15": "k_nn: 6", "k_top: 5": "k_top: 1", "cma_population: 8": "cma_population: 5"}


def written(folder: Path, method: str, kind: str, pair: str) -> None:
    """params.yaml with lines more under `methods`, and under a kind of search of `run`."""
    text = DEFAULTS.read_text(encoding="utf-8")
    changes = BUDGET | {"\nmethods:\n": f"\nmethods:\n{method}"}
    for old, new in (changes | {f"  {kind}: &{kind}\n": f"  {kind}: &{kind}\n{pair}"}).items():
        assert old in text, old
        text = text.replace(old, new, 1)
    (folder / "params.yaml").write_text(text, encoding="utf-8")


@pytest.mark.parametrize("method", [METHOD.removeprefix("methods:\n"), NAME + OF_RUBBER])
def test_a_method_of_ones_own_is_accepted(tmp_path: Path, method: str) -> None:
    written(tmp_path, method, "multistart", PAIR)
    params = load(tmp_path / "params.yaml")
    assert params.run.explored["band1-mine"].method == "mine"
    assert params.methods["mine"].search == "multistart"


def test_a_search_of_ones_own_finds_theta(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "my_search.py").write_text(CODE, encoding="utf-8")
    method, pair = SEARCH.removeprefix("methods:\n").split("run:\n  search:\n")
    written(tmp_path, method, "search", pair)
    params, layout = load(), Layout()
    sling, episode = recorded_yardstick(params)
    truth = Parameters.of(sling.law, [2e5, 0.45, 2e-3, 0.7, 0.6])
    mine = params.run.pairs["band1-mine"]
    own_law_episode(sling, episode, truth, cutoff=35.0).save(layout.episode(mine))
    monkeypatch.setattr(sys, "argv", ["stage", mine.key])
    for stage in ("search", "theta"):
        with pytest.raises(SystemExit) as ended:
            runpy.run_module(f"stages.{stage}", run_name="__main__")
        assert not ended.value.code
    content = json.loads(layout.theta(mine).read_text())
    assert content["method"] == "mine" and content["rollouts"] == 5 * (1 + 1) + 15
    shown = json.loads(layout.metrics(mine).read_text())[mine.key]  # of `dvc metrics diff`
    assert shown["E_kPa"] == pytest.approx(1e-3 * content["theta"]["youngs_modulus"], rel=1e-3)
