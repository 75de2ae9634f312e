"""The whole DAG on a tiny budget, in a copy of the project: what runs, and what runs again."""

import json
import shutil
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import pytest
from ruamel.yaml import YAML

from app.flow.graph import Stage, stages_of
from tests.project import ROOT
from validation.projects import TINY, ProjectCopy, copy_project, run_of

pytestmark = pytest.mark.slow
METHODS = ["least_squares", "sling2sim2real"]
BANDS = ("band1", "band2")
JUDGED = ("theta", "policy", "launches", "trials")
SEARCH = {"sling2sim2real": ("history", "clusters", "cma"), "least_squares": ("history", "density")}


def of_method(method: str, bands: Sequence[str] = BANDS, first: str = "") -> set[str]:
    """The stages of a method from one step on; of a search of one phase that of its name."""
    if method in SEARCH:
        steps = [*SEARCH[method], *JUDGED]
    else:
        steps, bands = [f"ablation_{step}" for step in (method, *JUDGED)], bands[:1]
    start = next((i for i, step in enumerate(steps) if step.endswith(first)), 0) if first else 0
    return {f"{step}@{band}-{method}" for step in steps[start:] for band in bands}


def of_bands(*steps: str, bands: Sequence[str] = BANDS) -> set[str]:
    return {f"{step}@{band}" for step in steps for band in bands}


EVERYTHING = {
    *of_bands("record", "episode", "clamps", "evidence", "floor", "card"),
    *(stage for method in (*METHODS, "de", "bo") for stage in of_method(method)),
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
        self.set(TINY | run_of(BANDS, METHODS, ("de", "bo")))
        (folder / "data/evidence/band1.csv").write_text(LAUNCH, "utf-8")
        self.commit()

    def stale(self) -> set[str]:
        """Stages whose own inputs have changed since they ran."""
        return set(json.loads(self("dvc", "status", "--json")))

    @cached_property
    def stages(self) -> list[Stage]:
        """Producers first."""
        return [*stages_of(self.folder).values()]

    def after(self, names: Collection[str]) -> set[str]:
        """Stages that read what these make, and so on."""
        found: set[str] = set()
        for stage in self.stages:
            if {*stage.producers} & {*names, *found}:
                found.add(stage.name)
        return found


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Copy:
    copy = Copy(tmp_path_factory.mktemp("project") / "copy")
    assert copy.dvc("repro") == EVERYTHING
    return copy


def test_a_run_leaves_only_its_lock_and_report_for_git(project: Copy) -> None:
    """DVC keeps its hands off .gitignore, and nothing else lies about."""
    changed = {line[3:] for line in project("git", "status", "--porcelain", "-uall").splitlines()}
    assert "dvc.lock" in changed
    assert all(name == "dvc.lock" or name.startswith("reports/") for name in changed)


OF_OTHER_RECORDINGS = {"setup.urdf", "setup.start_pose"}


def covers(listed: str, read: str) -> bool:
    return f"{read}.".startswith(f"{listed}.")


def test_each_stage_lists_the_parameters_that_it_reads(project: Copy) -> None:
    """Neither more, or it would run in vain, nor less, or a change would do nothing."""
    stages = YAML(typ="safe").load(ROOT / "dvc.yaml")["stages"]
    everything_read, idle_keys = set(), {}
    for name in EVERYTHING:
        step, *item = name.removeprefix("ablation_").split("@")
        script = "@".join([stages[step]["cmd"].split()[2].removeprefix("stages."), *item])
        if step == "card":  # of the first method
            script = f"{name}-{METHODS[0]}"
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
        unlisted = [key for key in read if not any(covers(one, key) for one in listed)]
        assert not unlisted, f"{name} reads parameters that dvc.yaml does not list"
        unread = {
            key.replace(method or " ", "${item.method}")
            for key in listed
            if not any(covers(key, one) for one in read)
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
        f"run.{key}" for key in ("rig", "own", "steps", "own_steps", "ablations")
    }  # dvc.yaml's
    keys -= {key for key in keys if key.startswith("plan.")}  # read by `sling plan` alone
    keys -= {f"bands.{name}" for name in content["bands"]} - {"bands.band1"}  # those that run
    # read for other recordings, or with another mask: tests/recording shows what they do
    keys -= {*OF_OTHER_RECORDINGS, "cloud.sam3"}
    idle = {key for key in keys if not any(covers(key, read) for read in everything_read)}
    assert not idle, "parameters that do nothing"


def test_the_python_of_the_readme_runs(project: Copy) -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    said = project("python", "-c", text.split("```python\n")[1].split("```")[0]).splitlines()
    assert " Pa, nine of ten from " in said[0]
    assert float(said[1]) > 0 and len(said[2].strip("()").split(",")) == 2


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
    shutil.rmtree(project.folder / ".checkpoints", ignore_errors=True)
    ran = project.dvc(
        "repro",
        "--force",
        "--no-run-cache",
        "--downstream",
        "history@band1-sling2sim2real",  # of one phase: tests/identify/objective/test_cache.py
    )
    assert ran == {*of_method("sling2sim2real", ["band1"]), "report"}
    assert (project.folder / "dvc.lock").read_text() == before
    for file, content in reports.items():
        assert file.read_bytes() == content, file


PAPER, OURS = "sling2sim2real", "least_squares"
AFTER_A_LAUNCH = {  # whatever launches, or predicts a launch
    *(stage for method in (*METHODS, "de", "bo") for stage in of_method(method, first="policy")),
    *of_bands("floor", "card"),
    "report",
}


class Change(NamedTuple):
    """An edit of one file, or of keys of params.yaml.

    Attributes:
        must: Stages that run after it.
        may: Those that may besides, as far as outputs change.
    """

    edit: dict[str, object] | tuple[str, str]
    must: set[str]
    may: set[str]

    def file(self, copy: Copy) -> Path:
        return copy.folder / ("params.yaml" if isinstance(self.edit, dict) else self.edit[0])

    def make(self, copy: Copy) -> None:
        """In a copy of the project; a pair is a file and what is appended to it."""
        if isinstance(self.edit, dict):
            copy.set(self.edit)
        else:
            file = self.file(copy)
            text = file.read_text("utf-8") if file.exists() else ""
            file.write_text(text + self.edit[1], "utf-8")

    @contextmanager
    def made(self, copy: Copy) -> Iterator[None]:
        """For the block alone."""
        file = self.file(copy)
        before = file.read_bytes() if file.exists() else None
        self.make(copy)
        yield
        file.unlink() if before is None else file.write_bytes(before)


CHANGES = {
    "optimizer.k_top": Change(
        {"optimizer.k_top": 1},
        of_method(PAPER, first="clusters") - of_method(PAPER, first="theta"),
        {*of_method(PAPER, first="theta"), "report"},
    ),
    "optimizer.k_nn": Change(
        {"optimizer.k_nn": 7},
        of_method(PAPER, first="clusters") - of_method(PAPER, first="cma"),
        {*of_method(PAPER, first="cma"), "report"},
    ),
    "optimizer.delta": Change(
        {"optimizer.delta": 0.11},
        of_method(PAPER, first="clusters") - of_method(PAPER, first="cma"),
        {*of_method(PAPER, first="cma"), "report"},
    ),
    "optimizer.cma_population": Change(
        {"optimizer.cma_population": 5, "optimizer.cma_rollouts": 10},
        {
            *(of_method(PAPER, first="cma") - of_method(PAPER, first="theta")),
            "ablation_de@band1-de",
            "ablation_bo@band1-bo",
            "report",
        },
        {stage for one in (PAPER, "de", "bo") for stage in of_method(one, first="theta")},
    ),
    "setup.projectile_mass": Change(
        {"setup.projectile_mass": 0.040},
        {*AFTER_A_LAUNCH, *of_bands("evidence"), "density@band1-least_squares"},
        of_method(OURS, ["band1"], first="theta"),
    ),
    "setup.arm_stiffness": Change(
        {"setup.arm_stiffness": 11000.0},
        {
            *(AFTER_A_LAUNCH - of_bands("floor")),
            *of_bands("evidence"),
            "density@band1-least_squares",
        },
        of_method(OURS, ["band1"], first="theta"),
    ),
    "evidence of band1": Change(
        ("data/evidence/band1.csv", LAUNCH.splitlines()[1].replace("2.0", "2.01") + "\n"),
        {*of_bands("evidence"), "density@band1-least_squares"},
        {*of_method(OURS, ["band1"], first="theta"), "card@band1", "report"},
    ),
    "measured landings of band2": Change(
        ("data/trials/measured/band2.csv", LAUNCH),
        {
            *of_bands("evidence"),
            *(f"trials@band2-{method}" for method in METHODS),
            "card@band2",
            "report",
        },
        set(),
    ),
    "rig.bands.band2": Change(
        {"rig.bands.band2.viscosity": 0.0013},
        {
            *(EVERYTHING & {f"{step}@band2" for step in ("record", "episode", "floor")}),
            "report",
        },
        {stage for stage in EVERYTHING if "@band2" in stage},
    ),
    "the Bayesian optimiser": Change(
        ("pipeline/identify/optimizers/bo/bayes.py", "# edited\n"),
        {"ablation_bo@band1-bo"},
        {*of_method("bo", first="theta"), "report"},
    ),
    "a chapter of the report": Change(
        ("pipeline/report/run/chapters/appendix.py", "# edited\n"),
        {"report"},
        set(),
    ),
}
# Stages that read what a folder has for every band, and write the same for another band.
OF_OTHER_BANDS = {
    "evidence of band1": {"evidence@band2"},
    "measured landings of band2": {"evidence@band1"},
    "setup.projectile_mass": {"evidence@band2"},  # without launches
    "setup.arm_stiffness": {"evidence@band2"},
}


@pytest.mark.parametrize("name", CHANGES)
def test_a_change_makes_stale_what_depends_on_it(project: Copy, name: str) -> None:
    """At once what reads what has changed, then what may run after that, by DVC's graph."""
    change = CHANGES[name]
    with change.made(project):
        stale = project.stale()
    after = stale | project.after(stale)
    allowed = change.must | change.may | OF_OTHER_BANDS.get(name, set())
    assert change.must <= after, sorted(change.must - after)
    assert stale <= allowed, sorted(stale - allowed)
    if name not in OF_OTHER_BANDS:
        assert after <= allowed, sorted(after - allowed)


def test_a_variation_of_k_top_keeps_the_history(project: Copy) -> None:
    project.commit()
    theta = "theta@band1-sling2sim2real"
    ran = project.dvc("exp", "run", "-S", "optimizer.k_top=1", theta)
    assert ran == {"clusters@band1-sling2sim2real", "cma@band1-sling2sim2real", theta}
    content = YAML(typ="safe").load(project.folder / "params.yaml")
    assert content["optimizer"]["k_top"] == 1


# Changes that one run may show together: where one must not run a stage, none of the others may.
TOGETHER = (
    ("optimizer.k_top", "optimizer.k_nn", "optimizer.delta", "optimizer.cma_population",
     "setup.projectile_mass", "setup.arm_stiffness"),
    ("evidence of band1", "measured landings of band2", "the Bayesian optimiser",
     "a chapter of the report"),
)  # fmt: skip


@pytest.mark.parametrize("names", TOGETHER, ids=lambda names: names[0])
def test_changes_run_what_depends_on_them(project: Copy, names: tuple[str, ...]) -> None:
    changes = [CHANGES[name] for name in names]
    for change in changes:
        change.make(project)
    must, may = (set().union(*sets) for sets in zip(*(one[1:] for one in changes), strict=True))
    ran = project.dvc("repro", "--no-run-cache")  # a value of before is run, not recalled
    assert must <= ran <= must | may, (sorted(must - ran), sorted(ran - must - may))


def test_a_band_of_the_rig_is_recorded_anew(project: Copy) -> None:
    """What follows depends on its episode."""
    CHANGES["rig.bands.band2"].make(project)
    ran = project.dvc("repro", "--no-run-cache", "episode@band2")
    assert ran == {"record@band2", "episode@band2"}
    stale = project.stale()
    assert {f"{step}@band2" for step in ("clamps", "floor")} <= stale
    assert not any("@band1" in stage for stage in stale), sorted(stale)


def test_a_band_of_ones_own_has_a_chain_by_the_first_method(project: Copy) -> None:
    recording = project.folder / "data/raw/mine/mine.mcap"
    recording.parent.mkdir()
    shutil.copy(project.folder / "data/raw/band1/band1.mcap", recording)
    band = {"source": "recording", "mass": 0.023, "diameter": 0.010, "rest_length": 0.52}
    project.set({"run.own": ["mine"], "bands.mine": band})
    alone = {f"own_{step}@mine" for step in ("episode", "clamps", "evidence", "card")}
    by_method = (*SEARCH[METHODS[0]], "theta", "policy", "trials")
    chain = alone | {f"own_{step}@mine-{METHODS[0]}" for step in by_method}
    assert project.dvc("repro", "own_card@mine") == chain
    project.set({"bands.mine.mass": 0.024})
    assert project.dvc("repro", "own_card@mine") == chain - {"own_evidence@mine"}
