"""README, typed word for word: its commands after the demo, and its Python."""

import re
from pathlib import Path

import pytest

from pipeline.layout import ROOT
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
    recording = re.search(r"^DEMO = (.*)$", makefile, re.M)
    assert recording
    copy("python", "-m", "stages.record", Path(recording[1]).stem)
    copy("sling", "fit", recording[1], "--mass", "0.023", "--diameter", "0.0072", "--name", "mine")
    return copy


def blocks(language: str) -> str:
    """All code of README in a language."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    return "".join(code for kind, code in CODE_BLOCK.findall(text) if kind == language)


def test_commands_run_as_they_are_written(project: ProjectCopy, progress) -> None:
    lines = [line for line in blocks("bash").splitlines() if line.startswith("sling ")]
    assert len(lines) >= 7
    for line in lines:
        progress(line)
        assert project("bash", "-ec", line).strip()
    assert (project.folder / "sheet.png").is_file()
    assert (project.folder / "bands/mine/exports/mjcf/card.json").is_file()


def test_the_python_runs(project: ProjectCopy) -> None:
    (project.folder / "readme.py").write_text(blocks("python"))
    modulus, landing, draw = project("python", "readme.py").splitlines()
    assert re.fullmatch(r"\S+ Pa, 90 % interval \S+ to \S+", modulus)
    assert 1.0 < float(landing) < 3.0
    y, z = map(float, re.findall(r"-\d\.\d+", draw))
    assert -0.45 <= y <= -0.25 and -0.30 <= z <= -0.10
