"""dvc.yaml lists exactly the code that each stage imports, and the folders keep their distance.

DVC runs a stage again when something that it lists changes; it sees no imports. A stage lists the
folder of each module that its script imports at any depth, inside functions too: a folder is one
concern. UNTRACKED is nobody's dependency: dvc.yaml has the keys of params.yaml and spells the paths
itself. Searches are found by name, and their files are listed by hand.
"""

import ast
import re

import grimp
import pytest

from pipeline.band_folder import KEPT
from sling2sim2real.settings.identification import OWN, SEARCHES
from tests.project import ROOT, STAGES

PACKAGES = ("pipeline", "rig", "sling2sim2real", "stages", "validation")
GRAPH = grimp.build_graph(*PACKAGES, exclude_type_checking_imports=True, cache_dir=None)
UNTRACKED = ("sling2sim2real.settings", "pipeline.params", "pipeline.layout", "stages.start")
IDENTIFICATION = "sling2sim2real.identification"
NESTED = {*PACKAGES, IDENTIFICATION, f"{IDENTIFICATION}.searches"}  # packages of concerns
SEARCH = "sling2sim2real/identification/searches/{}.py"
BY_NAME = {"history": SEARCH.format("de"), "search": SEARCH.format("${item.search}")}
RIG_SEEN_BY = ("rig.", "stages.record", "stages.floor", "stages.trials", "validation.campaigns.")
ORACLE_SEEN_BY = ("rig.oracle.", "stages.floor", "validation.campaigns.")


def parents(module: str) -> list[str]:
    """A module and its packages, the outermost first."""
    parts = module.split(".")
    return [".".join(parts[:n]) for n in range(1, len(parts) + 1)]


def concerns(script: str) -> set[str]:
    """Folders and files of the code that a script runs, itself among them."""
    seen: set[str] = set()
    queue = {script}
    while queue:
        seen.add(module := queue.pop())
        if not {*parents(module)} & {*UNTRACKED}:
            queue |= {*parents(module), *GRAPH.find_modules_directly_imported_by(module)} - seen
    tracked = [parents(module) for module in seen - NESTED if not {*parents(module)} & {*UNTRACKED}]
    paths = [next(x for x in packages if x not in NESTED).replace(".", "/") for packages in tracked]
    return {path if (ROOT / path).is_dir() else f"{path}.py" for path in paths}


@pytest.mark.parametrize("name", STAGES)
def test_a_stage_lists_the_code_that_it_runs(name: str) -> None:
    listed = {dep for dep in STAGES[name]["deps"] if dep.startswith(PACKAGES)}
    assert listed == {*concerns(f"stages.{name}"), *filter(None, [BY_NAME.get(name)])}
    assert STAGES[name]["cmd"].startswith(f"sh stages/run.sh {name}")


def test_every_script_is_a_stage_and_every_search_a_file() -> None:
    scripts = {module for module in GRAPH.modules if module.startswith("stages.")}
    assert scripts == {"stages.start", *(f"stages.{name}" for name in STAGES)}
    assert all((ROOT / SEARCH.format(name)).is_file() for name in (*[*SEARCHES][2:], OWN))


def test_a_bands_folder_keeps_settings_that_its_stage_depends_on() -> None:
    assert {*KEPT} <= {*STAGES["card"]["params"]}


def test_what_a_run_may_leave_empty_is_in_git() -> None:
    """DVC refuses to report where a folder that it reads is not there."""
    for name in ("clusters", "floor"):  # no multistart, no band of the rig
        assert f"data/{name}" in STAGES["report"]["deps"]
        assert (ROOT / "data" / name / ".gitkeep").is_file(), name


@pytest.mark.parametrize(
    ("hidden", "seen_by"), [("rig", RIG_SEEN_BY), ("rig.oracle", ORACLE_SEEN_BY)]
)
def test_the_rig_stays_hidden_and_its_oracle_feeds_no_method(hidden: str, seen_by: tuple) -> None:
    for module in {hidden, *GRAPH.find_descendants(hidden)}:
        importers = GRAPH.find_modules_that_directly_import(module)
        assert not [name for name in importers if not f"{name}.".startswith(seen_by)], module
    for file in (file for top in PACKAGES for file in (ROOT / top).rglob("*.py")):
        name = ".".join(file.relative_to(ROOT).with_suffix("").parts)
        assert name.startswith(RIG_SEEN_BY) or not re.search(r"\bparams\.rig\b", file.read_text())


def test_nothing_imports_the_tests() -> None:
    """What tests and campaigns share lies in validation/, which is packaged; tests/ is not."""
    for file in (
        file for top in (*PACKAGES, "tools", "examples") for file in ROOT.glob(f"{top}/**/*.py")
    ):
        assert not re.search(r"^\s*(from|import) tests\b", file.read_text(), re.MULTILINE), file


def test_a_package_of_concerns_holds_no_code() -> None:
    """It is no dependency of a stage, so nothing may depend on it."""
    for name in NESTED - {"sling2sim2real", "stages"}:
        module = ast.parse((ROOT / name.replace(".", "/") / "__init__.py").read_text())
        assert len(module.body) == 1 and ast.get_docstring(module), name
