"""The command line: what it accepts, and that every mistake is one line without a traceback."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from sling2sim2real import __version__
from sling2sim2real.api.band_folder import BandFile
from sling2sim2real.cli import cli
from sling2sim2real.cli.command_line import COMMANDS, EXITS
from tests.project import DEFAULTS, ROOT, python


@pytest.fixture
def refused(sling: Callable):
    """Runs a command, and gives the one line with which it refuses."""

    def run(status: int, *arguments: str, folder: Path = DEFAULTS.parent) -> str:
        done = sling(*arguments, folder=folder)
        assert (done.returncode, done.stdout) == (status, ""), done.stderr
        line = done.stderr.splitlines()[-1]
        assert done.stderr.count("error: ") == 1 and line.startswith("error: ")
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


def test_a_command_line_that_makes_no_sense(refused) -> None:
    for arguments, expected in (
        ("", "required: COMMAND"),
        ("lunch", "invalid choice: 'lunch'"),
        ("launch b", "required: --draw"),
        ("launch b --draw -0.30,-0.17", "joined by ="),
        ("aim b --target inf", "must be a number, got 'inf'"),
        ("fit new.mcap --mass 40.8", "looks like grams (0.0408)"),
        ("observe b --draw=-0.3,-0.2 --speed 500", "must be in m/s, from 0.1 to 100, got 500"),
        ("observe b --draw=-0.3,-0.2 --angle 95", "must be in degrees, from -90 to 90, got 95"),
        ("plan b --rate 1e9", "argument --rate: must be in hertz, from 1 to 10000"),
        ("export b --to unity", "invalid choice: 'unity'"),
    ):
        assert expected in refused(2, *arguments.split())


def test_a_users_mistake(tmp_path: Path, refused, fitted) -> None:
    for arguments, expected in (
        ("aim bands/no --target 1.9", "bands/no: is no folder of a band, with a band.yaml in it"),
        ("fit", "give a recording"),
        ("check none.mcap", "none.mcap"),
        ("plan", "give a band's folder, or --diameter and --rest-length"),
        ("plan --rest-length 0.2", "--rest-length 0.2: must be longer than setup.fork_width"),
    ):
        assert expected in refused(1, *arguments.split(), folder=tmp_path)
    for arguments, expected in (
        ("aim bands/no --target 1.9", "there are bands/toy"),
        ("launch bands/toy --draw=-0.30,-0.60", "draw: must be (y, z) with y < 0 and z > -0.52"),
        ("launch bands/toy --theta none.json --draw=-0.3,-0.1", "none.json: missing"),
        ("observe bands/toy --draw=-0.3,-0.6 --landing 2", "lies below the floor"),
        ("observe bands/toy --draw=-0.3,-0.2 --angle 40", "--landing: is missing"),
        ("observe bands/toy --draw=-0.3,-0.2 --speed 5 --check", "only a launch to fit may have"),
        ("plan bands/toy --rest-length 0.5", "has the band's sizes: leave these out"),
        ("check bands/toy --mass 0.04", "has the band's sizes: leave these out"),
        ("check seen.mcap --sheet none/out.png", "there is no folder none"),
        ("fit bands/toy --name other", "give one band"),
    ):
        assert expected in refused(1, *arguments.split(), folder=fitted)


def test_a_band_that_is_not_identified_yet_says_how(tmp_path: Path, refused) -> None:
    folder = tmp_path / "bands/mine"
    folder.mkdir(parents=True)
    sizes = {"mass": 0.02, "diameter": 0.01, "rest_length": 0.5}
    BandFile(**sizes).save(folder / "band.yaml")
    for command in ("aim bands/mine --target 1.9", "export bands/mine --to mjcf"):
        line = refused(1, *command.split(), folder=tmp_path)
        assert line.endswith("mine is not identified yet: `sling fit bands/mine`")


def test_the_version_and_a_mistake_as_a_process() -> None:
    for module in ("sling2sim2real", "sling2sim2real.cli.cli"):
        done = python("-m", module, "--version")
        assert (done.returncode, done.stderr) == (0, "")
        assert done.stdout == f"sling2sim2real {__version__}\n"
    done = python("-m", "sling2sim2real", "aim", "bands/none", "--target", "1.925")
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (1, "", 1)


def test_a_reader_that_has_seen_enough() -> None:
    """`sling ... | head` is no mistake of anybody."""
    endless = (
        "from sling2sim2real.base.errors import run; run(lambda: print('a line\\n' * 1_000_000))"
    )
    command = ["bash", "-c", f'"{sys.executable}" -c "{endless}" | head -n 1']
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT)
    assert (done.stdout, done.stderr) == ("a line\n", "")
