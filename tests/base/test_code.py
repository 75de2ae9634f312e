"""What a script hangs on, and that a digest follows every change of it."""

from pathlib import Path

from pipeline.base.code import digest, digests
from pipeline.base.environment import SIMULATOR, environment
from tests.project import ROOT, write_files

FILES = {
    "validation/bench/a.py": "from pipeline.simulator import solver\n",
    "validation/bench/b.py": "",
    "pipeline/__init__.py": "",
    "pipeline/simulator/__init__.py": "",
    "pipeline/simulator/solver.py": "def f():\n    from rig.arm import a\n",
    "pipeline/simulator/step.h": "1",
    "rig/arm/__init__.py": "",
    "rig/arm/a.py": "",
    "pipeline/other/__init__.py": "",
}


def test_digests_are_of_what_is_imported_and_follow_its_changes(tmp_path: Path) -> None:
    write_files(tmp_path, FILES)
    script = tmp_path / "validation/bench/a.py"
    before = digests(script, root=tmp_path)
    assert [*before] == ["pipeline/simulator", "rig/arm", "validation/bench/a.py"]
    for name, part in (
        ("pipeline/simulator/step.h", "pipeline/simulator"),
        ("pipeline/simulator/new/file.py", "pipeline/simulator"),
        ("rig/arm/a.py", "rig/arm"),
        ("validation/bench/a.py", "validation/bench/a.py"),
    ):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(FILES.get(name, "") + "# more\n")
        now = digests(script, root=tmp_path)
        assert {source for source in now if now[source] != before[source]} == {part}
        before = now
    (tmp_path / "pipeline/other/new.py").touch()
    (tmp_path / "validation/bench/b.py").write_text("# another script\n")
    assert digests(script, root=tmp_path) == before
    assert digest(tmp_path / "pipeline/none") is None


def test_every_figure_names_its_code() -> None:
    script = ROOT / "validation/benchmarks/throughput.py"
    code = environment("cpu", "", script)["code"]
    assert {"pipeline/simulator", "validation/benchmarks/timing.py"} <= {*code}
    assert code["pipeline/simulator"] == SIMULATOR == digest(ROOT / "pipeline/simulator")
    script = ROOT / "validation/benchmarks/clouds.py"
    assert "pipeline/recording" in environment("cpu", "", script)["code"]
