"""README, typed: *Your band* word for word, and its Python, on a recording of the virtual rig."""

import re
import shutil

import pytest

from pipeline.base.code import ROOT
from pipeline.params import load
from validation.marked import CODE_BLOCK
from validation.projects import DEFAULTS, ProjectCopy, copy_project

pytestmark = pytest.mark.validation

RECORDING, MASS, BAND = "my.mcap", "0.0408", "my"  # of README's


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> ProjectCopy:
    """A copy of the project with a recording in it that nothing knows; the rig's band is gone."""
    folder = tmp_path_factory.mktemp("readme") / "copy"
    folder.mkdir()
    copy_project(folder)
    copy = ProjectCopy(folder)
    copy("git", "init", "-q")
    copy("dvc", "repro", "record@band1")
    (folder / "data/raw/band1/band1.mcap").rename(folder / RECORDING)
    shutil.rmtree(folder / "data/raw")
    return copy


def section(title: str, language: str) -> str:
    """The code of a section of README."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    part = text.split(f"\n## {title}\n")[1].split("\n## ")[0]
    return next(code for kind, code in CODE_BLOCK.findall(part) if kind == language)


def test_your_band_runs_as_it_is_written(project: ProjectCopy, progress) -> None:
    """Only the mass is that of the recording at hand."""
    mass = load(DEFAULTS).bands["band1"].mass
    lines = section("Your band", "bash").splitlines()
    assert len(lines) >= 5 and any(MASS in line for line in lines)
    for line in lines:
        progress(line)
        said = project("bash", "-ec", line.replace(MASS, str(mass)))
        assert said.strip()
    for made in (
        "my.png",
        f"reports/bands/{BAND}/README.md",
        f"reports/bands/{BAND}/index.html",
        f"data/evidence/{BAND}.csv",
    ):
        assert (project.folder / made).is_file(), made


def test_the_python_runs(project: ProjectCopy) -> None:
    """After the commands above, of their band."""
    code = section("From Python", "python").replace("band1", BAND)
    (project.folder / "readme.py").write_text(code)
    said = project("python", "readme.py").splitlines()
    modulus, landing, draw = said
    assert re.fullmatch(r"\S+ Pa, nine of ten from \S+ to \S+", modulus)
    assert 1.0 < float(landing) < 3.0
    y, z = map(float, re.findall(r"-\d\.\d+", draw))
    assert -0.45 <= y <= -0.25 and -0.30 <= z <= -0.10
