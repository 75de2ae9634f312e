"""A digest follows every change of a folder's sources."""

from pathlib import Path

from pipeline.base.code import digest
from tests.project import write_files


def test_a_digest_follows_changes(tmp_path: Path) -> None:
    write_files(tmp_path, {"part/solver.py": "", "part/step.h": "1", "other/a.py": ""})
    before = digest(tmp_path / "part")
    (tmp_path / "other/a.py").write_text("# more")
    assert digest(tmp_path / "part") == before
    for name in ("part/step.h", "part/new/file.py", "part/solver.py"):
        write_files(tmp_path, {name: "# more"})
        assert digest(tmp_path / "part") != before
        before = digest(tmp_path / "part")
    assert digest(tmp_path / "none") is None
