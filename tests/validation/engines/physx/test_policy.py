"""A policy by launches in PhysX, whose place our simulator takes here."""

import json
import sys
from contextlib import nullcontext
from types import SimpleNamespace

import numpy as np
import pytest

from pipeline.base.errors import UserError
from pipeline.params import load
from pipeline.simulator.launch import launch
from pipeline.simulator.parameters import THETA, Parameters
from tests.project import DEFAULTS
from validation.engines.physx import policy
from validation.projects import changed

VALUES = (2.0e5, 0.47, 2.4e-3, 0.7, 0.6)
SMALL = {"policy.map_size": [7, 7], "policy.iterations": 3, "policy.envs": 16, "trials.repeats": 2}


@pytest.fixture
def begun(tmp_path, monkeypatch):
    """policy.main in an empty folder; returns the sizes of the batches that were simulated."""
    batches = []

    def launch_in_physx(engine, sling, setup, thetas, draws):
        batches.append(len(draws))
        done = launch(sling, setup, Parameters.of(sling.law, thetas), draws)
        return SimpleNamespace(launches=done)

    monkeypatch.setattr(policy, "launch_in_physx", launch_in_physx)
    monkeypatch.setattr(policy, "Engine", nullcontext)
    monkeypatch.setattr(policy, "release", lambda: "0.7")
    monkeypatch.setattr(policy, "load", lambda path: changed(load(DEFAULTS), SMALL))
    speeds = [{"environments": 64, "physx_rollouts_per_s": 5.1}]
    monkeypatch.setattr(policy.study, "speeds", lambda bench, engine, counts: speeds)
    monkeypatch.setattr(policy, "DEVICE", "cpu")
    monkeypatch.setattr(sys, "argv", ["policy", "band1"])
    monkeypatch.chdir(tmp_path)
    return batches


def with_theta(tmp_path) -> None:
    path = tmp_path / policy.FOUND.format("band1")
    path.parent.mkdir(parents=True)
    theta = dict(zip(THETA, VALUES, strict=True))
    path.write_text(json.dumps({"physx": {"theta": theta}}), "utf-8")


def test_a_policy_is_trained_and_launched_there_in_ours_and_on_the_rig(begun, tmp_path) -> None:
    with_theta(tmp_path)
    policy.main()
    done = json.loads((tmp_path / policy.REPORT.format("band1")).read_text("utf-8"))
    assert done["landing_map"]["size"] == [7, 7] and done["training"]["iterations"] == 3
    assert sum(begun) == done["launches_in_physx"]["count"] + 3 and max(begun) <= policy.BATCH
    for row in done["targets"]:
        assert row["in_physx_m"] == pytest.approx(row["in_ours_m"], rel=0.01)
        assert len(row["on_rig_m"]) == 2
    assert {row["target_m"] for row in done["targets"]} == set(load(DEFAULTS).trials.targets)
    assert done["errors"]["on_rig_m"]["launches"] == 6 and done["speeds"]


def test_one_that_was_killed_launches_nothing_twice(begun, tmp_path, monkeypatch) -> None:
    with_theta(tmp_path)
    lost = SimpleNamespace(landing_y=np.nan)
    monkeypatch.setattr("rig.physics.launch.launch", lambda *of: lost)
    policy.main()
    before = len(begun)
    csv = tmp_path / "landings.csv"
    csv.write_text("draw_y_m,draw_z_m,landing_y_m\n-0.35,-0.15,2.0\n-0.3,-0.2,1.5\n")
    monkeypatch.setattr(sys, "argv", ["policy", "band1", "--landings", str(csv)])
    policy.main()
    assert begun[before:] == [2]  # the measured draws
    done = json.loads((tmp_path / policy.REPORT.format("band1")).read_text("utf-8"))
    assert [row["measured_m"] for row in done["measured"]] == [2.0, 1.5]
    assert done["errors"]["on_rig_m"] == {"mean_error_m": None, "launches": 6, "failed": 6}


def test_the_rig_can_be_launched_elsewhere(begun, tmp_path, monkeypatch) -> None:
    content = {
        "band": "band1",
        "targets": [{"target_m": 1.9, "draw_m": [-0.35, -0.12]}],
        "errors": {},
    }
    path = tmp_path / policy.REPORT.format("band1")
    path.parent.mkdir(parents=True)
    path.write_text(json.dumps(content), "utf-8")
    monkeypatch.setattr(sys, "argv", ["policy", "band1", "--rig"])
    policy.main()
    done = json.loads(path.read_text("utf-8"))
    assert done["errors"]["on_rig_m"]["launches"] == 2 and done["errors"]["on_rig_m"]["failed"] == 0
    assert begun == [] and done["targets"][0]["draw_m"] == [-0.35, -0.12]


def test_the_rig_alone_wants_a_report(begun, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(sys, "argv", ["policy", "band1", "--rig"])
    with pytest.raises(UserError, match="physx-policy-band1.json: missing"):
        policy.main()


def test_without_a_search_in_physx_a_line_says_what_finds_theta(begun) -> None:
    with pytest.raises(UserError, match="physx.search band1 finds one"):
        policy.main()
