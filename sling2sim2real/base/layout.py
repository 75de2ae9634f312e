"""A file that something else makes: the error where it is not there, or not whole.

What makes it is said where errors are printed, by its place alone.
"""

from __future__ import annotations

from pathlib import Path

from sling2sim2real.base.errors import UserError


class NotMade(UserError):
    """A file that a run makes is missing, or not as the run has left it.

    Attributes:
        path: Of the file.
        problem: What is wrong with it.
    """

    def __init__(self, path: Path, problem: str = "missing") -> None:
        super().__init__(path, problem)
        self.path, self.problem = Path(path), problem

    def __str__(self) -> str:
        return f"{self.path}: {self.problem}"


def made(path: Path) -> Path:
    """`path`, which must be a file. Raises NotMade."""
    if not path.is_file():
        raise NotMade(path)
    return path
