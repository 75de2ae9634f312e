"""What a script hangs on, and that a digest follows every change of it."""

from pathlib import Path

from tests.project import ROOT
from validation.benchmarks import timing
from validation.code import digest, digests

FILES = {
    "validation/bench/a.py": "from pipeline.sling import solver\n",
    "validation/bench/b.py": "",
    "pipeline/__init__.py": "",
    "pipeline/sling/__init__.py": "",
    "pipeline/sling/solver.py": "def f():\n    from pipeline.rig.arm import a\n",
    "pipeline/sling/step.h": "1",
    "pipeline/rig/arm/__init__.py": "",
    "pipeline/rig/arm/a.py": "",
    "pipeline/other/__init__.py": "",
}


def test_digests_are_of_what_is_imported_and_follow_its_changes(tmp_path: Path) -> None:
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    script = tmp_path / "validation/bench/a.py"
    before = digests(script, root=tmp_path)
    assert [*before] == ["pipeline/rig/arm", "pipeline/sling", "validation/bench/a.py"]
    for name, part in (
        ("pipeline/sling/step.h", "pipeline/sling"),
        ("pipeline/sling/new/file.py", "pipeline/sling"),
        ("pipeline/rig/arm/a.py", "pipeline/rig/arm"),
        ("validation/bench/a.py", "validation/bench/a.py"),
    ):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(FILES.get(name, "") + "# more\n")
        now = digests(script, root=tmp_path)
        assert {one for one in now if now[one] != before[one]} == {part}
        before = now
    (tmp_path / "pipeline/other/new.py").touch()
    (tmp_path / "validation/bench/b.py").write_text("# another script\n")
    assert digests(script, root=tmp_path) == before
    assert digest(tmp_path / "pipeline/none") is None


def test_every_figure_names_its_code() -> None:
    code = timing.environment("cpu")["code"]  # of this file
    assert {"pipeline/sling", "validation/benchmarks/timing.py"} <= {*code}
    assert code["pipeline/sling"] == timing.SIMULATOR == digest(ROOT / "pipeline/sling")
    script = ROOT / "validation/benchmarks/clouds.py"
    assert "pipeline/recording" in timing.environment("cpu", "", script)["code"]
