"""The command line: what it accepts, and that every mistake is one line without a traceback."""

import json
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from sling2sim2real import __version__
from sling2sim2real.cli import cli
from sling2sim2real.cli.command_line import COMMANDS, EXITS
from sling2sim2real.settings.identification import LAWS
from sling2sim2real.simulator.parameters import THETA
from tests.policy.linear import write_policy
from tests.project import DEFAULTS, ROOT, python

SOFT = dict(zip(THETA, (6e5, 0.45, 5e-3, 0.5, 1.0), strict=True))


@pytest.fixture
def refused(sling: Callable):
    """Runs a command, and gives the one line with which it refuses."""

    def run(status: int, *arguments: str, folder: Path = DEFAULTS.parent) -> str:
        done = sling(*arguments, folder=folder)
        assert (done.returncode, done.stdout) == (status, ""), done.stderr
        (line,) = done.stderr.splitlines()
        assert line.startswith("error: ")
        return line

    return run


def examples() -> list[tuple[str, str]]:
    return [(name, command.example) for name, command in COMMANDS.items()]


@pytest.mark.parametrize(("name", "example"), examples())
def test_each_example_is_understood_and_stands_in_the_help(name: str, example: str, capsys) -> None:
    parsed = cli.parser().parse_args([name, *example.split()])
    assert parsed.command is COMMANDS[name].run
    with pytest.raises(SystemExit) as ended:
        cli.parser().parse_args([name, "--help"])
    assert ended.value.code == 0
    assert f"example:  sling {name} {example}\n" in capsys.readouterr().out


def test_the_help_documents_each_exit_status(capsys) -> None:
    with pytest.raises(SystemExit):
        cli.parser().parse_args(["--help"])
    message = capsys.readouterr().out.partition("exit status:")[2]
    assert [int(line.split()[0]) for line in message.splitlines() if line.strip()] == [*EXITS]


def test_the_documented_commands_are_understood() -> None:
    parse = cli.parser().parse_args
    band = parse("add-band orange --recording o.mcap --mass 0.0408".split())
    assert (band.name, band.recording, band.mass) == ("orange", [Path("o.mcap")], 0.0408)
    assert (band.diameter, band.rest_length) == (None, None)  # then the usual ones, and it is said
    more = parse("add-recording --band orange o_2.mcap o_3.mcap".split())
    assert (more.band, more.recordings) == ("orange", [Path("o_2.mcap"), Path("o_3.mcap")])
    assert parse("check o.mcap --json".split()).json
    assert parse("check o.mcap --pull 2".split()).pull == 2
    assert parse("plan --band band1 --pulls 3".split()).pulls == 3
    planned = parse("plan --band band1 --recording o.mcap --draw=-0.30,-0.17 --rate 50".split())
    assert (planned.draw, planned.rate, planned.out) == ((-0.30, -0.17), 50.0, None)
    looked = parse("check o.mcap --band band1 --sheet o.png --rrd o.rrd".split())
    assert (looked.band, looked.sheet, looked.rrd) == ("band1", Path("o.png"), Path("o.rrd"))
    launched = parse("launch --theta t.json --band band1 --draw=-0.30,-0.17".split())
    assert (launched.theta, launched.draw) == (Path("t.json"), (-0.30, -0.17))
    assert parse("launch --band band1 --draw=-0.3,-0.1".split()).method is None
    aimed = parse("aim --band band1 --target 1.925".split())
    assert (aimed.method, aimed.target, aimed.json) == ("posterior", 1.925, False)
    assert not aimed.force and parse("aim --band b --target 2 --force".split()).force
    assert parse("aim --band band1 --method m --target 1.925".split()).method == "m"


def test_a_command_line_that_makes_no_sense(refused) -> None:
    for arguments, expected in (
        ("", "required: COMMAND"),
        ("lunch", "invalid choice: 'lunch'"),
        ("launch --theta t.json --band band1", "required: --draw"),
        ("launch --theta t.json --band band1 --draw -0.30,-0.17", "joined by ="),
        ("launch --theta t.json --band band1 --draw=0.30,-0.17", "y must be below 0"),
        ("launch --theta t.json --band band1 --draw=-0.30", "must be Y,Z such as"),
        ("aim --band band1 --target inf", "must be a number, got 'inf'"),
        ("aim --band band1 --target 1e30", "must be in metres, from 0.1 to 20, got 1e30"),
        ("aim --band band1 --target far", "must be a number, got 'far'"),
        ("aim --band band1 --target -1.9", "from 0.1 to 20, got -1.9"),
        ("aim --band band1", "required: --target"),
        ("add-band new --recording new.mcap --mass 40.8", "looks like grams (0.0408)"),
        ("check a.mcap --rest-length 52", "argument --rest-length: must be in metres, from 0.05"),
        ("check a.mcap --diameter 10", "argument --diameter: must be in metres, from 0.0005"),
        ("launch --theta t.json --band band1 --draw=-2.30,0", "from 0.05 to 2, got 2.3"),
        ("observe --band band1 --draw=-0.3,-0.2 --landing 221", "looks like centimetres (2.21)"),
        ("plan --band band1 --rate 1e9", "argument --rate: must be in hertz, from 1 to 10000"),
    ):
        assert expected in refused(2, *arguments.split())


def test_a_users_mistake(tmp_path: Path, refused) -> None:
    aim = "aim --band band1 --target 1.9".split()
    assert "params.yaml: no such file; run this in" in refused(1, *aim, folder=tmp_path)
    for arguments, expected in (
        ("launch --theta none.json --band band1 --draw=-0.30,-0.17", "none.json: no such file"),
        ("launch --method no --band band1 --draw=-0.30,-0.17", "--method no: not in params.yaml"),
        ("launch --band band1 --draw=-0.30,-0.60", "lies below the floor"),
        ("launch --theta none.json --band band9 --draw=-0.30,-0.17", "band band9: not in params"),
        ("launch --theta none.json --band band1 --draw=-0.30,-0.60", "lies below the floor"),
        ("aim --band band9 --target 1.925", "band band9: not in params.yaml"),
        ("aim --band band1 --method best --target 1.925", "method best: not in params.yaml"),
        ("check none.mcap", "none.mcap"),
        ("check none.mcap --band band9", "band9"),
        ("check none.mcap --sheet none/out.png", "none"),
        ("plan", "give --band, or --diameter and --rest-length"),
        ("plan --band band1 --rest-length 0.5", "--band band1 brings its sizes from params.yaml"),
        ("plan --rest-length 0.2", "--rest-length 0.2: must be longer than setup.fork_width"),
        ("plan --band band9", "band band9: not in params.yaml"),
        ("plan --band band1 --recording none.mcap", "none.mcap: no such file"),
        ("add-band new --recording none.mcap --mass 0.04", "none.mcap"),
    ):
        assert expected in refused(1, *arguments.split())


def test_a_mistake_in_params_is_told_before_any_stage_runs(tmp_path: Path, refused) -> None:
    text = DEFAULTS.read_text()
    (tmp_path / "params.yaml").write_text(text.replace("  - band1\n", "  - band9\n", 1))
    (tmp_path / "stages").mkdir()
    for command in ("fit --name band1", "aim --band band1 --target 1.9"):
        line = refused(1, *command.split(), folder=tmp_path)
        names = "band1, band2, band3, band1_dip, band2_dip, band3_dip"
        assert line == f"error: params.yaml: run.bands: band9 is not one of {names}"


def test_the_version_and_a_mistake_as_a_process() -> None:
    for module in ("sling2sim2real", "sling2sim2real.cli.cli"):
        done = python("-m", module, "--version")
        assert (done.returncode, done.stderr) == (0, "")
        assert done.stdout == f"sling2sim2real {__version__}\n"
    done = python("-m", "sling2sim2real.cli.cli", "aim", "--band", "band9", "--target", "1.925")
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (1, "", 1)


def test_a_reader_that_has_seen_enough() -> None:
    """`sling ... | head` is no mistake of anybody."""
    endless = (
        "from sling2sim2real.base.errors import run; run(lambda: print('a line\\n' * 1_000_000))"
    )
    command = ["bash", "-c", f'"{sys.executable}" -c "{endless}" | head -n 1']
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT)
    assert (done.stdout, done.stderr) == ("a line\n", "")


def aimable(folder: Path) -> None:
    """A project with a policy of band1."""
    shutil.copy(DEFAULTS, folder)
    theta = folder / "data/theta/band1/posterior.json"
    theta.parent.mkdir(parents=True)
    theta.write_text(json.dumps({"band": "band1", "theta": SOFT}))
    policy = folder / "data/policies/band1/posterior/policy.onnx"
    write_policy(policy, slope=(-0.01, 0.0), offset=(-0.31, -0.15))


def test_aim_prints_one_json_object(tmp_path: Path, sling: Callable) -> None:
    """The keys that scripts rely on, and the pose in the robot's base; the text has them too."""
    aimable(tmp_path)
    arguments = ("aim", "--band", "band1", "--target", "1.9")
    done = sling(*arguments, folder=tmp_path)
    assert (done.returncode, done.stdout, done.stderr.count("\nerror: ")) == (3, "", 1)
    assert re.search("off the target; --force answers all the same\n$", done.stderr)
    done = sling(*arguments, "--json", folder=tmp_path)
    answer = json.loads(done.stdout)
    assert done.returncode == 3 and answer.keys() == {"refused", "warnings"}
    assert "miss" in [row["about"] for row in answer["warnings"]]

    done = python("-m", "sling2sim2real.cli.cli", *arguments, "--json", "--force", folder=tmp_path)
    assert done.returncode == 0
    answer = json.loads(done.stdout)
    stable = ["draw_y_m", "draw_z_m", "predicted_landing_m", "interval_90_m", "hold_force_n"]
    pose = ["pitch_rad", "tcp_frame", "tcp_position_m", "tcp_quaternion_xyzw"]
    assert list(answer) == [*stable, "max_force_n", *pose, "warnings"]
    assert answer["draw_y_m"] == pytest.approx(-0.329, abs=1e-6)
    assert answer["tcp_position_m"] is None
    assert "setup.base_to_fork is null" in answer["warnings"][-1]["what"]
    assert answer["interval_90_m"][0] < answer["predicted_landing_m"] < answer["interval_90_m"][1]
    message = [f"warning: {warning['what']}" for warning in answer["warnings"]]
    assert done.stderr.splitlines() == message

    params = tmp_path / "params.yaml"
    setting = "base_to_fork: [0.5, 0.0, 0.4, 0.0, 0.0, 0.0, 1.0]  #"
    params.write_text(params.read_text().replace("base_to_fork:", setting))
    done = sling(*arguments, "--force", folder=tmp_path)
    shown = dict(line.split(maxsplit=1) for line in done.stdout.splitlines())
    assert shown["tcp_position_m"] == "0.5 -0.329 0.25"
    assert shown["max_force_n"] == "30" and "warnings" not in shown
    for warning in ("does not tell how well", "data/clamps/band1.json is missing"):
        assert warning in done.stderr


def test_aim_names_the_stage_that_makes_what_is_missing(tmp_path: Path, refused) -> None:
    aimable(tmp_path)
    (tmp_path / "data/policies/band1/posterior/policy.onnx").unlink()
    aim = ("aim", "--band", "band1", "--target", "1.9")
    line = refused(1, *aim, folder=tmp_path)
    assert "policy.onnx: missing" in line
    assert "dvc repro policy@band1-posterior" in line
    aim = (*aim, "--method", "de")
    assert refused(1, *aim, folder=tmp_path).endswith(
        "de.json: missing; `dvc repro ablation_theta@band1-de` makes it"
    )
    theta = tmp_path / "data/theta/band1"
    shutil.copy(theta / "posterior.json", theta / "de.json")
    assert refused(1, *aim, folder=tmp_path).endswith(
        "policy.onnx: missing; `dvc repro ablation_policy@band1-de` makes it"
    )


def test_launch_prints_one_json_object(tmp_path: Path, sling: Callable) -> None:
    """A hand-written θ file with only band and theta is enough."""
    theta = tmp_path / "theta.json"
    theta.write_text(json.dumps({"band": "band1", "theta": SOFT}))
    arguments = ("launch", "--theta", str(theta), "--band", "band1", "--json")
    folder = DEFAULTS.parent
    done = python("-m", "sling2sim2real.cli.cli", *arguments, "--draw=-0.30,-0.17", folder=folder)
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert [*result] == ["landing_y_m", "speed_m_s", "hold_force_n", "failure", "warnings"]
    assert result["failure"] is None
    assert 0.5 < result["landing_y_m"] < 6.0
    assert 1.0 < result["hold_force_n"] < 30.0
    done = sling(*arguments, "--draw=-0.45,-0.30", folder=folder)
    broken = json.loads(done.stdout)
    assert broken["landing_y_m"] is None
    assert "N, more than" in broken["failure"]
    more = dict(zip(LAWS["rubber"], (0.3, 0.0, 0.0, 0.02, 0.1, 2.0), strict=True))
    history = {"pull_time": 3.5, "pause": 2.0}
    rubber = {"band": "band1", "law": "rubber", "theta": SOFT | more, "history": history}
    theta.write_text(json.dumps(rubber))
    done = sling(*arguments[:-1], "--draw=-0.30,-0.17", folder=folder)
    lines = done.stdout.splitlines()
    assert ["pull_and_pause_s", "3.5", "2"] in [line.split() for line in lines]
