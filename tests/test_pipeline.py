"""The whole DAG on a tiny budget, in a copy of the project: what runs, and what runs again."""

import json
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
from ruamel.yaml import YAML

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
        self.write("data/evidence/band1.csv", LAUNCH)
        self.commit()

    def write(self, name: str, text: str) -> None:
        (self.folder / name).write_text(text, encoding="utf-8")

    def append(self, name: str, text: str) -> None:
        self.write(name, (self.folder / name).read_text(encoding="utf-8") + text)


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
    keys -= {"run.rig", "run.steps", "run.ablations"}  # read by dvc.yaml itself
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


def test_a_variation_of_k_top_keeps_the_history(project: Copy) -> None:
    project.commit()
    theta = "theta@band1-sling2sim2real"
    ran = project.dvc("exp", "run", "-S", "optimizer.k_top=1", theta)
    assert ran == {"clusters@band1-sling2sim2real", "cma@band1-sling2sim2real", theta}
    content = YAML(typ="safe").load(project.folder / "params.yaml")
    assert content["optimizer"]["k_top"] == 1
    project.dvc("repro")


PAPER, OURS = "sling2sim2real", "least_squares"
AFTER_A_LAUNCH = {  # whatever launches, or predicts a launch
    *(stage for method in (*METHODS, "de", "bo") for stage in of_method(method, first="policy")),
    *of_bands("floor", "card"),
    "report",
}
# What is changed; the stages that must run; those that may besides, as far as outputs change.
CHANGES: dict[str, tuple[Callable[[Copy], None], set[str], set[str]]] = {
    "optimizer.k_top": (
        lambda copy: copy.set({"optimizer.k_top": 2}),
        of_method(PAPER, first="clusters") - of_method(PAPER, first="theta"),
        {*of_method(PAPER, first="theta"), "report"},
    ),
    "optimizer.k_nn": (
        lambda copy: copy.set({"optimizer.k_nn": 7}),
        of_method(PAPER, first="clusters") - of_method(PAPER, first="cma"),
        {*of_method(PAPER, first="cma"), "report"},
    ),
    "optimizer.delta": (
        lambda copy: copy.set({"optimizer.delta": 0.11}),
        of_method(PAPER, first="clusters") - of_method(PAPER, first="cma"),
        {*of_method(PAPER, first="cma"), "report"},
    ),
    "optimizer.cma_population": (
        lambda copy: copy.set({"optimizer.cma_population": 5, "optimizer.cma_rollouts": 10}),
        {
            *(of_method(PAPER, first="cma") - of_method(PAPER, first="theta")),
            "ablation_de@band1-de",
            "ablation_bo@band1-bo",
            "report",
        },
        {stage for one in (PAPER, "de", "bo") for stage in of_method(one, first="theta")},
    ),
    "setup.projectile_mass": (
        lambda copy: copy.set({"setup.projectile_mass": 0.040}),
        {*AFTER_A_LAUNCH, *of_bands("evidence"), "density@band1-least_squares"},
        of_method(OURS, ["band1"], first="theta"),
    ),
    "setup.arm_stiffness": (
        lambda copy: copy.set({"setup.arm_stiffness": 11000.0}),
        {
            *(AFTER_A_LAUNCH - of_bands("floor")),
            *of_bands("evidence"),
            "density@band1-least_squares",
        },
        of_method(OURS, ["band1"], first="theta"),
    ),
    "evidence of band1": (
        lambda copy: copy.write("data/evidence/band1.csv", LAUNCH.replace("2.0", "2.01")),
        {*of_bands("evidence"), "density@band1-least_squares"},
        {*of_method(OURS, ["band1"], first="theta"), "card@band1", "report"},
    ),
    "measured landings of band2": (
        lambda copy: copy.write("data/trials/measured/band2.csv", LAUNCH),
        {
            *of_bands("evidence"),
            *(f"trials@band2-{method}" for method in METHODS),
            "card@band2",
            "report",
        },
        set(),
    ),
    "rig.bands.band2": (
        lambda copy: copy.set({"rig.bands.band2.viscosity": 0.0013}),
        {
            *(EVERYTHING & {f"{step}@band2" for step in ("record", "episode", "floor")}),
            "report",
        },
        {stage for stage in EVERYTHING if "@band2" in stage},
    ),
    "the Bayesian optimiser": (
        lambda copy: copy.append("pipeline/identify/optimizers/bo/bayes.py", "# edited\n"),
        {"ablation_bo@band1-bo"},
        {*of_method("bo", first="theta"), "report"},
    ),
    "a chapter of the report": (
        lambda copy: copy.append("pipeline/report/run/chapters/appendix.py", "# edited\n"),
        {"report"},
        set(),
    ),
}


@pytest.mark.parametrize("change", CHANGES)
def test_a_change_runs_what_depends_on_it(project: Copy, change: str) -> None:
    make, must, may = CHANGES[change]
    make(project)
    ran = project.dvc("repro", "--no-run-cache")  # a value of before is run, not recalled
    assert must <= ran <= must | may, (sorted(must - ran), sorted(ran - must - may))
