"""The `sling` command: a table of commands, each a small function that calls the library.

Run `sling --help`, or `sling launch --help`. How the table becomes a command line: command_line.py.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from sling2sim2real.api.arguments import USUAL
from sling2sim2real.base.errors import run
from sling2sim2real.base.launches_file import CHECK, FIT
from sling2sim2real.cli import arguments as kinds
from sling2sim2real.cli import checkout
from sling2sim2real.cli.command_line import JSON, REFUSED, Done, command, execute, flag, parser
from sling2sim2real.exporting import ENGINES

if TYPE_CHECKING:
    from sling2sim2real.api.identification import Identification

ALIASES = {"mujoco": "mjcf", "physx": "usd"}  # engines that people name


def main() -> None:
    """Entry point of the console script."""
    name, arguments = sys.argv[1:2], sys.argv[2:]
    if name and name[0] in checkout.COMMANDS:
        run(lambda: checkout.run(name[0], arguments))
    run(lambda: execute(parser().parse_args()))


BAND = flag("band", type=Path, metavar="BAND", help="folder of a band, such as bands/orange")
DRAW = flag(
    "--draw",
    type=kinds.draw,
    required=True,
    metavar="Y,Z",
    help="drawn position in metres, frame O; write it with =, --draw=-0.30,-0.17",
)
SIZES = (
    flag("--mass", type=kinds.mass, metavar="KG", help="mass of the band, in kilograms"),
    flag(
        "--diameter",
        type=kinds.diameter,
        metavar="M",
        help=f"diameter of the band, in metres; default {USUAL['diameter']:g}",
    ),
    flag(
        "--rest-length",
        type=kinds.rest_length,
        metavar="M",
        help=f"of the band between the clamps, in metres; default {USUAL['rest_length']:g}",
    ),
)


def sizes_of(arguments: argparse.Namespace) -> dict[str, float]:
    """Those that are given."""
    given = {name: getattr(arguments, name) for name in ("mass", "diameter", "rest_length")}
    return {name: value for name, value in given.items() if value is not None}


def found_of(arguments: argparse.Namespace) -> Identification:
    """The band as it was identified."""
    from sling2sim2real.api.band_folder import BandFolder
    from sling2sim2real.api.identification import Identification

    return Identification.load(BandFolder.at(arguments.band).path)


@command(
    "identify a band from its recordings and launches, write its card; go on after an edit",
    "my.mcap --mass 0.0408 --name orange",
    flag(
        "given",
        type=Path,
        nargs="*",
        metavar="FILE.mcap",
        help="recordings of one band, or bags' folders; or the folder of a band, bands/orange",
    ),
    flag("--name", metavar="NAME", help="what to call the band; default: as the first file"),
    *SIZES,
    flag("--policy", action="store_true", help="train a policy, which `sling aim` then asks"),
    JSON,
)
def fit(arguments: argparse.Namespace) -> Done:
    from sling2sim2real.cli.fit import fit, folder_of, shown

    folder, recordings = folder_of(arguments.given, arguments.name)
    card = fit(folder, recordings, sizes_of(arguments), policy=arguments.policy)
    return kinds.shown(card, True) if arguments.json else shown(card)


@command(
    "say whether a recording can be used, what is missing and what costs accuracy",
    "my.mcap --mass 0.0408 --sheet my.png",
    flag("recording", type=Path, metavar="FILE.mcap", help="or a bag's folder, or a band's"),
    *SIZES,
    flag("--pull", type=kinds.count, metavar="N", help="which pull; default: the first usable one"),
    flag("--sheet", type=Path, metavar="OUT.png", help="draw six moments, force and coverage"),
    flag("--pictures", type=Path, metavar="FOLDER", help="write the pictures to mask elsewhere"),
    JSON,
)
def check(arguments: argparse.Namespace) -> Done:
    from sling2sim2real.cli.preflight.command import check, check_band

    options = {name: getattr(arguments, name) for name in ("sheet", "pictures", "pull")}
    options["as_json"] = arguments.json
    from sling2sim2real.api.band_folder import BandFolder

    if folder := BandFolder.find(arguments.recording):
        return check_band(folder, sizes_of(arguments), **options)
    return check(arguments.recording, sizes_of(arguments), **options)


@command(
    "write what you measured of your lab into bands/lab.yaml: tips, camera, floor, limits",
    "--left-tip=0.7,0.1375,0.42 --right-tip=0.7,-0.1375,0.42 --floor=-0.1",
    *(
        flag(f"--{name.replace('_', '-')}", type=kind, metavar=metavar, help=help_text)
        for name, (kind, metavar, help_text) in kinds.MEASURED.items()
    ),
    flag(
        "--topic",
        type=kinds.topic,
        action="append",
        metavar="ROLE=TOPIC",
        help=f"where it is not found by type and rate; roles are {', '.join(kinds.ROLES)}",
    ),
    JSON,
)
def setup(arguments: argparse.Namespace) -> Done:
    from sling2sim2real.cli import setup

    measured = {name: getattr(arguments, name) for name in kinds.MEASURED}
    done = setup.set_up(measured | {"topics": arguments.topic})
    return kinds.shown(done, True) if arguments.json else setup.shown(done)


@command(
    "plan the pull that a robot is to record, and check it against limits",
    "--mass 0.0408 --diameter 0.010 --rest-length 0.52",
    flag("band", type=Path, nargs="?", metavar="BAND", help="its folder; or sizes of one to come"),
    *SIZES,
    flag("--draw", type=kinds.draw, metavar="Y,Z", help="in metres, frame O; default plan.draw"),
    flag(
        "--pull",
        choices=kinds.PULLS,
        default=kinds.PULLS[0],
        help="with plan.dips (the default), or without",
    ),
    flag("--pulls", type=kinds.count, default=1, metavar="N", help="in one recording; default 1"),
    flag("--out", type=Path, metavar="FOLDER", help="default plan/, in the band's folder"),
    flag("--rate", type=kinds.rate, default=100.0, metavar="HZ", help="of the CSV; default 100"),
    JSON,
)
def plan(arguments: argparse.Namespace) -> Done:
    from sling2sim2real.cli.plan.plan import known_band, plan_recording

    known = known_band(arguments.band, sizes_of(arguments))
    plan = plan_recording(
        known.settings,
        known.band,
        found=known.found,
        draw=arguments.draw,
        pull=arguments.pull,
        pulls=arguments.pulls,
    )
    files = plan.write(arguments.out or Path(arguments.band or ".", "plan"), arguments.rate)
    return plan.to_json(files) if arguments.json else plan.to_text(files)


@command(
    "simulate one launch of an identified band",
    "bands/orange --draw=-0.30,-0.17",
    BAND,
    DRAW,
    flag("--theta", type=Path, metavar="FILE", help="a θ file of your own instead of the band's"),
    JSON,
)
def launch(arguments: argparse.Namespace) -> Done:
    from dataclasses import replace

    from sling2sim2real.api.launching import launch
    from sling2sim2real.api.model import Theta
    from sling2sim2real.cli import aim

    found = found_of(arguments)
    if arguments.theta:
        found = replace(found, theta=Theta.load(arguments.theta), samples=None, confidence={})
    return aim.shown(aim.of_launch(launch(found, arguments.draw)), arguments.json)


@command(
    "say where to draw for a target",
    "bands/orange --target 1.925",
    BAND,
    flag(
        "--target", type=kinds.target, required=True, metavar="M", help="along the floor, in metres"
    ),
    flag("--force", action="store_true", help="answer even if it misses, fails or pulls too hard"),
    JSON,
)
def aim(arguments: argparse.Namespace) -> Done:
    from sling2sim2real.api.launching import Refused, aim
    from sling2sim2real.cli import aim as answers

    found = found_of(arguments)
    try:
        aimed = aim(found, arguments.target, anyway=arguments.force)
    except Refused as refused:
        if not arguments.json:
            raise
        return kinds.shown({"refused": str(refused)}, True), REFUSED
    return answers.shown(answers.of_aim(aimed, found), arguments.json)


@command(
    "learn from a launch that you measured: the band is fitted again with it",
    "bands/orange --draw=-0.30,-0.17 --landing 2.21",
    BAND,
    DRAW,
    flag(
        "--landing",
        type=kinds.landing,
        metavar="M",
        help="along the floor, in metres; or give the speed, or both",
    ),
    flag(
        "--speed",
        type=kinds.speed,
        metavar="V",
        help="as it leaves the pouch, in m/s: parts a launch that loses energy from a wrong aim",
    ),
    flag("--angle", type=kinds.angle, metavar="A", help="there, in degrees above the horizon"),
    flag(
        "--error",
        type=kinds.draw_error,
        metavar="M",
        help="standard deviation of the draw, in metres; default trials.actuation_error",
    ),
    flag("--check", action="store_true", help="hold it against predictions, learn nothing from it"),
    flag("--again", action="store_true", help="it equals one that is there, and is one more"),
    JSON,
)
def observe(arguments: argparse.Namespace) -> Done:
    from sling2sim2real.api.band_folder import BandFolder
    from sling2sim2real.base.launches_file import LaunchRow
    from sling2sim2real.cli.observe import observe, shown

    use = CHECK if arguments.check else FIT
    flown = {"speed": arguments.speed, "angle": arguments.angle}
    row = LaunchRow(arguments.draw, arguments.error, arguments.landing, use, **flown)
    answer = observe(BandFolder.at(arguments.band), row, again=arguments.again)
    return kinds.shown(answer, True) if arguments.json else shown(answer)


@command(
    "write an identified band for another engine, matched to the calibrated simulation",
    "bands/orange --to mjcf",
    BAND,
    flag(
        "--to",
        required=True,
        type=lambda name: ALIASES.get(name, name),
        choices=ENGINES,
        help="MuJoCo's XML (or: mujoco), numbers and a loader for Newton, PhysX's USD (or: physx)",
    ),
    flag("--out", type=Path, metavar="FOLDER", help="default exports/<target> in its folder"),
    flag(
        "--samples",
        type=int,
        default=0,
        metavar="N",
        help="also samples of the posterior as the engine's parameters, in samples.parquet",
    ),
    JSON,
)
def export(arguments: argparse.Namespace) -> Done:
    from sling2sim2real.api.band_folder import BandFolder
    from sling2sim2real.base.disk import expect_writable
    from sling2sim2real.cli.export import shown
    from sling2sim2real.exporting.export import export

    found = found_of(arguments)
    folder = BandFolder.at(arguments.band)
    out = arguments.out or folder.path / "exports" / arguments.to
    expect_writable(out)
    done = export(found, arguments.to, out, samples=arguments.samples)
    return kinds.shown(done.card, True) if arguments.json else shown(done.folder, done.card)


@command(
    "open a viewer: a band's first pull as recorded and as simulated, and its launches",
    "bands/orange",
    BAND,
    flag("--save", type=Path, metavar="OUT.rrd", help="write a file for Rerun's viewer instead"),
)
def view(arguments: argparse.Namespace) -> Done:
    from sling2sim2real.api.band_folder import BandFolder
    from sling2sim2real.cli.preflight.output import expect_writable
    from sling2sim2real.cli.view import view

    if arguments.save:
        expect_writable(arguments.save, ".rrd")
    return view(BandFolder.at(arguments.band), arguments.save)


if __name__ == "__main__":
    main()
