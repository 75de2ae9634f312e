"""README, typed word for word: its commands after the demo, and its Python."""

import re

import pytest

from sling2sim2real.base.code import ROOT
from validation.pages import CODE_BLOCK
from validation.projects import ProjectCopy, copy_project

pytestmark = pytest.mark.validation


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> ProjectCopy:
    """A copy of the project in which the demo has run."""
    folder = tmp_path_factory.mktemp("readme") / "copy"
    folder.mkdir()
    copy_project(folder)
    copy = ProjectCopy(folder)
    copy("git", "init", "-q")
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    demo = re.search(r"^demo:.*\n(?:\t@(?:echo|printf).*\n)*\t@.*(sling fit .*)$", makefile, re.M)
    assert demo
    copy("bash", "-ec", demo[1])
    return copy


def blocks(language: str) -> str:
    """All code of README in a language."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    return "".join(code for kind, code in CODE_BLOCK.findall(text) if kind == language)


def test_commands_run_as_they_are_written(project: ProjectCopy, progress) -> None:
    lines = [line for line in blocks("bash").splitlines() if line.startswith("sling ")]
    assert len(lines) >= 8
    for line in lines:
        progress(line)
        assert project("bash", "-ec", line).strip()
    assert (project.folder / "sheet.png").is_file()
    assert not (project.folder / "data/raw/mine").exists()  # the last one removes it


def test_the_python_runs(project: ProjectCopy) -> None:
    (project.folder / "readme.py").write_text(blocks("python"))
    modulus, landing, draw = project("python", "readme.py").splitlines()
    assert re.fullmatch(r"\S+ Pa, 90 % interval \S+ to \S+", modulus)
    assert 1.0 < float(landing) < 3.0
    y, z = map(float, re.findall(r"-\d\.\d+", draw))
    assert -0.45 <= y <= -0.25 and -0.30 <= z <= -0.10
