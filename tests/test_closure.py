"""dvc.yaml lists exactly the code that each stage runs, and the folders keep their distance."""

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from pipeline.band_folder import KEPT
from sling2sim2real.base import code as of_project
from sling2sim2real.base.code import CODE, NESTED, ROOT, UNTRACKED, closure
from sling2sim2real.settings.identification import OWN, SEARCHES
from tests.project import write_files
from tools.closure import BY_NAME, folders, script_of, stages

STAGES = stages()
HIDDEN = "rig/"
MAY_SEE_THE_RIG = {
    "stages/record.py",
    "stages/floor.py",
    "stages/trials.py",
}
ORACLE = "rig/oracle/"
PROOF = "validation/campaigns/"  # which holds what was identified against the truth
MAY_ASK_THE_ORACLE = ("stages/floor.py", ORACLE, PROOF)


imports = cache(of_project.imports)


@pytest.fixture(scope="module", autouse=True)
def each_file_is_read_once() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(of_project, "imports", imports)
        yield


@cache
def code() -> list[Path]:
    return sorted(file for top in CODE for file in (ROOT / top).rglob("*.py"))


def relative(file: Path) -> str:
    return file.relative_to(ROOT).as_posix()


def test_stages_list_the_folders_that_they_run() -> None:
    for name, stage in STAGES.items():
        listed = [dep for dep in stage["deps"] if dep.startswith(CODE)]
        code = {*folders(script_of(stage)), *filter(None, [BY_NAME.get(name)])}
        assert {*listed} == code, f"{name}: `python tools/closure.py` says what differs"
        assert len(listed) <= 14


def test_a_bands_folder_keeps_settings_that_its_stage_depends_on() -> None:
    assert {*KEPT} <= {*STAGES["card"]["params"]}


def test_what_a_run_may_leave_empty_is_in_git() -> None:
    """DVC refuses to report where a folder that it reads is not there."""
    for name in ("clusters", "floor"):  # no multistart, no band of the rig
        assert f"data/{name}" in STAGES["report"]["deps"]
        assert (ROOT / "data" / name / ".gitkeep").is_file(), name


def test_each_search_of_ours_has_its_own_code_as_a_dependency() -> None:
    for search in (*SEARCHES[2:], OWN):
        assert (ROOT / BY_NAME["search"].replace("${item.search}", search)).is_file(), search


def test_every_script_is_a_stage() -> None:
    scripts = {*(ROOT / "stages").glob("[a-z]*.py")} - {ROOT / path for path in UNTRACKED}
    assert scripts == {script_of(stage) for stage in STAGES.values()}


def test_the_rig_stays_hidden() -> None:
    for file in code():
        name = relative(file)
        if name in MAY_SEE_THE_RIG or name.startswith((HIDDEN, PROOF)):
            continue
        seen = [relative(other) for other in imports(file) if relative(other).startswith(HIDDEN)]
        assert not seen, f"{name} imports {seen[0]}"
        assert not re.search(r"\bparams\.rig\b", file.read_text()), f"{name} reads params.rig"


def test_the_oracle_feeds_no_method() -> None:
    for file in code():
        name = relative(file)
        seen = [relative(other) for other in imports(file) if relative(other).startswith(ORACLE)]
        assert not seen or name.startswith(MAY_ASK_THE_ORACLE), f"{name} imports {seen[0]}"
    for stage in ("history", "cma", "posterior", "search", "theta", "policy", "trials"):
        reached = closure(ROOT / "stages" / f"{stage}.py")
        assert not any(other.startswith(ORACLE) for other in reached), stage


def test_nothing_imports_the_tests() -> None:
    """What tests and campaigns share lies in validation/, which is packaged; tests/ is not."""
    for file in [*code(), *(ROOT / "tools").glob("*.py"), *(ROOT / "examples").glob("*.py")]:
        text = file.read_text(encoding="utf-8")
        assert not re.search(r"^\s*(from|import) tests\b", text, re.MULTILINE), relative(file)


def test_a_folder_of_folders_holds_no_code() -> None:
    """It is no dependency of a stage, so nothing may depend on it."""
    for name in (f"{folder}__init__.py" for folder in NESTED if folder != "sling2sim2real/"):
        module = ast.parse((ROOT / name).read_text())
        assert len(module.body) == 1 and ast.get_docstring(module), name


def test_closure_follows_every_form_of_import(tmp_path: Path) -> None:
    files = {
        "stages/s.py": "import json\nimport pipeline.a.one\n",
        "pipeline/__init__.py": "",
        "pipeline/a/__init__.py": "from .two import thing\n",
        "pipeline/a/one.py": "def f():\n    from pipeline import b, missing\n",
        "pipeline/a/two.py": "from ..c import deep as d\nfrom . import three\nthing = 1\n",
        "pipeline/a/three.py": "from pipeline.c.deep import value\n",
        "pipeline/a/unused.py": "",
        "pipeline/a/native.h": "",
        "pipeline/b.py": "import pipeline.a.one\n",
        "pipeline/c/__init__.py": "",
        "pipeline/c/deep.py": "value = 1\n",
        "pipeline/e/__init__.py": "",
        "pipeline/e/other.cpp": "",
    }
    write_files(tmp_path, files)
    expected = set(files) - {
        "pipeline/a/unused.py",
        "pipeline/e/__init__.py",
        "pipeline/e/other.cpp",
    }
    assert set(closure(tmp_path / "stages/s.py", tmp_path)) == expected
    assert folders(tmp_path / "stages/s.py", tmp_path) == [
        "pipeline/a",
        "pipeline/b.py",
        "pipeline/c",
        "stages/s.py",
    ]
