"""The campaign of the machines: equal inputs give an equal θ, and differences are noticed."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from ruamel.yaml import YAML

from pipeline.base.errors import UserError
from pipeline.base.files import write_json
from pipeline.base.layout import Layout, NotMade
from pipeline.base.schema import read_json
from pipeline.episode.signal import cutoff_hz
from pipeline.identify.results.mounting import load_sling
from pipeline.params import load
from pipeline.simulator.launch import launch
from pipeline.simulator.model import LaunchSetup
from pipeline.simulator.parameters import Parameters
from tests.project import DEFAULTS, ROOT
from validation.campaigns import machines
from validation.campaigns.machines import DRAWS, FOLDER, LIMIT, OURS, PAPER, MachineReport
from validation.projects import ROUGH
from validation.synthetic import own_law_episode, pull_and_release

BAND, TRUE = "band1", (2e5, 0.45, 4e-3, 0.7, 0.6)
BUDGET = {"population": 8, "generations": 1, "k_top": 1, "k_nn": 6}
BUDGET |= {"cma_population": 4, "cma_rollouts": 4}


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """params.yaml with a tiny budget, and what a run has left of a band of the simulator's law."""
    root, yaml = tmp_path_factory.mktemp("machines"), YAML()
    content = yaml.load(DEFAULTS)
    content["sling"].update(ROUGH)
    content["optimizer"].update(BUDGET)
    ours = content["methods"][OURS]  # no unloading shows the softening, which this law has not
    ours["fixed"]["softening"] = 0.0
    del ours["bounds"]["softening"]
    yaml.dump(content, root / "params.yaml")
    params, layout = load(root / "params.yaml"), Layout(root)
    clamps = {"clamp_direction": [0.0, 0.0, -1.0], "flexural_rigidity": 1e-5}
    write_json(layout.clamps(BAND), clamps)
    sling = load_sling(params, BAND, root)
    cutoff = cutoff_hz(params.force.cutoff, params.force.cutoff_unit)
    plan = pull_and_release(BAND, params.episode, sling)
    own_law_episode(sling, plan, Parameters.of(sling.law, TRUE), cutoff=cutoff).save(
        layout.episode(BAND)
    )
    return root


@pytest.fixture(scope="module")
def measured(project: Path) -> dict:
    return machines.measure([BAND], project, "cpu")


def test_the_same_inputs_give_the_same_theta_with_other_threads(
    project, measured, monkeypatch
) -> None:
    monkeypatch.setenv("SLING_WORKERS", "1")
    again = machines.measure([BAND], project, "cpu")
    for content in (measured, again):
        for result in content["bands"][BAND].values():
            result["seconds"] = 0
    assert again == measured
    ours, paper = (measured["bands"][BAND][method] for method in (OURS, PAPER))
    assert len(paper["theta"]) == 5 and len(ours["theta"]) == 14
    params = load(project / "params.yaml")
    world = load_sling(params, BAND, project), LaunchSetup.of(params.setup, params.sling)
    true = launch(*world, Parameters.of(world[0].law, TRUE), np.array(DRAWS)).landing_y
    assert np.isfinite(true).sum() >= 8
    np.testing.assert_allclose(np.array(ours["landing"], float), true, rtol=0.05)


def test_a_band_that_nobody_recorded_is_refused(project) -> None:
    with pytest.raises(NotMade, match="signals.parquet: missing"):
        machines.measure(["band2"], project, "cpu")
    with pytest.raises(UserError, match="band9"):
        machines.measure(["band9"], project, "cpu")


@pytest.mark.parametrize("changed", ["episode", "clamps", "params.yaml"])
def test_another_input_has_another_digest(project, changed: str, tmp_path: Path) -> None:
    root = shutil.copytree(project, tmp_path / "other")
    layout = Layout(root)
    if changed == "episode":
        with (layout.episode(BAND) / "clouds.parquet").open("ab") as file:
            file.write(b" ")
    elif changed == "clamps":
        layout.clamps(BAND).write_text(layout.clamps(BAND).read_text().replace("1e-05", "2e-05"))
    else:
        text = (root / "params.yaml").read_text()
        (root / "params.yaml").write_text(text.replace("mass: 0.023", "mass: 0.024"))
    digests = [machines.inputs(load(at / "params.yaml"), BAND, at) for at in (project, root)]
    assert digests[0] != digests[1]


ABOUT = {
    "processor": "one",
    "device": "cpu",
    "device_name": "one",
    "inputs": {BAND: "a"},
    "code": {"pipeline/simulator": "a", "validation/campaigns": "a"},
    "draws": [[-0.36, -0.2], [-0.30, -0.2]],
}


def summary(ours: list, paper: list = (1.5, 2.0), **more) -> dict:
    """A machine's JSON with landings."""
    result = {"theta": {"youngs_modulus": 2e5}, "loss": 0.4, "seconds": 1.0}
    methods = {OURS: result | {"landing": ours}, PAPER: result | {"landing": list(paper)}}
    return ABOUT | {"bands": {BAND: methods}} | more


def command(folder: Path, monkeypatch, *contents: dict) -> int:
    paths = [folder / f"{number}.json" for number in range(len(contents))]
    for path, content in zip(paths, contents, strict=True):
        write_json(path, content)
    monkeypatch.setattr("sys.argv", ["machines", "--compare", *map(str, paths)])
    return machines.main()


def test_our_landings_may_differ_by_a_limit_and_the_papers_by_anything(
    tmp_path, monkeypatch, capsys
) -> None:
    near = summary(
        [1.5 * (1 + 0.9 * LIMIT), 2.0],
        [1.8, 2.0],
        code=ABOUT["code"] | {"validation/campaigns": "b"},
    )
    assert command(tmp_path, monkeypatch, summary([1.5, 2.0]), near) == 0
    out = capsys.readouterr().out
    assert f"{OURS}: landings of any two differ by 0.18 % at most; within 0.2 %" in out
    assert f"{PAPER}: by 20 % at most" in out
    far = summary([1.5, 2.0 * (1 - 1.1 * LIMIT)])
    assert command(tmp_path, monkeypatch, summary([1.5, 2.0]), near, far) == 1
    assert "MORE than 0.2 %" in capsys.readouterr().out


def test_a_launch_that_fails_on_one_machine_alone_is_a_difference(tmp_path, monkeypatch) -> None:
    both = summary([1.5, None])
    assert command(tmp_path, monkeypatch, both, both) == 0
    assert command(tmp_path, monkeypatch, both, summary([1.5, 2.0])) == 1


@pytest.mark.parametrize(
    ("what", "value"),
    [("inputs", {BAND: "b"}), ("draws", [[-0.3, -0.2]]), ("code", {"pipeline/simulator": "b"})],
)
def test_what_is_not_of_the_same_is_not_compared(tmp_path, monkeypatch, what, value) -> None:
    with pytest.raises(UserError, match=f"0 and 1: of different {what}"):
        command(tmp_path, monkeypatch, summary([1.5, 2.0]), summary([1.5, 2.0], **{what: value}))
    with pytest.raises(UserError, match="two machines at least"):
        command(tmp_path, monkeypatch, summary([1.5, 2.0]))


@pytest.fixture
def runs(tmp_path, monkeypatch):
    """Compare two runs with these outputs; the exit status and what is written."""

    def compare(*outputs: dict[str, str]) -> tuple[int, dict]:
        folders = [tmp_path / name for name in ("one", "two")]
        for folder, digests in zip(folders, outputs, strict=True):
            (folder / machines.TABLE).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / machines.TABLE, folder / machines.TABLE)
            outs = [{"path": path, "md5": digest} for path, digest in digests.items()]
            stages = {"all": {"outs": outs}, "none": {"cmd": "x"}}
            YAML().dump({"stages": stages}, folder / "dvc.lock")
        report = tmp_path / "twice.json"
        words = ["--twice", *map(str, folders), "--report", str(report)]
        monkeypatch.setattr("sys.argv", ["machines", *words])
        return machines.main(), json.loads(report.read_text())

    return compare


def test_equal_runs_and_one_that_has_more(runs, capsys) -> None:
    status, content = runs({"a": "1", "b": "2"}, {"a": "1", "b": "2", "c": "3"})
    assert status == 0
    assert capsys.readouterr().out == "0 of 2 outputs differ\n"
    assert (content["met"], content["outputs"], content["differing"]) == (True, 2, [])
    landings = content["landings_cm"]
    assert {"band1 least_squares", "band3 sling2sim2real"} <= landings.keys()
    assert all(landing["these_runs"] == landing["committed"] for landing in landings.values())


def test_what_differs_or_lacks_is_named(runs, capsys) -> None:
    status, content = runs({"a": "1", "b": "2", "c": "3"}, {"a": "1", "b": "x"})
    assert status == 1
    assert (content["met"], content["differing"]) == (False, ["b", "c"])
    assert capsys.readouterr().out.splitlines()[:-1] == ["b", "c"]


def test_what_is_no_run_is_one_line(tmp_path, monkeypatch) -> None:
    (tmp_path / "dvc.lock").write_text("[]")
    monkeypatch.setattr("sys.argv", ["machines", "--twice", str(tmp_path), str(tmp_path)])
    with pytest.raises(UserError, match="dvc.lock: no dvc.lock of a run"):
        machines.main()
    monkeypatch.setattr("sys.argv", ["machines"])
    with pytest.raises(UserError, match="--twice RUN OTHER is wanted"):
        machines.main()


COMMITTED = sorted((ROOT / FOLDER).glob("*.json"))


@pytest.mark.skipif(len(COMMITTED) < 2, reason="fewer than two machines have been measured")
def test_committed_machines_agree() -> None:
    lines, met = machines.compared(
        {path.stem: read_json(path, MachineReport) for path in COMMITTED}
    )
    assert met, "\n".join(lines)
