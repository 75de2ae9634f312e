"""The whole DAG on a tiny budget, in a copy of the project: what runs, and what runs again."""

import json
import os
import re
import shutil
import signal
import time
from collections.abc import Collection, Iterable
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import networkx
import pytest
from numba.core.caching import UserProvidedCacheLocator
from ruamel.yaml import YAML

from pipeline.flow.dvc import graph_of
from rig.physics import compiled
from tests.project import ROOT, contents, until
from validation.projects import TINY, MarkedRun, ProjectCopy, copy_project, run_of

pytestmark = pytest.mark.slow
METHODS = ["least_squares", "sling2sim2real"]
OURS, PAPER = METHODS
OWN = "mine"  # a band of the user's own, by the first method alone
SEARCH = {OURS: ["history", "density"], PAPER: ["history", "clusters", "cma"], "bo": ["bo"]}


def of_method(method: str, first: str = "", band: str = "band1") -> set[str]:
    """Stages of a method, from one step on."""
    is_own = band == OWN
    kind = "own_" if is_own else "" if method in METHODS else "ablation_"
    steps = [*SEARCH[method], "theta", "policy", *([] if is_own else ["launches"]), "trials"]
    return {f"{kind}{step}@{band}-{method}" for step in steps[steps.index(first or steps[0]) :]}


def of_band(*steps: str, band: str = "band1") -> set[str]:
    return {f"{'own_' if band == OWN else ''}{step}@{band}" for step in steps}


OWN_CHAIN = {
    *of_band("episode", "clamps", "evidence", "card", band=OWN),
    *of_method(OURS, band=OWN),
}
EVERYTHING = {
    *of_band("record", "episode", "clamps", "evidence", "floor", "card"),
    *(stage for method in SEARCH for stage in of_method(method)),
    *OWN_CHAIN,
    "report",
}


LAUNCH = "draw_y_m,draw_z_m,landing_y_m\n-0.3,-0.17,2.0\n"


class Copy(ProjectCopy):
    """A copy of the project's files in a Git repository of its own."""

    def __init__(self, folder: Path) -> None:
        super().__init__(
            folder,
            PYTHONPATH=str(ROOT / "tests" / "audit"),
            AUDIT=str(folder.parent / "audit"),
            SLING_WORKERS="1",
        )
        (folder.parent / "audit").mkdir()
        copy_project(folder)
        share_compiled(folder)
        self.set(TINY | run_of(["band1"], METHODS, ["bo"]))
        band = {"source": "recording", "mass": 0.023, "diameter": 0.010, "rest_length": 0.52}
        self.set({"run.own": [OWN], f"bands.{OWN}": band})
        (folder / "data/evidence/band1.csv").write_text(LAUNCH, "utf-8")
        self.commit()

    def status(self) -> dict[str, list[str]]:
        """Stages whose own inputs have changed since they ran: keys, files and folders."""
        changed = {}
        for stage, changes in json.loads(self("dvc", "status", "--json")).items():
            deps = [change["changed deps"] for change in changes]
            keys = [key for dep in deps for key in dep.pop("params.yaml", ())]
            changed[stage] = [*keys, *(path for dep in deps for path in dep)]
        return changed

    @cached_property
    def graph(self) -> networkx.DiGraph:
        return graph_of(self.folder)

    def after(self, names: Collection[str]) -> set[str]:
        """Stages that read what these make, and so on."""
        return set().union(*(networkx.descendants(self.graph, name) for name in names))


def share_compiled(copy: Path) -> None:
    """The copy's rig has the machine code of ours: Numba compiles longer than a tiny run lasts."""
    ours = Path(compiled.FOLDER)
    its = copy / compiled.HERE.relative_to(ROOT) / "__pycache__" / ours.name
    its.mkdir(mode=0o700, parents=True)
    here, there = (
        UserProvidedCacheLocator.get_suitable_cache_subpath(str(place / "rig/physics/x.py"))
        for place in (ROOT, copy)
    )
    (ours / here).mkdir(exist_ok=True)
    (its / there).symlink_to(ours / here)


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Copy:
    """After a run; the recording of a user's band is that of the rig's."""
    copy = Copy(tmp_path_factory.mktemp("project") / "copy")
    recorded = of_band("record")
    assert copy.dvc("repro", *recorded) == recorded
    recording = copy.folder / f"data/raw/{OWN}/{OWN}.mcap"
    recording.parent.mkdir()
    shutil.copy(copy.folder / "data/raw/band1/band1.mcap", recording)
    assert copy.dvc("repro") == EVERYTHING - recorded
    return copy


def test_a_run_leaves_only_its_lock_and_report_for_git(project: Copy) -> None:
    """DVC keeps its hands off .gitignore, and nothing else lies about."""
    changed = {line[3:] for line in project("git", "status", "--porcelain", "-uall").splitlines()}
    assert "dvc.lock" in changed
    assert all(name == "dvc.lock" or name.startswith("reports/") for name in changed)


OF_OTHER_RECORDINGS = {"setup.urdf"}


def covers(listed: str, read: str) -> bool:
    return f"{read}.".startswith(f"{listed}.")


def test_each_stage_lists_the_parameters_that_it_reads(project: Copy) -> None:
    """Neither more, or it would run in vain, nor less, or a change would do nothing."""
    stages = YAML(typ="safe").load(ROOT / "dvc.yaml")["stages"]
    project("sh", "stages/run.sh", "search", "band1", "de")  # alone: the rest is as by `bo`
    for folder in ("evaluations", "confidence"):
        for file in (project.folder / "data" / folder / "band1").glob("de.*"):
            file.unlink()
    everything_read, idle_keys = set(), {}
    for name in (*EVERYTHING, "ablation_de@band1-de"):
        step, *item = name.removeprefix("ablation_").removeprefix("own_").split("@")
        script = "@".join([stages[step]["cmd"].split()[2].removeprefix("stages."), *item])
        if step == "card":  # of the first method
            script += f"-{METHODS[0]}"
        band, _, method = item[0].partition("-") if item else ("", "", "")
        listed = [
            key.replace("${item.band}", band)
            .replace("${item.method}", method)
            .replace("${run.methods[0]}", METHODS[0])
            for key in stages[step].get("params", [])
        ]
        notes = list((project.folder.parent / "audit").glob(f"{script}.*.json"))
        assert notes, f"{name} left no note of what it read"
        read = {key for note in notes for key in json.loads(note.read_text())}
        unlisted = [key for key in read if not any(covers(prefix, key) for prefix in listed)]
        assert not unlisted, f"{name} reads parameters that dvc.yaml does not list"
        unread = {
            key.replace(method or " ", "${item.method}")
            for key in listed
            if not any(covers(key, read_key) for read_key in read)
        }
        unread -= {"setup.clamp_direction"} if method else OF_OTHER_RECORDINGS  # without mounting
        if method not in ("de", "bo"):  # methods share a list: what none of them reads is idle
            idle_keys[step] = idle_keys.get(step, unread) & unread
        everything_read.update(read)
    assert not any(idle_keys.values()), f"dvc.yaml lists what no method reads: {idle_keys}"
    content = YAML(typ="safe").load(project.folder / "params.yaml")
    keys = {f"{section}.{key}" for section, value in content.items() for key in value}
    keys -= {f"methods.{name}" for name in content["methods"]} - {
        "methods.sling2sim2real",
        "methods.least_squares",
    }
    keys -= {
        f"run.{key}" for key in ("rig", "own", "dips", "steps", "own_steps", "ablations")
    }  # dvc.yaml's
    keys -= {key for key in keys if key.startswith("plan.")}  # read by `sling plan`, and the rig
    keys -= {f"bands.{name}" for name in content["bands"]} - {"bands.band1"}  # those that run
    # read for other recordings, or with another mask: tests/recording shows what they do
    keys -= {*OF_OTHER_RECORDINGS}
    idle = {key for key in keys if not any(covers(key, read) for read in everything_read)}
    assert not idle, "parameters that do nothing"


def test_the_python_of_the_readme_runs(project: Copy) -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    code = text.split("```python\n")[1].split("```")[0].replace("band1_dip", "band1")
    message = project("python", "-c", code).splitlines()
    assert " Pa, 90 % interval " in message[0]
    assert float(message[1]) > 0 and len(message[2].strip("()").split(",")) == 2


def test_python_identifies_what_the_stage_does(project: Copy) -> None:
    """From the same episode and launch, without the project's files."""
    code = """
from pathlib import Path
import sling2sim2real as s2s
run = s2s.Identification.of_run("band1")
episode = s2s.Episode.load(Path("data/episodes/band1/1"))
error = run.settings.trials.actuation_error
seen = s2s.Observed((-0.3, -0.17), error, 2.0)
found = s2s.identify([episode], run.band, launches=[seen], settings=run.settings)
assert found.theta == run.theta, (found.theta, run.theta)
assert (found.samples == run.samples).all() and found.intervals == run.intervals
"""
    project("python", "-c", code)


def test_a_second_run_does_nothing(project: Copy) -> None:
    assert project.dvc("repro") == set()


def test_the_same_inputs_give_the_same_bytes(project: Copy) -> None:
    """Forced once more from one history on, every recorded hash stays, and the whole report."""
    before = (project.folder / "dvc.lock").read_text()
    reports = {
        file: file.read_bytes()
        for file in (project.folder / "reports").rglob("*")
        if file.is_file() and file.name != "run.js"  # when and where
    }
    ran = project.dvc(
        "repro",
        "--force",
        "--no-run-cache",
        "--downstream",
        "history@band1-sling2sim2real",  # of one phase: tests/identification
    )
    assert ran == {*of_method(PAPER), "report"}
    assert (project.folder / "dvc.lock").read_text() == before
    for file, content in reports.items():
        assert file.read_bytes() == content, file


def test_a_run_that_is_killed_goes_on_to_the_same_results(project: Copy) -> None:
    """All its processes at once, as by a power cut, within three of its stages."""
    lock, yaml = project.folder / "dvc.lock", YAML()
    content = yaml.load(lock)
    before = {name: content["stages"].pop(name) for name in OWN_CHAIN}
    card = project.folder / "reports/bands" / OWN
    files = contents(card)
    yaml.dump(content, lock)
    shutil.rmtree(project.folder / ".dvc/cache/runs")
    for entry in before.values():
        for out in entry["outs"]:
            path = project.folder / out["path"]
            shutil.rmtree(path) if path.is_dir() else path.unlink()
    run = MarkedRun(project.folder, **project.environment)
    for stage in ("density", "policy", "card"):
        dvc = run.start("dvc", "repro", f"own_card@{OWN}")
        until(lambda: run.named(f"stages.{stage}") or dvc.poll() is not None)  # noqa: B023
        time.sleep(0.5)  # it is at work
        assert dvc.poll() is None, run.message
        os.killpg(dvc.pid, signal.SIGKILL)
        dvc.wait()
        assert run.left() == []
    assert f"own_card@{OWN}" in project.dvc("repro", f"own_card@{OWN}")
    stages = yaml.load(lock)["stages"]
    assert {name: stages[name] for name in OWN_CHAIN} == before
    assert contents(card) == files
    assert not [*project.folder.glob("data/**/*.tmp"), *project.folder.glob("reports/**/*.tmp")]


class Change(NamedTuple):
    """An edit of keys of params.yaml, or a text appended to a file.

    Attributes:
        at_once: Stages that read what is edited.
        then: Those that read what these make, and so on.
    """

    edit: dict[str, object] | tuple[str, str]
    at_once: set[str]
    then: set[str] = set()

    @property
    def edited(self) -> list[str]:
        """Keys with dots, or the file."""
        return [*self.edit] if isinstance(self.edit, dict) else [self.edit[0]]

    def file(self, copy: Copy) -> Path:
        return copy.folder / ("params.yaml" if isinstance(self.edit, dict) else self.edit[0])

    def make(self, copy: Copy) -> None:
        if isinstance(self.edit, dict):
            copy.set(self.edit)
        else:
            with self.file(copy).open("a", encoding="utf-8") as file:
                file.write(self.edit[1])

    def makes_stale(self, reasons: Iterable[str]) -> bool:
        """Whether reasons, which `dvc status` gives, are about what is edited."""
        parts = [re.split("[./]", reason) for reason in reasons]
        keys = [re.split("[./]", key) for key in self.edited]
        return any(key[: len(part)] == part for part in parts for key in keys)


def after_clusters(edit: dict[str, object]) -> Change:
    clusters = of_method(PAPER, "clusters") - of_method(PAPER, "cma")
    return Change(edit, {*clusters, "report"}, of_method(PAPER, "cma"))


CARDS = {*of_band("card"), *of_band("card", band=OWN)}
EVIDENCE = {*of_band("evidence"), *of_band("evidence", band=OWN)}
SHOWN = {*CARDS, "report"}
LAUNCHED = {  # from where launches are planned on
    *(stage for method in SEARCH for stage in of_method(method, "policy")),
    *of_method(OURS, "policy", OWN),
}
ON_THE_RIG = {stage for stage in LAUNCHED if "launches" in stage}
TRIALS = {stage for stage in LAUNCHED if "trials" in stage}
BY_EVIDENCE = {stage for band in ("band1", OWN) for stage in of_method(OURS, "density", band)}
CHANGES = {
    "optimizer.k_top": after_clusters({"optimizer.k_top": 1}),
    "optimizer.k_nn": after_clusters({"optimizer.k_nn": 7}),
    "optimizer.delta": after_clusters({"optimizer.delta": 0.11}),
    "optimizer.cma_population": Change(
        {"optimizer.cma_population": 5},
        {"cma@band1-sling2sim2real", "report"},
        of_method(PAPER, "theta"),
    ),
    "optimizer.cma_rollouts": Change(
        {"optimizer.cma_rollouts": 10},
        {"cma@band1-sling2sim2real", "ablation_bo@band1-bo", "report"},
        {*of_method(PAPER, "theta"), *of_method("bo", "theta")},
    ),
    "optimizer.generations": Change(
        {"optimizer.generations": 3},
        {
            *(f"history@band1-{method}" for method in METHODS),
            f"own_history@{OWN}-{OURS}",
            "ablation_bo@band1-bo",
            "report",
        },
        {
            *of_method(OURS, "density"),
            *of_method(OURS, "density", OWN),
            *of_method(PAPER, "clusters"),
            *of_method("bo", "theta"),
            *CARDS,
        },
    ),
    "setup.projectile_mass": Change(
        {"setup.projectile_mass": 0.040},
        {*EVIDENCE, *LAUNCHED, *of_band("floor"), *SHOWN},
        BY_EVIDENCE - LAUNCHED,
    ),
    "setup.arm_stiffness": Change(
        {"setup.arm_stiffness": 11000.0},
        {*EVIDENCE, *(LAUNCHED - ON_THE_RIG), *SHOWN},
        (BY_EVIDENCE - LAUNCHED) | ON_THE_RIG,
    ),
    "evidence of band1": Change(
        ("data/evidence/band1.csv", LAUNCH.splitlines()[1].replace("2.0", "2.01") + "\n"),
        EVIDENCE,
        {*BY_EVIDENCE, *TRIALS, *SHOWN},
    ),
    "measured landings of a band": Change(
        (f"data/trials/measured/{OWN}.csv", LAUNCH),
        {*EVIDENCE, "report"},
        {*BY_EVIDENCE, *TRIALS, *CARDS},
    ),
    "a size of a band": Change({f"bands.{OWN}.mass": 0.024}, {*(OWN_CHAIN - EVIDENCE), "report"}),
    "rig.bands.band1": Change(
        {"rig.bands.band1.viscosity": 0.0013},
        {*of_band("record", "floor"), *ON_THE_RIG},
        EVERYTHING - OWN_CHAIN - EVIDENCE - of_band("record", "floor") - ON_THE_RIG,
    ),
    "the Bayesian optimiser": Change(
        ("sling2sim2real/identification/searches/bayesian.py", "# edited\n"),
        {"ablation_bo@band1-bo"},
        {*of_method("bo", "theta"), "report"},
    ),
    "a chapter of the report": Change(
        ("pipeline/report/chapters/appendix.py", "# edited\n"), {"report"}
    ),
    "a part of the card": Change(("sling2sim2real/card/text.py", "# edited\n"), CARDS),
}


@pytest.fixture(scope="module")
def reasons(project: Copy) -> dict[str, list[str]]:
    """By stage what has changed of what it reads, where all changes are made; they are taken back.

    A stage lists a key, or a section, a file or a folder with it: each reason tells of its edit.
    """
    files = {change.file(project) for change in CHANGES.values()}
    before = {file: file.read_bytes() for file in files if file.exists()}
    for change in CHANGES.values():
        change.make(project)
    status = project.status()
    for file in files:
        file.write_bytes(before[file]) if file in before else file.unlink()
    return status


@pytest.mark.parametrize("name", CHANGES)
def test_a_change_makes_stale_what_depends_on_it(
    project: Copy, reasons: dict[str, list[str]], name: str
) -> None:
    """At once what reads what has changed, then what may run after that, by DVC's graph."""
    change = CHANGES[name]
    at_once = {stage for stage, changes in reasons.items() if change.makes_stale(changes)}
    assert at_once == change.at_once
    assert project.after(at_once) - at_once == change.then


def test_a_band_of_ones_own_has_a_chain_by_the_first_method(project: Copy) -> None:
    card = f"own_card@{OWN}"
    assert {card, *networkx.ancestors(project.graph, card)} == OWN_CHAIN


def test_launches_of_one_band_run_nothing_of_another(project: Copy) -> None:
    """The stage that reads them runs for every band, and writes the same for the others."""
    for name in ("evidence of band1", "measured landings of a band"):
        CHANGES[name].make(project)
    assert project.dvc("repro", "--no-run-cache", *EVIDENCE) == EVIDENCE
    others = {f"density@band1-{OURS}", f"own_trials@{OWN}-{OURS}", "report"}
    assert project.status().keys() == others
    # What a lab launches with is of evidence alone.
    files = [project.folder / f"data/launches/{band}/observed.json" for band in ("band1", OWN)]
    before = [file.read_bytes() for file in files]
    for name in ("setup.projectile_mass", "setup.arm_stiffness"):
        CHANGES[name].make(project)
    for band in ("band1", OWN):
        project("sh", "stages/run.sh", "evidence", band)
    same = [file.read_bytes() == content for file, content in zip(files, before, strict=True)]
    assert same == [False, True]
