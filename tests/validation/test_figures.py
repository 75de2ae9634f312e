"""Of which code a figure is: by its digests, by its commit, by DVC; and whether it meets."""

import json
from pathlib import Path

import pytest

from app.flow.graph import outdated
from pipeline.base.code import digest
from pipeline.base.errors import UserError
from tests.project import ROOT, python, write_files
from validation import figures
from validation.figures import NOT_TOLD, OLDER, TODAY, UNKNOWN, as_json, listed, shown
from validation.projects import ProjectCopy


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A small project under Git, with the sources of a simulator and of a benchmark."""
    sources = "pipeline/simulator/solver.py", "pipeline/simulator/deep/er.py", "validation/bench.py"
    write_files(tmp_path, dict.fromkeys(sources, "a = 1\n"))
    ProjectCopy(tmp_path).commit()
    return tmp_path


def head(project: Path) -> str:
    return ProjectCopy(project)("git", "rev-parse", "--short", "HEAD").strip()


def write(project: Path, name: str, **content) -> None:
    path = project / "reports" / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(content))


def only(project: Path) -> figures.CommittedFigures:
    (committed,) = listed(project, outdated, project)
    return committed


def test_digests_of_folders_decide_where_a_file_has_them(project: Path) -> None:
    parts = ("pipeline/simulator", "validation/bench.py")
    code = {part: digest(project / part) for part in parts}
    write(project, "validation/x.json", code=code, met=False, commit="0" * 7)
    committed = only(project)
    assert (committed.file, committed.state) == ("reports/validation/x.json", TODAY)
    assert (committed.changed, committed.met, len(committed.digest)) == ([], False, 12)
    (project / "pipeline/simulator/deep/er.py").write_text("a = 2\n")
    assert (only(project).state, only(project).changed) == (OLDER, ["pipeline/simulator"])
    (project / "validation/bench.py").unlink()
    assert only(project).changed == [*parts]


def test_a_campaign_may_have_a_folder(project: Path) -> None:
    code = {"pipeline/simulator": digest(project / "pipeline/simulator")}
    write(project, "validation/machines/one.json", code=code)
    assert only(project).file == "reports/validation/machines/one.json"


def test_without_digests_the_simulator_and_the_commit_decide(project: Path) -> None:
    commit, sling = head(project), project / "pipeline/simulator"
    for content, state in (
        ({}, UNKNOWN),
        ({"commit": None, "simulator": digest(sling)}, UNKNOWN),
        ({"commit": None, "simulator": "0123456789ab"}, OLDER),
        ({"commit": "--output=x", "simulator": digest(sling)}, UNKNOWN),
        ({"commit": "0123456"}, UNKNOWN),
        ({"commit": commit, "simulator": digest(sling)}, TODAY),
        ({"commit": f"{commit}-dirty"}, UNKNOWN),
    ):
        write(project, "benchmarks/x.json", **content)
        assert only(project).state == state, content
    assert not (project / "x").exists()
    (project / "validation/bench.py").write_text("a = 3\n")
    for revision in (commit, f"{commit}-dirty"):
        write(project, "benchmarks/x.json", commit=revision, simulator=digest(sling))
        assert (only(project).state, only(project).changed) == (OLDER, [])


def test_since_the_commit_only_what_the_command_names_counts(project: Path) -> None:
    commit = head(project)
    (project / "pipeline/simulator/solver.py").write_text("a = 5\n")
    for command, state in (
        ("python -m validation.bench band1", TODAY),
        ("python -m pytest -n 0 validation/bench.py", TODAY),
        ("python -m validation.none", OLDER),
        ("sling bench --json", OLDER),
    ):
        write(project, "validation/x.json", commit=commit, command=command)
        assert only(project).state == state, command
    (project / "validation/bench.py").write_text("import pipeline.simulator.solver\n")
    write(project, "validation/x.json", commit=commit, command="python -m validation.bench")
    assert only(project).state == OLDER


def test_a_verification_is_met_if_all_its_limits_are_kept(project: Path) -> None:
    for values, met in (([True, None], True), ([True, False], False), ([None], None)):
        checks = [{"met": value} for value in values]
        write(project, "simulator.json", sections=[{"checks": checks}, {"checks": []}])
        assert only(project).met is met


def test_dvc_decides_of_what_stages_write(project: Path, monkeypatch) -> None:
    monkeypatch.chdir(project)
    write(project, "summary.json", band1_cm=2.0)
    assert only(project).state == NOT_TOLD  # no DVC here
    stage = "{cmd: echo 1 > out, deps: [pipeline/simulator, in], outs: [out]}"
    (project / "dvc.yaml").write_text(f"stages:\n  report: {stage}\n")
    (project / "in").write_text("data\n")
    for words in (("init", "-q"), ("repro", "-q")):
        assert python("-m", "dvc", *words, folder=project).returncode == 0
    assert only(project).state == TODAY
    (project / "in").unlink()  # as in a fresh clone
    assert only(project).state == TODAY
    (project / "pipeline/simulator/solver.py").write_text("a = 4\n")
    assert only(project).state == OLDER


def test_table_and_json_say_the_same(project: Path) -> None:
    write(project, "validation/a.json", code={"pipeline/simulator": "0123456789ab"}, met=True)
    write(project, "validation/b.json", met=False)
    committed = listed(project, outdated, project)
    lines = shown(committed).splitlines()
    assert lines[1].split() == ["reports/validation/a.json", "0123456789ab", *OLDER.split(), "met"]
    assert lines[2].endswith(f"{UNKNOWN}  not met")
    assert lines[-1] == "0 of 2 are of today's code, 1 of older code; 1 do not meet what they ask"
    first, second = json.loads(as_json(committed))["figures"]
    assert first["state"] == OLDER and first["changed"] == ["pipeline/simulator"] and first["met"]
    assert (second["digest"], second["met"]) == (None, False)


def test_a_users_mistake(project: Path) -> None:
    with pytest.raises(UserError, match="no figures; run this in the project's folder"):
        listed(project, outdated)
    write(project, "validation/x.json")
    for text in ("[]", "{", "\xff"):
        (project / "reports/validation/x.json").write_text(text, encoding="latin-1")
        with pytest.raises(UserError, match="reports/validation/x.json: "):
            listed(project, outdated)


def test_the_command_lists_each_committed_file() -> None:
    names = ProjectCopy(ROOT)("git", "ls-files", "reports/*.json")
    done = python("-m", "app", "figures", "--json", folder=ROOT)
    summary = {load["file"] for load in json.loads(done.stdout)["figures"]}
    assert {*names.split()} <= summary and len(summary) > 20
