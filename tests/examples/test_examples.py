"""The scripts of examples/ run as their first lines say, and come to what they promise."""

import re

import pytest

from tests.project import ROOT, python

RUN_HERE = {"identify_from_arrays", "own_optimizer", "robot_loop", "simulate_pull"}
RUN_ELSEWHERE = {"policy_elsewhere"}  # tests/policy/test_export.py


def said(name: str, folder) -> str:
    """What a script prints, run in an empty folder, where it leaves nothing."""
    done = python(ROOT / "examples" / f"{name}.py", folder=folder)
    assert done.returncode == 0, done.stderr
    assert list(folder.iterdir()) == []
    return done.stdout


def numbers(pattern: str, text: str) -> list[float]:
    return [float(one) for one in re.findall(pattern, text)]


def test_every_script_is_run_and_short() -> None:
    scripts = {one.stem: one.read_text() for one in (ROOT / "examples").glob("*.py")}
    assert scripts.keys() == RUN_HERE | RUN_ELSEWHERE
    for name, text in scripts.items():
        assert len(text.splitlines()) <= 60, name
        assert f"examples/{name}.py" in text.split('"""')[1] or name in RUN_ELSEWHERE


def test_simulate_pull(tmp_path) -> None:
    table = said("simulate_pull", tmp_path)
    peaks, recoils = numbers(r"([\d.]+) N +[\d.]+ N", table), numbers(r"(\d+) ms", table)
    assert peaks[1] / peaks[0] == pytest.approx(1.1, abs=0.01)  # 10 % stiffer
    assert peaks[2] > peaks[0] and recoils[3] > recoils[0]


@pytest.mark.slow
def test_identify_from_arrays(tmp_path) -> None:
    text = said("identify_from_arrays", tmp_path)
    assert "\nsettled\n" in text
    found = r"mooney_share: ([-\d.]+)  \[[-\d.]+, [-\d.]+\], truth 0.3"
    assert numbers(found, text)[0] == pytest.approx(0.3, abs=0.1)
    assert "it lands at 2.00 m" in text


@pytest.mark.slow
def test_own_optimizer(tmp_path) -> None:
    text = said("own_optimizer", tmp_path)
    stiffness = numbers(r"youngs_modulus +([\d.e+]+)", text)
    assert len(stiffness) == 2 and all(abs(one / 2.2e5 - 1) < 0.15 for one in stiffness)


@pytest.mark.slow
def test_robot_loop(tmp_path) -> None:
    text = said("robot_loop", tmp_path)
    low, high = numbers(r"expected ([\d.]+) to", text), numbers(r"to ([\d.]+) m, landed", text)
    landings = numbers(r"landed at ([\d.]+)", text)
    assert len(landings) == 3
    assert high[2] - low[2] < 0.7 * (high[0] - low[0])  # what it saw has taught it
    assert abs(landings[2] - 2.0) < 0.05
