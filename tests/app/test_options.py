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

from app import cli
from app.command_line import COMMANDS
from app.flow import child
from app.preflight.add_band import _with_band
from app.preflight.check import Look
from pipeline.base.layout import Layout
from tests.app.fit.test_fit import CARD, LAUNCHES
from tests.app.test_cli import aimable
from tests.project import DEFAULTS

BAND = {"source": "recording", "mass": 0.04, "diameter": 0.010, "rest_length": 0.52}
ADD = "add-band mine --recording mine.mcap --mass 0.04"
AIM = "aim --band band1 --target 1.9"
BENCH = "bench --methods de"
DRAW = "--draw=-0.30,-0.17"
LAUNCH = f"launch --band band1 {DRAW}"
OBSERVE = f"observe --band mine {DRAW} --landing 2.3 --no-run"
PLAN = "plan --band band1"
SETUP = "setup --max-force 25"
POSE = "0.7,0.0,1.4,1.0,0.0,0.0,0.0"
# Of each option the command line without it, and with it; or with one value, and with another.
CASES = {
    "fit recordings": ("fit --name mine", "fit other.mcap --name mine"),
    "fit --mass": ("fit --name mine", "fit --name mine --mass 0.05"),
    "fit --name": ("fit --name mine", "fit --name band1"),
    "fit --diameter": ("fit --name mine", "fit --name mine --diameter 0.011"),
    "fit --rest-length": ("fit --name mine", "fit --name mine --rest-length 0.5"),
    "fit --launches": ("fit --name mine", "fit --name mine --launches launches.csv"),
    "fit --json": ("fit --name mine", "fit --name mine --json"),
    "add-band name": (ADD, ADD.replace("mine ", "yours ", 1)),
    "add-band --recording": (ADD, ADD.replace("mine.mcap", "other.mcap")),
    "add-band --mass": (ADD, ADD.replace("0.04", "0.05")),
    "add-band --diameter": (ADD, f"{ADD} --diameter 0.011"),
    "add-band --rest-length": (ADD, f"{ADD} --rest-length 0.5"),
    "add-recording --band": (
        "add-recording --band mine other.mcap",
        "add-recording --band band9 other.mcap",
    ),
    "add-recording recordings": (
        "add-recording --band mine other.mcap",
        "add-recording --band mine mine.mcap",
    ),
    "drift --band": ("drift --band mine", "drift --band band9"),
    "drift --json": ("drift --band mine", "drift --band mine --json"),
    "check recording": ("check mine.mcap", "check other.mcap"),
    "check --band": ("check mine.mcap", "check mine.mcap --band band2"),
    "check --diameter": (
        "check mine.mcap --band mine",
        "check mine.mcap --band mine --diameter 0.02",
    ),
    "check --rest-length": ("check mine.mcap", "check mine.mcap --rest-length 0.5"),
    "check --pull": ("check mine.mcap", "check mine.mcap --pull 2"),
    "check --sheet": ("check mine.mcap", "check mine.mcap --sheet sheet.txt"),
    "check --rrd": ("check mine.mcap", "check mine.mcap --rrd line.txt"),
    "check --pictures": ("check mine.mcap", "check mine.mcap --pictures data"),
    "check --frames": ("check mine.mcap", "check mine.mcap --frames"),
    "check --json": ("check mine.mcap", "check mine.mcap --json"),
    "setup --left-tip": (SETUP, f"{SETUP} --left-tip=0.7,0.1375,0.42"),
    "setup --right-tip": (SETUP, f"{SETUP} --right-tip=0.7,-0.1375,0.42"),
    "setup --fork-width": (SETUP, f"{SETUP} --fork-width 0.3"),
    "setup --base-to-camera": (SETUP, f"{SETUP} --base-to-camera={POSE}"),
    "setup --camera-to-fork": (SETUP, f"{SETUP} --camera-to-fork=0,0,0.9,1,0,0,0"),
    "setup --floor": (SETUP, f"{SETUP} --floor=-0.1"),
    "setup --max-force": (SETUP, "setup --max-force 26"),
    "setup --draw-y": (SETUP, f"{SETUP} --draw-y=-0.4,-0.3"),
    "setup --draw-z": (SETUP, f"{SETUP} --draw-z=-0.2,-0.1"),
    "setup --json": (SETUP, f"{SETUP} --json"),
    "plan --band": (PLAN, "plan --band band2"),
    "plan --mass": (PLAN, f"{PLAN} --mass 0.05"),
    "plan --diameter": (PLAN, f"{PLAN} --diameter 0.02"),
    "plan --rest-length": (PLAN, f"{PLAN} --rest-length 0.5"),
    "plan --draw": (PLAN, f"{PLAN} --draw=-0.30,-0.1"),
    "plan --theta": (PLAN, f"{PLAN} --theta none.json"),
    "plan --recording": (PLAN, f"{PLAN} --recording none.mcap"),
    "plan --pull": (PLAN, f"{PLAN} --pull paper"),
    "plan --precondition": (PLAN, f"{PLAN} --precondition 1"),
    "plan --pulls": (PLAN, f"{PLAN} --pulls 2"),
    "plan --out": (PLAN, f"{PLAN} --out there"),
    "plan --rate": (PLAN, f"{PLAN} --rate 50"),
    "plan --json": (PLAN, f"{PLAN} --json"),
    "launch --band": (LAUNCH, LAUNCH.replace("band1", "band2")),
    "launch --draw": (LAUNCH, LAUNCH.replace("0.30", "0.31")),
    "launch --method": (LAUNCH, f"{LAUNCH} --method sling2sim2real"),
    "launch --theta": (LAUNCH, f"{LAUNCH} --theta none.json"),
    "launch --json": (LAUNCH, f"{LAUNCH} --json"),
    "aim --band": (AIM, AIM.replace("band1", "band2")),
    "aim --method": (AIM, f"{AIM} --method sling2sim2real"),
    "aim --target": (AIM, AIM.replace("1.9", "2.0")),
    "aim --force": (AIM, f"{AIM} --force"),
    "aim --json": (AIM, f"{AIM} --json"),
    "observe --band": (OBSERVE, OBSERVE.replace("mine", "band2")),
    "observe --draw": (OBSERVE, OBSERVE.replace("0.30", "0.31")),
    "observe --landing": (OBSERVE, OBSERVE.replace("2.3", "2.4")),
    "observe --draw-error": (OBSERVE, f"{OBSERVE} --draw-error 0.002"),
    "observe --method": (OBSERVE, f"{OBSERVE} --method sling2sim2real"),
    "observe --again": (OBSERVE.replace("2.3", "2.2"), OBSERVE.replace("2.3", "2.2") + " --again"),
    "observe --undo": (OBSERVE, f"{OBSERVE} --undo"),
    "observe --no-run": (OBSERVE.replace(" --no-run", ""), OBSERVE),
    "observe --json": (OBSERVE, f"{OBSERVE} --json"),
    "export --band": ("export --band mine --to mjcf", "export --band band2 --to mjcf"),
    "export --method": ("export --band mine --to mjcf", "export --band mine --to mjcf --method de"),
    "export --to": ("export --band mine --to mjcf", "export --band mine --to yaml"),
    "export --out": ("export --band mine --to mjcf", "export --band mine --to mjcf --out there"),
    "export --json": ("export --band mine --to mjcf", "export --band mine --to mjcf --json"),
    "remove-band name": ("remove-band mine --yes", "remove-band band1 --yes"),
    "remove-band --yes": ("remove-band mine", "remove-band mine --yes"),
    "reset keys": ("reset", "reset setup.tips"),
    "flow --workers": ("flow", "flow --workers 2"),
    "flow --gpus": ("flow", "flow --gpus 2"),
    "flow --cluster": ("flow", "flow --cluster nowhere"),
    "ui --port": ("ui", "ui --port 4300"),
    "verify --device": ("verify", "verify --device cuda:0"),
    "bench --device": (BENCH, f"{BENCH} --device cuda:0"),
    "bench --scaling": (BENCH, f"{BENCH} --scaling mine"),
    "bench --peers": (BENCH, f"{BENCH} --peers"),
    "bench --recording": (BENCH, f"{BENCH} --recording mine.mcap"),
    "bench --methods": (BENCH, "bench --methods bo"),
    "bench --budget": (BENCH, f"{BENCH} --budget large"),
    "bench --law": (BENCH, f"{BENCH} --law rubber"),
    "bench --json": (BENCH, f"{BENCH} --json"),
    "figures --json": ("figures", "figures --json"),
    "--version": ("flow", "--version"),
}


def options() -> list[str]:
    """Of the parser and of each of its commands, as argparse has them."""
    top = cli.parser()
    (commands,) = (group for group in top._actions if isinstance(group, argparse._SubParsersAction))
    assert commands.choices.keys() == COMMANDS.keys()
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
        files = {
            file.relative_to(place): file.read_bytes()
            for file in place.rglob("*")
            if file.is_file()
        }
        return (
            ended.value.code,
            *message,
            files,
            [str(call).replace(str(place), "") for call in requested],
        )

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

    def dvc(root, arguments, **callbacks) -> tuple[int, list]:
        requested.append(arguments)
        card = Layout(root).card(arguments[1].partition("@")[2])
        card.mkdir(parents=True)
        (card / "card.json").write_text(json.dumps(CARD))
        return 0, []

    def look_at(*given) -> Look:
        message = SimpleNamespace(
            written=[], usable=True, to_text=lambda: repr(given[:1] + given[2:])
        )
        message.to_json = lambda frames: json.dumps([repr(given[2:]), frames])
        return Look(message)

    def bench(arguments: argparse.Namespace, what: str) -> str:
        given = vars(arguments).items()
        return summary(what, *(pair for pair in given if pair[0] not in ("command", "refuse")))

    def summary(*given, **more) -> str:
        requested.append((*map(str, given), sorted(map(str, more.items()))))
        return "done"

    patch.setattr(child, "dvc", dvc)
    patch.setattr("app.fit.fit.stages_of", lambda root: {})
    patch.setattr("app.preflight.recordings.checked", lambda *given: [])
    patch.setattr("app.preflight.command.look_at", look_at)
    patch.setattr("app.drift.drift.drift", lambda settings, band: {"band": summary(band)})
    patch.setattr("app.drift.drift.shown", str)
    patch.setattr("app.export.export_of_run", lambda _, *what: (summary(*what), {"what": 1}))
    patch.setattr("app.export.shown", lambda folder, card: "in words")
    patch.setattr("app.reset._committed", lambda path: DEFAULTS.read_text("utf-8"))
    patch.setattr("app.flow.run.run", summary)
    patch.setattr("app.flow.server.serve", summary)
    patch.setattr(
        "validation.simulator.verification.verify", lambda _, device, extra: summary(device)
    )
    patch.setattr("validation.simulator.verification.summary", lambda done: (done, 0))
    patch.setattr("validation.benchmarks.bench.bench", bench)
    patch.setattr("validation.figures.listed", lambda *given: [])


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
