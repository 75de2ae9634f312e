"""The notebooks run, come to what they say, and are kept small with their pictures."""

import json
import tomllib

import numpy as np
import pytest

from tests.project import ROOT

FOLDER = ROOT / "docs" / "notebooks"
CHECKS = {  # by notebook: what its variables must come to
    "1_quick_start": lambda end: end["low"] < 1.95 < end["high"],
    "2_your_recording": lambda end: end["young"].low < 2.2e5 < end["young"].high,
    "3_what_a_recording_tells": lambda end: end["low"] < end["truth"] < end["high"],
    "4_train_elsewhere": lambda end: (
        np.nanmean(end["miss"]) < 0.1 and not np.isnan(end["miss"]).any()
    ),
    "5_into_mujoco_and_back": lambda end: (
        end["exported"].met and np.abs(np.divide(end["landings"], end["ours"]) - 1).max() < 0.06
    ),
}


def cells(name: str, kind: str) -> list[dict]:
    notebook = json.loads((FOLDER / f"{name}.ipynb").read_text(encoding="utf-8"))
    return [cell for cell in notebook["cells"] if cell["cell_type"] == kind]


@pytest.mark.parametrize("name", CHECKS)
def test_it_is_small_has_pictures_and_installs_from_the_one_address(name: str) -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    code = cells(name, "code")
    assert code[0]["source"][0].endswith(f"git+{project['urls']['Repository']}\n")
    outputs = [output for cell in code for output in cell["outputs"]]
    assert any("image/png" in output.get("data", ()) for output in outputs)
    assert not any(output["output_type"] == "error" for output in outputs)
    assert (FOLDER / f"{name}.ipynb").stat().st_size < 60_000


@pytest.mark.slow
@pytest.mark.parametrize("name", CHECKS)
def test_it_runs(name: str, tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("MPLBACKEND", "agg")
    monkeypatch.chdir(tmp_path)
    end: dict = {}
    for cell in cells(name, "code"):
        exec("".join(cell["source"]), end)
    assert CHECKS[name](end)


def test_every_notebook_is_run() -> None:
    assert {path.stem for path in FOLDER.glob("*.ipynb")} == {*CHECKS}
