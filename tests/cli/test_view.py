"""`sling view --save`: what Rerun's own reader finds in the file."""

import re
import subprocess
import sys

import numpy as np
import pytest

from sling2sim2real import Identification
from sling2sim2real.api.band_folder import BandFolder
from tests.cli.lab import NAME
from validation.recordings.bag import Truth

LANDING = "-0.30,-0.17,,2.0,check\n"


def read(path, *arguments: str) -> str:
    command = [sys.executable, "-m", "rerun", "rrd", *arguments, str(path)]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def test_recording_simulation_and_launches_are_in_the_file(sling, copied) -> None:
    pytest.importorskip("rerun", reason="rerun-sdk: pip install -e '.[view]'")
    folder = BandFolder(copied / "bands" / NAME)
    folder.launches_file.write_text(f"draw_y,draw_z,error,landing,use\n{LANDING}")
    done = sling("view", f"bands/{NAME}", "--save", "out.rrd", folder=copied)
    assert (done.returncode, done.stderr) == (0, "") and "rerun out.rrd" in done.stdout
    path = copied / "out.rrd"
    read(path, "verify")
    entities = {*re.findall(r"^(/\S+): \d+$", read(path, "stats"), re.MULTILINE)}
    space = {"cloud", "hand", "simulated", "camera/picture", "posts"}
    space |= {"launches/expected", "launches/draws", "launches/measured"}
    curves = {f"/force_{axis}/{which}" for axis in "xyz" for which in ("measured", "simulated")}
    assert {f"/fork/{name}" for name in space} | curves | {"/events", "/card"} <= entities
    events = read(path, "print", "-vvv", "--entity", "/events")
    (release,) = re.findall(r"PT([0-9.]+)S.*\[release\]", events)
    found = Identification.load(folder.path)
    identified = found.confidence["derived"]["release_time"]["value"]
    assert float(release) == pytest.approx(identified, abs=1e-6)
    assert float(release) == pytest.approx(Truth().release, abs=0.05)
    rows = read(path, "print", "-vvv", "--entity", "/force_y/measured")
    values = [float(x) for x in re.findall(r"PT[0-9.]+S.*\[(-?[0-9.e-]+)\]", rows)]
    np.testing.assert_allclose(values, folder.first_episode.force[:, 1], atol=1e-9)
    measured = read(path, "print", "-vvv", "--entity", "/fork/launches/measured")
    floor = found.settings.setup.fork_height
    assert re.search(rf"\[0\.0, 2\.0, -{floor:g}", measured)


def test_without_rerun_or_an_episode_one_line_says_so(sling, copied, monkeypatch) -> None:
    with monkeypatch.context() as patch:
        patch.setitem(sys.modules, "rerun", None)
        done = sling("view", f"bands/{NAME}", folder=copied)
    assert done.returncode == 1 and done.stderr.count("\n") == 1
    assert "rerun is not installed: pip install '.[view]'" in done.stderr
    pytest.importorskip("rerun", reason="rerun-sdk: pip install -e '.[view]'")
    for recording in (copied / "bands" / NAME / "recordings").iterdir():
        recording.unlink()
    done = sling("view", f"bands/{NAME}", "--save", "out.rrd", folder=copied)
    assert done.returncode == 1 and "keeps no episode; `sling fit bands/toy`" in done.stderr
    assert not (copied / "out.rrd").exists()
