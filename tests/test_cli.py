"""The command line: what it accepts, and that every mistake is one line without a traceback."""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from pipeline.cli import draw, parser, positive, shown
from pipeline.sling.model import THETA

ROOT = Path(__file__).parents[1]
SOFT = dict(zip(THETA, (6e5, 0.45, 5e-3, 0.5, 1.0), strict=True))


def sling(*arguments: str, folder: Path = ROOT) -> subprocess.CompletedProcess:
    """Run `sling` in `folder` as a user would."""
    command = [sys.executable, "-c", "from pipeline.cli import main; main()", *arguments]
    environment = {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    return subprocess.run(
        command, cwd=folder, env={**os.environ, **environment}, capture_output=True, text=True
    )


def refused(done: subprocess.CompletedProcess, status: int) -> str:
    assert done.returncode == status, done.stderr
    assert done.stdout == ""
    lines = done.stderr.splitlines()
    assert len(lines) == 1, done.stderr
    assert lines[0].startswith("error: ")
    return lines[0]


def test_draw_is_two_numbers_behind_the_fork() -> None:
    assert draw("-0.30,-0.17") == (-0.30, -0.17)
    for wrong in ("", "-0.3", "-0.3,", "-0.3,a", "-0.3,-0.1,0", "0.3,-0.1", "nan,0", "-inf,0"):
        with pytest.raises(argparse.ArgumentTypeError):
            draw(wrong)


def test_positive_numbers() -> None:
    assert positive("0.0408") == 0.0408
    for wrong in ("0", "-1", "nan", "inf", "a", ""):
        with pytest.raises(argparse.ArgumentTypeError):
            positive(wrong)


def test_the_documented_commands_are_understood() -> None:
    parse = parser().parse_args
    band = parse("add-band orange --recording o.mcap --mass 0.0408".split())
    assert (band.name, band.recording, band.mass) == ("orange", Path("o.mcap"), 0.0408)
    assert (band.diameter, band.rest_length) == (0.010, 0.52)
    assert parse("check o.mcap --json".split()).json
    planned = parse("plan --band band1 --recording o.mcap --draw=-0.30,-0.17 --rate 50".split())
    assert (planned.draw, planned.rate, planned.out) == ((-0.30, -0.17), 50.0, None)
    looked = parse("check o.mcap --band band1 --sheet o.png --rrd o.rrd".split())
    assert (looked.band, looked.sheet, looked.rrd) == ("band1", Path("o.png"), Path("o.rrd"))
    launched = parse("launch --theta t.json --band band1 --draw=-0.30,-0.17".split())
    assert (launched.theta, launched.draw) == (Path("t.json"), (-0.30, -0.17))
    aimed = parse("aim --band band1 --target 1.925".split())
    assert (aimed.method, aimed.target, aimed.json) == ("sling2sim2real_taut", 1.925, False)
    assert parse("aim --band band1 --method m --target 1.925".split()).method == "m"
    assert parse("bench --device cuda:0 --json".split()).device == "cuda:0"


def test_results_are_json_or_lines() -> None:
    content = {"landing_y_m": None, "interval_90_m": [1.0, 1.25], "failure": "broke"}
    assert json.loads(shown(content, True)[0]) == content
    assert shown(content, False)[0].splitlines() == [
        "landing_y_m    -",
        "interval_90_m  1 1.25",
        "failure        broke",
    ]
    with pytest.raises(ValueError, match="JSON"):
        shown({"x": float("nan")}, True)


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ("", "required: COMMAND"),
        ("lunch", "invalid choice: 'lunch'"),
        ("launch --theta t.json --band band1", "required: --draw"),
        ("launch --theta t.json --band band1 --draw -0.30,-0.17", "joined by ="),
        ("launch --theta t.json --band band1 --draw=0.30,-0.17", "y must be below 0"),
        ("launch --theta t.json --band band1 --draw=-0.30", "must be Y,Z such as"),
        ("aim --band band1 --target inf", "must be a number, got 'inf'"),
        ("aim --band band1 --target 1e30", "must be at most 100 m"),
        ("aim --band band1 --target far", "must be a number, got 'far'"),
        ("add-band new --recording new.mcap --mass 0", "must be above 0"),
    ],
)
def test_a_command_line_that_makes_no_sense(arguments: str, expected: str) -> None:
    assert expected in refused(sling(*arguments.split()), 2)


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ("launch --theta none.json --band band1 --draw=-0.30,-0.17", "none.json: no such file"),
        ("launch --theta none.json --band band9 --draw=-0.30,-0.17", "band band9: not in params"),
        ("launch --theta none.json --band band1 --draw=-0.30,-0.60", "lies below the floor"),
        ("launch --theta none.json --band band1 --draw=-2.30,0", "at most 2 m from the fork"),
        ("aim --band band9 --target 1.925", "band band9: not in params.yaml"),
        ("aim --band band1 --method best --target 1.925", "method best: not in params.yaml"),
        ("check none.mcap", "none.mcap"),
        ("check none.mcap --band band9", "band9"),
        ("check none.mcap --sheet none/out.png", "none"),
        ("plan --band band1", "setup.base_to_fork is null"),
        ("plan --band band9", "band band9: not in params.yaml"),
        ("plan --band band1 --recording none.mcap", "none.mcap: no such file"),
        ("bench --recording none.mcap", "none.mcap: no such file"),
        ("add-band new --recording none.mcap --mass 0.04", "none.mcap"),
    ],
)
def test_a_users_mistake(arguments: str, expected: str) -> None:
    assert expected in refused(sling(*arguments.split()), 1)


def test_a_reader_that_has_seen_enough() -> None:
    """`sling ... | head` is no mistake of anybody."""
    endless = "from pipeline.errors import run; run(lambda: print('a line\\n' * 1_000_000))"
    command = ["bash", "-c", f'"{sys.executable}" -c "{endless}" | head -n 1']
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT)
    assert (done.stdout, done.stderr) == ("a line\n", "")


def test_a_folder_without_params(tmp_path: Path) -> None:
    done = sling("aim", "--band", "band1", "--target", "1.9", folder=tmp_path)
    assert "params.yaml: cannot be read" in refused(done, 1)


def test_launch_prints_one_json_object(tmp_path: Path) -> None:
    """A hand-written θ file with only band and theta is enough."""
    theta = tmp_path / "theta.json"
    theta.write_text(json.dumps({"band": "band1", "theta": SOFT}))
    arguments = ("launch", "--theta", str(theta), "--band", "band1", "--json")
    done = sling(*arguments, "--draw=-0.30,-0.17")
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert set(result) == {"landing_y_m", "speed_m_s", "hold_force_n", "failure"}
    assert result["failure"] is None
    assert 0.5 < result["landing_y_m"] < 6.0
    assert 1.0 < result["hold_force_n"] < 30.0
    broken = json.loads(sling(*arguments, "--draw=-0.45,-0.30").stdout)
    assert broken["landing_y_m"] is None
    assert "N, more than" in broken["failure"]
