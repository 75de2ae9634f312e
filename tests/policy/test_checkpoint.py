"""A state of a training on disk."""

from pathlib import Path

from tests.project import python


def test_a_full_disk_is_said_in_one_line(tmp_path: Path) -> None:
    """A limit on the size of files stands for the disk; what was kept before stays."""
    code = """
import resource
from pathlib import Path
import torch
from pipeline.base import errors
from pipeline.policy.checkpoint import Checkpoint
kept = Checkpoint(Path("kept.pt"), "x")
kept.save({"a": torch.ones(1)})
resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))
try:
    errors.run(lambda: kept.save({"a": torch.zeros(1000)}))
finally:
    assert kept.load()["a"] == 1
"""
    done = python("-c", code, folder=tmp_path)
    assert done.stderr == "error: kept.pt: cannot be written (File too large)\n"
    assert done.returncode == 1
    assert [one.name for one in tmp_path.iterdir()] == ["kept.pt"]
