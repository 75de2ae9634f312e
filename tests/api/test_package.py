"""The package works wherever it is installed: a wheel has its defaults and its native text."""

import os
import subprocess
import sys
import zipfile

import pytest

from tests.project import ROOT
from validation.projects import copy_project

ASK = """
import sys
import sling2sim2real as s2s
band = s2s.Band(mass=0.023, diameter=0.010, rest_length=0.52)
model = s2s.Model(band, s2s.Theta(2.0e5, 0.47, 2.4e-3, 0.7, 0.6), settings=s2s.Settings.coarse())
assert not {"torch", "open3d", "cv2", "pandas"} & {*sys.modules}  # heavy, and not needed yet
print(s2s.__file__)
print(round(s2s.launch(model, (-0.30, -0.15)).landing, 3))
"""


def test_it_needs_no_file_in_the_working_folder(tmp_path) -> None:
    assert requested(str(ROOT), tmp_path)[0] == str(ROOT / "sling2sim2real" / "__init__.py")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_wheel_has_all_that_it_needs(tmp_path) -> None:
    source, wheels, installed = (tmp_path / name for name in ("source", "wheels", "installed"))
    copy_project(source)
    build = "pip", "wheel", "-q", "--no-deps", "--no-build-isolation", "-w", str(wheels), "."
    subprocess.run([sys.executable, "-m", *build], cwd=source, check=True, timeout=240)
    (wheel,) = wheels.glob("sling2sim2real-*.whl")
    with zipfile.ZipFile(wheel) as file:
        tops = {name.partition("/")[0] for name in file.namelist()}
        assert {top for top in tops if not top.endswith(".dist-info")} == {"sling2sim2real"}
        assert "sling2sim2real/py.typed" in file.namelist()
        file.extractall(installed)
    work = tmp_path / "work"
    work.mkdir()
    where, landing = requested(str(installed), work)
    assert where.startswith(str(installed))
    assert landing == requested(str(source), work)[1]


def requested(place: str, folder) -> list[str]:
    """What ASK prints in `folder`, with the package that lies in `place`."""
    env = {**os.environ, "PYTHONPATH": place}
    options = {"cwd": folder, "env": env, "capture_output": True, "text": True, "timeout": 240}
    done = subprocess.run([sys.executable, "-c", ASK], **options)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()
