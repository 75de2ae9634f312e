"""`sling observe`: what it writes, what it runs, what it refuses."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from pipeline.flow.dvc import StageFailed
from sling2sim2real.base.errors import UserError
from sling2sim2real.base.layout import Layout
from sling2sim2real.cli import cli, observe
from tests.project import DEFAULTS, with_

DRAW, LANDING = (-0.3, -0.17), 2.2


@pytest.fixture
def put(tmp_path, params, monkeypatch):
    """`observe` of band1 in an empty project, with the stages that DVC was asked for."""
    requested = []

    def repro(root, stage, on_line):
        requested.append(stage)
        if failures:
            raise StageFailed(failures.pop())

    monkeypatch.setattr(observe, "repro", repro)
    failures = []

    def run(draw=DRAW, landing=LANDING, band="band1", method="posterior", **options) -> dict:
        return observe.observe(params, band, method, draw, landing, root=tmp_path, **options)

    return SimpleNamespace(run=run, requested=requested, failures=failures, layout=Layout(tmp_path))


def test_a_launch_is_written_below_the_others_and_the_policy_runs(put) -> None:
    first = put.run()
    assert put.run((-0.32, -0.2), 3.0, error=0.0)["launches"] == 2
    file = put.layout.evidence / "band1.csv"
    assert file.read_text() == (
        "draw_y_m,draw_z_m,draw_error_m,landing_y_m\n-0.3,-0.17,,2.2\n-0.32,-0.2,0.0,3.0\n"
    )
    assert put.requested == ["policy@band1-posterior"] * 2
    answer = {"file": str(file), "launches": 1, "before": None, "after": None, "warnings": []}
    assert first == answer | {"measured_m": LANDING}
    assert list(file.parent.iterdir()) == [file]


def test_no_run_runs_nothing(put) -> None:
    assert put.run(run=False)["after"] is None
    assert put.requested == []


def test_a_stage_that_fails_says_why_and_the_launch_stays(put) -> None:
    put.failures.append("it broke")
    with pytest.raises(StageFailed, match="it broke"):
        put.run()
    assert (put.layout.evidence / "band1.csv").is_file()


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"band": "none"}, "--band none: not in params.yaml"),
        ({"method": "none"}, "--method none: not in params.yaml"),
        ({"method": "paper"}, "takes no launches as evidence"),
        ({"draw": (-0.3, -0.6)}, "lies below the floor"),
    ],
)
def test_refuses_what_is_no_launch(put, wrong: dict, message: str) -> None:
    with pytest.raises(UserError, match=message):
        put.run(**wrong)
    assert put.requested == [] and not put.layout.evidence.exists()


def test_refuses_a_launch_that_is_there_or_a_score(put) -> None:
    put.run(run=False)
    with pytest.raises(UserError, match="this launch is there already"):
        put.run()
    put.layout.measured.mkdir(parents=True)
    score = put.layout.measured / "band1.csv"
    score.write_text("draw_y_m,draw_z_m,landing_y_m\n-0.4,-0.2,3.0\n")
    with pytest.raises(UserError, match="evidence or a score, never both"):
        put.run((-0.4, -0.2), 3.0)
    assert len((put.layout.evidence / "band1.csv").read_text().splitlines()) == 2


def test_an_equal_launch_is_one_more_where_that_is_said(put) -> None:
    put.run(run=False)
    with pytest.raises(UserError, match="one more that is equal, add --again"):
        put.run(run=False)
    assert put.run(run=False, again=True)["launches"] == 2
    assert (put.layout.evidence / "band1.csv").read_text().count("-0.3,-0.17,,2.2\n") == 2


def test_undo_takes_the_last_launch_out_and_the_policy_runs(put, params) -> None:
    def undo(**options) -> dict:
        root = put.layout.root
        return observe.undo(params, "band1", "posterior", root=root, **options)

    put.run(run=False)
    before = (put.layout.evidence / "band1.csv").read_text()
    put.run((-0.32, -0.2), 3.0, error=0.001, run=False)
    answer = undo()
    assert (put.layout.evidence / "band1.csv").read_text() == before
    assert (answer["launches"], answer["measured_m"]) == (1, 3.0)
    assert answer["removed"] == {"draw": [-0.32, -0.2], "error": 0.001}
    assert put.requested == ["policy@band1-posterior"]
    lines = observe.shown(answer | {"after": None}).splitlines()
    assert lines[0].endswith("1 launch as evidence")
    assert lines[1:] == ["taken out: the draw to -0.32, -0.2", "measured  3.000 m; nothing has run"]
    undo(run=False)
    assert not (put.layout.evidence / "band1.csv").exists()
    with pytest.raises(UserError, match=r"band1.csv: holds no launch of band1"):
        undo(run=False)
    assert len(put.requested) == 1


def test_a_launch_outside_its_interval_is_doubted_before_stages_run(
    put, monkeypatch, capsys
) -> None:
    summary = {"landing_m": 2.0, "interval_90_m": [1.9, 2.1], "failure": None}
    monkeypatch.setattr(observe, "prediction_of", lambda *_: summary)
    for landing, doubts in ((2.09, 0), (1.91, 0), (2.11, 1), (1.89, 1)):
        answer = put.run((-0.3, -landing / 10), landing)
        assert [warning["about"] for warning in answer["warnings"]] == ["miss"] * doubts
        assert capsys.readouterr().err.count("lies outside the predicted interval") == doubts
    monkeypatch.setattr(observe, "prediction_of", lambda *_: summary | {"interval_90_m": None})
    assert put.run((-0.4, -0.2), 9.0)["warnings"] == []


def test_a_launch_that_fails_in_simulation_is_reported(put, monkeypatch, capsys) -> None:
    summary = {"landing_m": None, "interval_90_m": None, "failure": "the band is slack"}
    monkeypatch.setattr(observe, "prediction_of", lambda *_: summary)
    (warning,) = put.run()["warnings"]
    assert warning["about"] == "failure" and "counts for nothing" in warning["what"]
    assert capsys.readouterr().err == f"warning: {warning['what']}\n"


def test_a_draw_deeper_than_any_before_is_told_once(put, params, monkeypatch, capsys) -> None:
    """Recorded to 0.35 m; then launches in the order of the table; 2 mm are no news."""
    place = np.array([[0.0, -0.1, 0.0], [0.0, -0.35, 0.0]])
    episode = SimpleNamespace(time=np.arange(2.0), position=place, grasp_time=0.0, release_time=1.0)
    monkeypatch.setattr(observe.Episode, "load_all", lambda folder: [episode])
    draws = (-0.30, 0), (-0.352, 0), (-0.40, 0), (-0.38, 0), (-0.402, 0), (-0.45, 0)
    summary = [put.run(draw, 2.0 + i, run=False)["warnings"] for i, draw in enumerate(draws)]
    assert [len(warnings) for warnings in summary] == [0, 0, 1, 0, 0, 1]
    first, second = (warnings[0]["what"] for warnings in summary if warnings)
    assert "drew band1 to 0.400 m, 0.352 m was the most before" in first
    assert "count as of the softened band" in first and "0.402 m was the most" in second
    assert capsys.readouterr().err == f"warning: {first}\nwarning: {second}\n"

    stays = with_(params, "methods.posterior", fixed={"softening": 0.0})
    for whole, draw, words in (
        (with_(params, "bands.band1", preconditioned=True), (-0.6, 0.0), None),
        (stays, (-0.7, 0.0), "posterior leaves that out"),
    ):
        answer = observe.observe(
            whole, "band1", "posterior", draw, 3.0, run=False, again=True, root=put.layout.root
        )
        assert [words in warning["what"] for warning in answer["warnings"]] == (
            [True] if words else []
        )


def test_what_is_said_before_and_after() -> None:
    summary = {
        "landing_m": 2.0,
        "interval_90_m": [1.9, 2.1],
        "failure": None,
        "returned_share": 1.0,
        "share_90": [0.9, 1.1],
    }
    failed = {**summary, "landing_m": None, "interval_90_m": None, "failure": "the band is slack"}
    output = {"file": "x.csv", "launches": 2, "measured_m": 2.2, "before": summary, "after": failed}
    text = observe.shown(output)
    assert text.splitlines() == [
        "x.csv: 2 launches as evidence",
        "before  landing 2.000 m (90 %: 1.900 to 2.100 m), returned share 1.000"
        " (90 %: 0.900 to 1.100)",
        "after   landing fails in simulation: the band is slack, returned share 1.000"
        " (90 %: 0.900 to 1.100)",
        "measured  2.200 m",
    ]


def test_the_command(put, monkeypatch, capsys) -> None:
    given = "observe --band band1 --draw=-0.3,-0.17 --landing 2.2 --no-run --json".split()
    arguments = cli.parser().parse_args(given)
    monkeypatch.setattr(observe, "Layout", lambda root: put.layout)
    monkeypatch.chdir(DEFAULTS.parent)
    assert cli.execute(arguments) == 0
    assert json.loads(capsys.readouterr().out)["launches"] == 1
