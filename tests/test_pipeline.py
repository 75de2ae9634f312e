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
from sling2sim2real.base.launches_file import write_launches
from tests.project import BAND, ROOT, STAGES, contents, until
from validation.projects import TINY, MarkedRun, ProjectCopy, copy_project, run_of

pytestmark = pytest.mark.slow
METHODS = ["posterior", "paper", "bo"]
OURS, PAPER, BO = METHODS
MINE = "mine"  # a band of the user's own, by the main method
SEARCH = {
    OURS: ["history", "posterior"],
    PAPER: ["history", "clusters", "cma"],
    BO: ["search"],
}
FOLDER = "reports/bands/band1"
LAUNCH = "-0.3,-0.17,,2.0,fit\n"


def of_pair(recording: str, method: str, first: str = "") -> set[str]:
    """Stages of a method on a recording, from one step on."""
    steps = [*SEARCH[method], "theta", "policy", "trials"]
    return {f"{step}@{recording}-{method}" for step in steps[steps.index(first or steps[0]) :]}


def of(name: str, *steps: str) -> set[str]:
    return {f"{step}@{name}" for step in steps}


def both(first: str) -> set[str]:
    """Stages of the main method on both bands, from one step on."""
    return of_pair("band1", OURS, first) | of_pair(MINE, OURS, first)


OF_MINE = {*of(MINE, "episode", "clamps", "card"), *of_pair(MINE, OURS)}
EVERYTHING = {
    *of("band1", "record", "episode", "clamps", "floor", "card"),
    *(stage for method in METHODS for stage in of_pair("band1", method)),
    *OF_MINE,
    "report",
}


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
        run = run_of({"band1": METHODS, MINE: [OURS]})["run"]
        run |= {"floors": ["band1"], "rig": {"band1": run["recordings"]["band1"]}}
        self.set(
            TINY
            | {"run": run, f"bands.{MINE}": BAND | {"mass": 0.023}}
            | {f"rig.bands.{MINE}": None}
        )
        for band in ("band1", MINE):
            write_launches(folder / "data/launches" / f"{band}.csv", [])
        with (folder / "data/launches/band1.csv").open("a", encoding="utf-8") as file:
            file.write(LAUNCH)
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
    recorded = of("band1", "record")
    assert copy.dvc("repro", *recorded) == recorded
    recording = copy.folder / f"data/raw/{MINE}/plain/mine.mcap"
    recording.parent.mkdir(parents=True)
    shutil.copy(copy.folder / "data/raw/band1/plain/band1.mcap", recording)
    assert copy.dvc("repro") == EVERYTHING - recorded
    return copy


def test_a_run_leaves_only_its_lock_and_report_for_git(project: Copy) -> None:
    """DVC keeps its hands off .gitignore, and nothing else lies about."""
    changed = {line[3:] for line in project("git", "status", "--porcelain", "-uall").splitlines()}
    assert "dvc.lock" in changed
    assert all(name == "dvc.lock" or name.startswith("reports/") for name in changed)


def _filled(place: str, marks: dict[str, str]) -> str:
    for mark, value in marks.items():
        place = place.replace(mark, value)
    return place


def covers(listed: str, read: str) -> bool:
    return f"{read}.".startswith(f"{listed}.")


def test_each_stage_lists_the_parameters_that_it_reads(project: Copy) -> None:
    """Neither more, or it would run in vain, nor less, or a change would do nothing."""
    everything_read, idle_keys = set(), {}
    run = YAML(typ="safe").load(project.folder / "params.yaml")["run"]
    for name in EVERYTHING:
        step, _, key = name.partition("@")
        item = run["pairs"].get(key) or run["recordings"].get(key, {})
        marks = {f"${{item.{field}}}": value for field, value in item.items()}
        marks |= {"${item}": key, "${run.main}": OURS}
        listed = [_filled(place, marks) for place in STAGES[step].get("params", [])]
        notes = list((project.folder.parent / "audit").glob(f"{name}.*.json"))
        assert notes, f"{name} left no note of what it read"
        read = {key for note in notes for key in json.loads(note.read_text())} - {"run"}
        if step != "report":  # which of them it is for, its command says
            read = {key for key in read if not key.startswith("run.")}
        if step == "card":  # the library loads its settings by itself
            read |= set(listed)
        unlisted = [key for key in read if not any(covers(prefix, key) for prefix in listed)]
        assert not unlisted, f"{name} reads parameters that dvc.yaml does not list"
        unread = {
            place
            for place in STAGES[step].get("params", [])
            if not any(covers(_filled(place, marks), read_key) for read_key in read)
        }
        # Pairs share a list: what none of them reads is idle. Some is of other recordings, of a
        # band without clamps, of another optimiser.
        unread -= {"setup.urdf", "setup.clamp_direction", "optimizer.mutation"}
        unread -= {"optimizer.recombination", "run.rig"}
        idle_keys[step] = idle_keys.get(step, unread) & unread
        everything_read.update(read)
    assert not any(idle_keys.values()), f"dvc.yaml lists what no method reads: {idle_keys}"
    content = YAML(typ="safe").load(project.folder / "params.yaml")
    keys = {f"{section}.{key}" for section, value in content.items() for key in value}
    ours = {f"methods.{name}" for name in METHODS}
    keys -= {f"methods.{name}" for name in content["methods"]} - ours
    keys -= {key for key in keys if key.startswith("run.")}  # dvc.yaml's
    keys -= {key for key in keys if key.startswith("plan.")}  # read by `sling plan`, and the rig
    keys -= {f"bands.{name}" for name in content["bands"]} - {"bands.band1"}  # those that run
    # read for other recordings, or with another mask: tests/recording shows what they do
    keys -= {"setup.urdf", "episode.longest"}
    idle = {key for key in keys if not any(covers(key, read) for read in everything_read)}
    assert not idle, "parameters that do nothing"


def test_the_python_of_the_readme_runs(project: Copy) -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    code = text.split("```python\n")[1].split("```")[0]
    code = re.sub(r'Identification\.\w+\("[^"]+"\)', f"Identification.load('{FOLDER}')", code)
    message = project("python", "-c", code).splitlines()
    assert " Pa, 90 % interval " in message[0]
    assert float(message[1]) > 0 and len(message[2].strip("()").split(",")) == 2


def test_a_second_run_does_nothing(project: Copy) -> None:
    assert project.dvc("repro") == set()


def test_the_same_inputs_give_the_same_bytes(project: Copy) -> None:
    """Forced once more from one history on, every recorded hash stays, and the whole report."""
    before = (project.folder / "dvc.lock").read_text()
    reports = {
        file: file.read_bytes()
        for file in (project.folder / "reports").rglob("*")
        if file.is_file()
    }
    ran = project.dvc(
        "repro",
        "--force",
        "--no-run-cache",
        "--downstream",
        "history@band1-paper",  # of one phase: tests/identification/search/test_loop.py
    )
    assert ran == {*of_pair("band1", PAPER), "report"}
    assert (project.folder / "dvc.lock").read_text() == before
    for file, content in reports.items():
        assert file.read_bytes() == content, file


def test_a_run_that_is_killed_goes_on_to_the_same_results(project: Copy) -> None:
    """All its processes at once, as by a power cut, within three of its stages."""
    lock, yaml = project.folder / "dvc.lock", YAML()
    content = yaml.load(lock)
    before = {name: content["stages"].pop(name) for name in OF_MINE}
    card = project.folder / "reports/bands" / MINE
    files = contents(card)
    yaml.dump(content, lock)
    shutil.rmtree(project.folder / ".dvc/cache/runs")
    for entry in before.values():
        for out in entry["outs"]:
            path = project.folder / out["path"]
            shutil.rmtree(path) if path.is_dir() else path.unlink()
    run = MarkedRun(project.folder, **project.environment)
    for stage in ("posterior", "policy", "card"):
        dvc = run.start("dvc", "repro", f"card@{MINE}")
        until(lambda: run.named(f"stages.{stage}") or dvc.poll() is not None)  # noqa: B023
        time.sleep(0.5)  # it is at work
        assert dvc.poll() is None, run.message
        os.killpg(dvc.pid, signal.SIGKILL)
        dvc.wait()
        assert run.left() == []
    assert f"card@{MINE}" in project.dvc("repro", f"card@{MINE}")
    stages = yaml.load(lock)["stages"]
    assert {name: stages[name] for name in OF_MINE} == before
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
    return Change(edit, {*of("band1-paper", "clusters"), "report"}, of_pair("band1", PAPER, "cma"))


CARDS = {*of("band1", "card"), *of(MINE, "card")}
SHOWN = {*CARDS, "report"}
LAUNCHED = {*(s for m in METHODS for s in of_pair("band1", m, "policy")), *both("policy")}
TRIALS = {stage for stage in LAUNCHED if "trials" in stage}
POSTERIORS = {f"posterior@{name}-{OURS}" for name in ("band1", MINE)}
CHANGES = {
    "optimizer.k_top": after_clusters({"optimizer.k_top": 1}),
    "optimizer.k_nn": after_clusters({"optimizer.k_nn": 7}),
    "optimizer.delta": after_clusters({"optimizer.delta": 0.11}),
    "optimizer.cma_population": Change(
        {"optimizer.cma_population": 5},
        {"cma@band1-paper", "report"},
        of_pair("band1", PAPER, "theta"),
    ),
    "optimizer.cma_rollouts": Change(
        {"optimizer.cma_rollouts": 10},
        {"cma@band1-paper", "search@band1-bo", "report"},
        {*of_pair("band1", PAPER, "theta"), *of_pair("band1", BO, "theta")},
    ),
    "optimizer.generations": Change(
        {"optimizer.generations": 3},
        {
            *(f"history@band1-{method}" for method in (OURS, PAPER)),
            f"history@{MINE}-{OURS}",
            "search@band1-bo",
            "report",
        },
        {
            *both("posterior"),
            *of_pair("band1", PAPER, "clusters"),
            *of_pair("band1", BO, "theta"),
            *CARDS,
        },
    ),
    "setup.projectile_mass": Change(
        {"setup.projectile_mass": 0.040},
        {*POSTERIORS, *LAUNCHED, *of("band1", "floor"), *SHOWN},
        both("theta") - LAUNCHED,
    ),
    "setup.arm_stiffness": Change(
        {"setup.arm_stiffness": 11000.0},
        {*POSTERIORS, *LAUNCHED, *SHOWN},
        both("theta") - LAUNCHED,
    ),
    "a launch of band1": Change(
        ("data/launches/band1.csv", LAUNCH.replace("2.0", "2.01")),
        {f"posterior@band1-{OURS}", *(t for t in TRIALS if "band1" in t), "report"},
        {*of_pair("band1", OURS, "theta"), *of("band1", "card")} - TRIALS,
    ),
    "a size of a band": Change(
        {f"bands.{MINE}.mass": 0.024},
        {*(OF_MINE - {f"theta@{MINE}-{OURS}"}), "report"},
        {f"theta@{MINE}-{OURS}"},
    ),
    "rig.bands.band1": Change(
        {"rig.bands.band1.viscosity": 0.0013},
        {*of("band1", "record", "floor"), *(stage for stage in TRIALS if "band1" in stage)},
        EVERYTHING - OF_MINE - of("band1", "record", "floor") - TRIALS,
    ),
    "plan.dips": Change(
        {"plan.dips": [{"at": 0.9, "depth": 0.2, "out_time": 1.0, "back_time": 1.0}]},
        of("band1", "record"),
        EVERYTHING - OF_MINE - of("band1", "record", "floor"),
    ),
    "the Bayesian optimiser": Change(
        ("sling2sim2real/identification/searches/bo.py", "# edited\n"),
        {"search@band1-bo"},
        {*of_pair("band1", BO, "theta"), "report"},
    ),
    "a table of the report": Change(("pipeline/report/tables.py", "# edited\n"), {"report"}),
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


def test_a_card_needs_the_chain_of_the_main_method_alone(project: Copy) -> None:
    card = f"card@{MINE}"
    assert {card, *networkx.ancestors(project.graph, card)} == OF_MINE


def test_launches_to_check_teach_the_posterior_nothing(project: Copy) -> None:
    """Its stage reads them and writes the same, so that what follows of θ does not run."""
    with (project.folder / f"data/launches/{MINE}.csv").open("a", encoding="utf-8") as file:
        file.write("-0.3,-0.17,,2.0,check\n")
    again = {f"posterior@{MINE}-{OURS}", f"trials@{MINE}-{OURS}", f"card@{MINE}"}
    assert project.dvc("repro", f"card@{MINE}") == again
