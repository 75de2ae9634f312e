"""The scripts of examples/ run as their first lines say, and come to what they promise."""

import importlib.util
import re
from pathlib import Path

import pytest

from sling2sim2real import Interval
from tests.project import ROOT, python
from validation.projects import copy_project

RUN_HERE = {"drift", "identify_from_arrays", "own_optimizer", "robot_loop", "simulate_pull"}
# tests/policy/test_export.py, and test_sam3_masks.py
RUN_ELSEWHERE = {"policy_elsewhere", "sam3_masks"}


@pytest.fixture(scope="module")
def copy(tmp_path_factory) -> Path:
    """The project as delivered: the scripts take its settings."""
    folder = tmp_path_factory.mktemp("examples") / "copy"
    copy_project(folder)
    return folder


@pytest.fixture
def message(copy: Path, tmp_path: Path):
    """Gives what a script prints, run in an empty folder, where it leaves nothing."""

    def run(name: str) -> str:
        script = copy / "examples" / f"{name}.py"
        done = python(script, folder=tmp_path, PYTHONPATH=str(copy))
        assert done.returncode == 0, done.stderr
        assert list(tmp_path.iterdir()) == []
        return done.stdout

    return run


def numbers(pattern: str, text: str) -> list[float]:
    return [float(number) for number in re.findall(pattern, text)]


def test_every_script_is_run() -> None:
    scripts = {script.stem: script.read_text() for script in (ROOT / "examples").glob("*.py")}
    assert scripts.keys() == RUN_HERE | RUN_ELSEWHERE
    for name, text in scripts.items():
        assert f"examples/{name}.py" in text.split('"""')[1] or name in RUN_ELSEWHERE


def test_simulate_pull(message) -> None:
    table = message("simulate_pull")
    peaks, recoils = numbers(r"([\d.]+) N +[\d.]+ N", table), numbers(r"(\d+) ms", table)
    assert peaks[1] / peaks[0] == pytest.approx(1.1, abs=0.01)  # 10 % stiffer
    assert peaks[2] > peaks[0] and recoils[3] > recoils[0]


@pytest.mark.slow
def test_identify_from_arrays(message) -> None:
    text = message("identify_from_arrays")
    assert "\nsettled\n" in text
    pattern = r"mooney_share: ([-\d.]+)  \[[-\d.]+, [-\d.]+\], truth 0.3"
    assert numbers(pattern, text)[0] == pytest.approx(0.3, abs=0.1)
    assert "it lands at 2.00 m" in text


@pytest.mark.slow
def test_own_optimizer(message) -> None:
    text = message("own_optimizer")
    stiffness = numbers(r"youngs_modulus +([\d.e+]+)", text)
    assert len(stiffness) == 2 and all(abs(modulus / 2.2e5 - 1) < 0.15 for modulus in stiffness)


@pytest.mark.slow
def test_robot_loop(message) -> None:
    text = message("robot_loop")
    low, high = numbers(r"expected ([\d.]+) to", text), numbers(r"to ([\d.]+) m, landed", text)
    landings = numbers(r"landed at ([\d.]+)", text)
    assert len(landings) == 3
    assert high[2] - low[2] < 0.7 * (high[0] - low[0])  # what it saw has taught it
    assert abs(landings[2] - 2.0) < 0.05


def test_drift_finds_a_change_beyond_the_intervals() -> None:
    """Of two intervals of 5 % the difference deviates by 2.1 %: 15 % is none of it."""
    spec = importlib.util.spec_from_file_location("drift", ROOT / "examples/drift.py")
    drift = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(drift)

    def recording(young: float) -> dict[str, Interval]:
        damping = Interval(2e-3, 1.8e-3, 2.2e-3, True, "s")
        ends = young * 0.975, young * 1.025
        return {"youngs_modulus": Interval(young, *ends, True, "Pa"), "damping_product": damping}

    assert drift.changes({"may": recording(2.0e5), "june": recording(2.06e5)}) == []
    changed = drift.changes({"may": recording(2.0e5), "june": recording(1.7e5)})
    assert changed == ["youngs_modulus: -15 % from may to june"]
