"""Presets in params.yaml, and where the report of such a run is kept."""

from pathlib import Path

import pytest
from dvc.utils.hydra import apply_overrides
from ruamel.yaml import YAML

from pipeline.params import load
from sling2sim2real.base.errors import UserError
from tests.project import DEFAULTS
from tools.preset import PRESETS, preset, write_preset


def leaves(node: dict, *path: str) -> dict[tuple, object]:
    """Values by their keys' paths; a list is one value."""
    values = {}
    for key, value in node.items():
        values |= leaves(value, *path, key) if isinstance(value, dict) else {(*path, key): value}
    return values


def notes(text: str) -> list[str]:
    return [line.partition("#")[2] for line in text.splitlines() if "#" in line]


@pytest.mark.parametrize("name", sorted(path.stem for path in PRESETS.glob("*.yaml")))
def test_a_presets_keys_are_all_that_changes(name: str, tmp_path: Path) -> None:
    before, path = DEFAULTS.read_text(encoding="utf-8"), tmp_path / "params.yaml"
    path.write_text(before, encoding="utf-8")
    write_preset(path, preset(name))
    load(path)  # is valid
    after = path.read_text(encoding="utf-8")
    old, new = (YAML(typ="safe").load(text) for text in (before, after))
    asked = YAML(typ="safe").load(PRESETS / f"{name}.yaml")
    assert new.pop("run") == asked.pop("run", old["run"])  # replaced, as a whole
    del old["run"]
    old, new, asked = leaves(old), leaves(new), leaves(asked)
    assert set(asked) <= set(old)  # each key stands in params.yaml, so that one sees it change
    assert new == old | asked and all(old[key] != value for key, value in asked.items())
    rest = [text[text.index("\nbands:") :] for text in (before, after)]
    assert notes(rest[0]) == notes(rest[1])
    write_preset(path, preset(name))  # again, as after a kill
    assert path.read_text(encoding="utf-8") == after
    apply_overrides(path, ["optimizer.seed=1"])  # as `dvc exp run -S` does
    assert path.read_text(encoding="utf-8") == after


def test_the_papers_preset_has_no_method_of_ours_and_searches_the_whole_box(tmp_path: Path) -> None:
    path = tmp_path / "params.yaml"
    path.write_text(DEFAULTS.read_text(encoding="utf-8"), encoding="utf-8")
    write_preset(path, preset("paper"))
    params = load(path)
    run = [params.methods[pair.method] for pair in params.run.pairs.values()]
    assert len(run) == 16 and not any(method.mounting for method in run)
    assert {method.law for method in run} == {"corotated"} and not any(
        method.bounds for method in run
    )
    assert not params.methods["paper"].fixed


def test_what_is_no_preset_or_spoils_params_is_refused_and_nothing_changes(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="^huge: no such preset; there are large, paper$"):
        preset("huge")
    path, text = tmp_path / "params.yaml", DEFAULTS.read_text(encoding="utf-8")
    path.write_text(text, encoding="utf-8")
    for wrong, summary in (
        ({"optimizer": {"populatoin": 64}}, "optimizer.populatoin"),
        ({"optimizer": {"population": "many"}}, "optimizer.population"),
    ):
        with pytest.raises(UserError, match=summary):
            write_preset(path, wrong)
        assert path.read_text(encoding="utf-8") == text
