"""No option is ignored: given a value against what there is, it takes effect or is refused.

Each is judged by what comes of two command lines that differ in it alone: exit status, text, files,
and what DVC was asked for. What is slow, and has tests of its own, answers with what it was given.
"""

import argparse
import json
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest

from sling2sim2real.base.layout import Layout
from sling2sim2real.cli import checkout, cli
from sling2sim2real.cli.command_line import COMMANDS
from sling2sim2real.cli.preflight.add_band import _with_band
from sling2sim2real.cli.preflight.check import Look
from tests.cli.fit.test_fit import CARD, LAUNCHES
from tests.cli.test_cli import aimable
from tests.project import DEFAULTS, contents

BAND = {"source": "recording", "mass": 0.04, "diameter": 0.010, "rest_length": 0.52}
ADD = "add-band mine --recording mine.mcap --mass 0.04"
AIM = "aim --band band1 --target 1.9"
DRAW = "--draw=-0.30,-0.17"
EXPORT = "export --band mine --to mjcf"
LAUNCH = f"launch --band band1 {DRAW}"
OBSERVE = f"observe --band mine {DRAW} --landing 2.3 --no-run"
PLAN = "plan --band band1"
MORE = "add-recording --band mine other.mcap"
POSE = "0.7,0.0,1.4,1.0,0.0,0.0,0.0"
# Of each option a command line with one value of it, and with another.
CASES = {
    "fit recordings": ("fit --name mine", "fit other.mcap --name mine"),
    "fit --name": ("fit --name mine", "fit --name band1"),
    "add-band name": (ADD, ADD.replace("mine ", "yours ", 1)),
    "add-band --recording": (ADD, ADD.replace("mine.mcap", "other.mcap")),
    "add-band --mass": (ADD, ADD.replace("0.04", "0.05")),
    "add-recording --band": (MORE, MORE.replace("mine", "band9")),
    "add-recording recordings": (MORE, MORE.replace("other", "mine")),
    "check recording": ("check mine.mcap", "check other.mcap"),
    "setup --max-force": ("setup --max-force 25", "setup --max-force 26"),
    "plan --band": (PLAN, "plan --band band2"),
    "launch --band": (LAUNCH, LAUNCH.replace("band1", "band2")),
    "launch --draw": (LAUNCH, LAUNCH.replace("0.30", "0.31")),
    "aim --band": (AIM, AIM.replace("band1", "band2")),
    "aim --target": (AIM, AIM.replace("1.9", "2.0")),
    "observe --band": (OBSERVE, OBSERVE.replace("mine", "band2")),
    "observe --draw": (OBSERVE, OBSERVE.replace("0.30", "0.31")),
    "observe --landing": (OBSERVE, OBSERVE.replace("2.3", "2.4")),
    "export --band": (EXPORT, EXPORT.replace("mine", "band2")),
    "export --to": (EXPORT, EXPORT.replace("mjcf", "usd")),
    "remove-band name": ("remove-band mine --yes", "remove-band band1 --yes"),
    "reset keys": ("reset", "reset setup.tips"),
    "--version": ("reset", "--version"),
}
# Command lines, and options that each is tried without and with.
ADDED = {
    "fit --name mine": "--mass 0.05, --diameter 0.011, --rest-length 0.5, --launches launches.csv,"
    " --json",
    ADD: "--diameter 0.011, --rest-length 0.5",
    "check mine.mcap": "--band band2, --mass 0.05, --rest-length 0.5, --pull 2, --sheet sheet.txt,"
    " --rrd line.txt, --pictures data, --frames, --json",
    "check mine.mcap --band mine": "--diameter 0.02",
    "setup --max-force 25": "--left-tip=0.7,0.1375,0.42, --right-tip=0.7,-0.1375,0.42,"
    f" --fork-width 0.3, --base-to-camera={POSE}, --camera-to-fork=0,0,0.9,1,0,0,0, --floor=-0.1,"
    " --draw-y=-0.4,-0.3, --draw-z=-0.2,-0.1, --json",
    PLAN: "--mass 0.05, --diameter 0.02, --rest-length 0.5, --draw=-0.30,-0.1, --theta none.json,"
    " --recording none.mcap, --pull paper, --precondition 1, --pulls 2, --out there, --rate 50,"
    " --json",
    LAUNCH: "--method paper, --theta none.json, --json",
    AIM: "--method paper, --force, --json",
    OBSERVE: "--draw-error 0.002, --method paper, --undo, --json",
    OBSERVE.replace("2.3", "2.2"): "--again",
    OBSERVE.removesuffix(" --no-run"): "--no-run",
    EXPORT: "--method de, --out there, --json",
    "remove-band mine": "--yes",
}
CASES |= {
    f"{line.split()[0]} {option.split()[0].partition('=')[0]}": (line, f"{line} {option}")
    for line, options in ADDED.items()
    for option in options.split(", ")
}


def options() -> list[str]:
    """Of the parser and of each of its commands, as argparse has them."""
    top = cli.parser()
    (commands,) = (group for group in top._actions if isinstance(group, argparse._SubParsersAction))
    assert commands.choices.keys() == {*COMMANDS, *checkout.COMMANDS}
    result = []
    for name, parser in (("", top), *commands.choices.items()):
        for action in parser._actions:
            if not isinstance(action, (argparse._HelpAction, argparse._SubParsersAction)):
                result += [
                    f"{name} {word}".strip() for word in action.option_strings or [action.dest]
                ]
    return result


def test_each_option_has_its_case() -> None:
    assert sorted(options()) == sorted(CASES)


@pytest.fixture(scope="module")
def furnished(tmp_path_factory) -> Path:
    """A project, where `mine` is a band with a recording and a launch."""
    place = tmp_path_factory.mktemp("furnished")
    furnish(place)
    return place


@pytest.fixture(scope="module")
def outcomes() -> dict[str, tuple]:
    """What came of command lines in tests so far."""
    return {}


@pytest.fixture
def outcome(furnished, tmp_path_factory, monkeypatch, capsys):
    """Runs a command in a new project."""
    requested: list = []
    echo(monkeypatch, requested)

    def run(line: str) -> tuple:
        requested.clear()
        place = tmp_path_factory.mktemp("place")
        shutil.copytree(furnished, place, dirs_exist_ok=True)
        monkeypatch.chdir(place)
        monkeypatch.setattr(sys, "argv", ["sling", *line.split()])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        message = [text.replace(str(place), "") for text in capsys.readouterr()]
        assert "Traceback" not in message[1]
        calls = [str(call).replace(str(place), "") for call in requested]
        return ended.value.code, *message, contents(place), calls

    return run


def furnish(place: Path) -> None:
    aimable(place)
    path, layout = place / "params.yaml", Layout(place)
    path.write_text(_with_band(path, "mine", BAND), "utf-8")
    for name in ("mine", "other"):
        (place / f"{name}.mcap").write_text(name)
    layout.raw("mine").mkdir(parents=True)
    shutil.copy(place / "mine.mcap", layout.raw("mine"))
    (place / "launches.csv").write_text(LAUNCHES)
    layout.evidence.mkdir()
    (layout.evidence / "mine.csv").write_text("draw_y_m,draw_z_m,landing_y_m\n-0.30,-0.17,2.2\n")


def echo(patch: pytest.MonkeyPatch, requested: list) -> None:
    """What takes long says what it was given."""

    def repro(root, stage, on_line) -> None:
        requested.append(stage)
        card = Layout(root).card(stage.partition("@")[2])
        card.mkdir(parents=True)
        (card / "card.json").write_text(json.dumps(CARD))

    def look_at(*given) -> Look:
        message = SimpleNamespace(
            written=[], usable=True, to_text=lambda: repr(given[:1] + given[2:])
        )
        message.to_json = lambda frames: json.dumps([repr(given[2:]), frames])
        return Look(message)

    def summary(*given, **more) -> str:
        requested.append((*map(str, given), sorted(map(str, more.items()))))
        return "done"

    patch.setattr("sling2sim2real.cli.fit.fit.repro", repro)
    patch.setattr("sling2sim2real.cli.preflight.recordings.checked", lambda *given: [])
    patch.setattr("sling2sim2real.cli.preflight.command.look_at", look_at)
    patch.setattr(
        "sling2sim2real.cli.export.export_of_run", lambda _, *what: (summary(*what), {"what": 1})
    )
    patch.setattr("sling2sim2real.cli.export.shown", lambda folder, card: "in words")
    patch.setattr("sling2sim2real.cli.reset._committed", lambda path: DEFAULTS.read_text("utf-8"))


def once(outcomes: dict[str, tuple], outcome: Callable[[str], tuple], line: str) -> tuple:
    if line not in outcomes:
        outcomes[line] = outcome(line)
    return outcomes[line]


@pytest.mark.parametrize("option", CASES)
def test_an_option_takes_effect_or_is_refused(outcomes, outcome, option: str) -> None:
    first, second = CASES[option]
    before, after = once(outcomes, outcome, first), outcome(second)
    assert before[0] != 2, before
    assert before != after


@pytest.mark.parametrize("line", dict.fromkeys(first for first, _ in CASES.values()))
def test_what_comes_of_a_command_line_is_the_same_again(outcomes, outcome, line: str) -> None:
    """Else the test above would prove nothing."""
    assert once(outcomes, outcome, line) == outcome(line)
