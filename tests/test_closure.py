"""dvc.yaml lists exactly the code that each stage runs, and the folders keep their distance."""

from __future__ import annotations

import re
from graphlib import TopologicalSorter
from pathlib import Path

import pytest
from ruamel.yaml import YAML

from tools.closure import CODE, ROOT, closure, imports, script_of

STAGES = YAML(typ="safe").load(ROOT / "dvc.yaml")["stages"]
HIDDEN = "pipeline/rig/"
MAY_SEE_THE_RIG = {"stages/record.py", "stages/trials.py", "stages/floor.py"}
MAY_SEE_THE_RIG |= {"pipeline/oracle/world.py"}
ORACLE = "pipeline/oracle/"
MAY_ASK_THE_ORACLE = {"stages/floor.py": ORACLE, "pipeline/report/": "pipeline/oracle/floor.py"}


def code() -> list[Path]:
    return sorted(file for top in CODE for file in (ROOT / top).rglob("*.py"))


def relative(file: Path) -> str:
    return file.relative_to(ROOT).as_posix()


@pytest.mark.parametrize("name", STAGES)
def test_stage_lists_the_code_that_it_runs(name: str) -> None:
    listed = [dep for dep in STAGES[name]["deps"] if dep.startswith(CODE)]
    assert listed == closure(script_of(STAGES[name])), "run `python tools/closure.py --fix`"


def test_every_script_is_a_stage() -> None:
    scripts = {file for file in (ROOT / "stages").glob("*.py") if file.name != "__init__.py"}
    assert scripts == {script_of(stage) for stage in STAGES.values()}


def test_the_rig_stays_hidden() -> None:
    for file in code():
        name = relative(file)
        if name in MAY_SEE_THE_RIG or name.startswith(HIDDEN):
            continue
        seen = [relative(other) for other in imports(file) if relative(other).startswith(HIDDEN)]
        assert not seen, f"{name} imports {seen[0]}"
        assert not re.search(r"\bparams\.rig\b", file.read_text()), f"{name} reads params.rig"


def test_the_oracle_feeds_no_method() -> None:
    """Its own stage asks it; the report reads what that wrote."""
    for file in code():
        name = relative(file)
        seen = {relative(other) for other in imports(file)} - {f"{ORACLE}__init__.py"}
        seen = {other for other in seen if other.startswith(ORACLE)}
        allowed = [what for who, what in MAY_ASK_THE_ORACLE.items() if name.startswith(who)]
        allowed += [ORACLE] if name.startswith(ORACLE) else []
        assert all(other.startswith(tuple(allowed)) for other in seen), f"{name} imports {seen}"
    for stage in ("history", "clusters", "refined", "theta", "policy", "trials"):
        reached = closure(ROOT / "stages" / f"{stage}.py")
        assert not any(other.startswith(ORACLE) for other in reached), stage


def test_pipeline_folders_import_each_other_in_one_direction() -> None:
    """A folder, or a module that lies directly in pipeline/, is one node."""

    def node(file: Path) -> str:
        return "/".join(file.relative_to(ROOT).parts[:2])

    inner = [file for file in code() if relative(file).startswith("pipeline/")]
    graph = {node(file): set() for file in inner}
    for file in inner:
        graph[node(file)] |= {node(other) for other in imports(file)} - {node(file)}
    assert graph["pipeline/episode.py"] == {"pipeline/__init__.py", "pipeline/files.py"}
    TopologicalSorter(graph).prepare()  # raises CycleError


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
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    expected = set(files) - {
        "pipeline/a/unused.py",
        "pipeline/e/__init__.py",
        "pipeline/e/other.cpp",
    }
    assert set(closure(tmp_path / "stages/s.py", tmp_path)) == expected
