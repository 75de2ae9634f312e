"""No option is ignored: given a value against what there is, it takes effect or is refused.

Each is judged by what comes of two command lines that differ in it alone: exit status, text and
files. What is slow, and has tests of its own, answers with what it was given.
"""

import argparse
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest

from sling2sim2real.cli import checkout, cli
from sling2sim2real.cli.command_line import COMMANDS
from sling2sim2real.cli.preflight.check import Look
from sling2sim2real.cli.preflight.report import new_report
from tests.cli.test_fit import CARD
from tests.project import contents

DRAW = "--draw=-0.30,-0.17"
FIT = "fit seen.mcap --name toy"
AIM, LAUNCH = "aim bands/toy --target 1.9", f"launch bands/toy {DRAW}"
OBSERVE = f"observe bands/toy {DRAW} --landing 2.3"
EXPORT, PLAN, SETUP = "export bands/toy --to mjcf", "plan bands/toy", "setup --max-force 25"
POSE = "0.7,0.0,1.4,1.0,0.0,0.0,0.0"
# Of each option a command line with one value of it, and with another.
CASES = {
    "fit given": (FIT, "fit other.mcap --name toy"),
    "fit --name": (FIT, "fit seen.mcap --name yours"),
    "check recording": ("check seen.mcap", "check other.mcap"),
    "setup --max-force": (SETUP, "setup --max-force 26"),
    "plan band": (PLAN, "plan bands/no"),
    "launch band": (LAUNCH, LAUNCH.replace("toy", "no")),
    "launch --draw": (LAUNCH, LAUNCH.replace("0.30", "0.31")),
    "aim band": (AIM, AIM.replace("toy", "no")),
    "aim --target": (AIM, AIM.replace("1.9", "2.0")),
    "observe band": (OBSERVE, OBSERVE.replace("toy", "no")),
    "observe --draw": (OBSERVE, OBSERVE.replace("0.30", "0.31")),
    "observe --landing": (OBSERVE, OBSERVE.replace("2.3", "2.4")),
    "export band": (EXPORT, EXPORT.replace("toy", "no")),
    "view band": ("view bands/toy", "view bands/no"),
    "view --save": ("view bands/toy", "view bands/toy --save out.rrd"),
    "export --to": (EXPORT, EXPORT.replace("mjcf", "usd")),
    "--version": ("setup", "--version"),
}
# Command lines, and options that each is tried without and with.
ADDED = {
    FIT: "--mass 0.05, --diameter 0.011, --rest-length 0.5, --policy, --json",
    "check seen.mcap": "--mass 0.05, --diameter 0.02, --rest-length 0.5, --pull 2,"
    " --sheet sheet.txt, --pictures bands, --json",
    SETUP: "--left-tip=0.7,0.1375,0.42, --right-tip=0.7,-0.1375,0.42, --fork-width 0.3,"
    f" --base-to-camera={POSE}, --camera-to-fork=0,0,0.9,1,0,0,0, --floor=-0.1, --draw-y=-0.4,-0.3,"
    " --draw-z=-0.2,-0.1, --tool=0.7,0,0,0.05, --topic wrench=/ft, --json",
    PLAN: "--mass 0.05, --diameter 0.02, --rest-length 0.5, --draw=-0.30,-0.1,"
    " --pull paper, --pulls 2, --out there, --rate 50,"
    " --json",
    LAUNCH: "--theta none.json, --json",
    "aim bands/toy --target 19": "--force, --json",
    OBSERVE: "--error 0.002, --speed 5, --angle 40, --check, --json",
    OBSERVE.replace("2.3", "2.2"): "--again",
    EXPORT: "--out there, --samples 2, --json",
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
def furnished(fitted, tmp_path_factory) -> Path:
    """A lab whose band has a launch, and another recording."""
    place = tmp_path_factory.mktemp("furnished") / "lab"
    shutil.copytree(fitted, place)
    (place / "other.mcap").write_bytes(b"another")
    (place / "bands/toy/launches.csv").write_text("draw_y,draw_z,landing\n-0.30,-0.17,2.2\n")
    return place


@pytest.fixture(scope="module")
def outcomes() -> dict[str, tuple]:
    """What came of command lines in tests so far."""
    return {}


@pytest.fixture
def outcome(furnished, tmp_path_factory, monkeypatch, capsys):
    """Runs a command in a new project."""
    echo(monkeypatch)

    def run(line: str) -> tuple:
        place = tmp_path_factory.mktemp("place")
        shutil.copytree(furnished, place, dirs_exist_ok=True)
        monkeypatch.chdir(place)
        monkeypatch.setattr(sys, "argv", ["sling", *line.split()])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        message = [text.replace(str(place), "") for text in capsys.readouterr()]
        assert "Traceback" not in message[1]
        return ended.value.code, *message, contents(place)

    return run


def echo(patch: pytest.MonkeyPatch) -> None:
    """What takes long says what it was given."""

    def fit(*given, **more) -> dict:
        return CARD | {"band": repr((given, more)), "card": "README.md"}

    def look_at(*given) -> Look:
        return Look(new_report(given[0], given[2].facts) | {"notes": [repr(given[2:])]})

    def export(found, to, out, samples) -> SimpleNamespace:
        return SimpleNamespace(folder=out, card={"files": [str(to), str(out), f"{samples}"]})

    patch.setattr("sling2sim2real.cli.fit.fit", fit)
    patch.setattr("sling2sim2real.cli.observe.fit", lambda folder: None)
    patch.setattr("sling2sim2real.cli.preflight.command.look_at", look_at)
    patch.setattr("sling2sim2real.exporting.export.export", export)
    patch.setattr("sling2sim2real.cli.view.view", lambda *given: repr(given[1]))


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
