"""The `sling` command: a table of commands, each a small function that calls the library.

Run `sling --help`, or `sling launch --help`. How the table becomes a command line: command_line.py.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from sling2sim2real.base.layout import Layout
from sling2sim2real.cli import arguments as kinds
from sling2sim2real.cli import checkout
from sling2sim2real.cli.command_line import (
    JSON,
    REFUSED,
    Done,
    Refusal,
    command,
    execute,
    flag,
    parser,
    say,
)
from sling2sim2real.cli.sizes import DIAMETER, REST_LENGTH, assumed
from sling2sim2real.exporting import ENGINES

DEFAULT_METHOD = "posterior"


def main() -> None:
    """Entry point of the console script."""
    sys.path.insert(0, "")  # for stages/ and pipeline/, while commands still drive DVC
    try:
        from stages.start import run
    except ModuleNotFoundError:
        from sling2sim2real.base.errors import run
    name, arguments = sys.argv[1:2], sys.argv[2:]
    if name and name[0] in checkout.COMMANDS:
        run(lambda: checkout.run(name[0], arguments))
    run(lambda: execute(parser().parse_args()))


BAND = flag("--band", required=True, metavar="NAME", help="band of params.yaml")
METHOD = flag(
    "--method",
    metavar="NAME",
    default=DEFAULT_METHOD,
    help=f"of params.yaml; default {DEFAULT_METHOD}",
)
DRAW = flag(
    "--draw",
    type=kinds.draw,
    required=True,
    metavar="Y,Z",
    help="drawn position in metres, frame O; write it with =, --draw=-0.30,-0.17",
)
MASS = {"type": kinds.mass, "metavar": "KG", "help": "mass of the band, in kilograms"}
THICK = {"type": kinds.diameter, "metavar": "M"}
THICK["help"] = f"diameter of the band, in metres; default {DIAMETER:g}"
LONG = {"type": kinds.rest_length, "metavar": "M"}
LONG["help"] = f"of the band between the clamps, in metres; default {REST_LENGTH:g}"


@command(
    "identify a band from its recordings, train its policy, write its card",
    "my.mcap --mass 0.0408 --name orange",
    flag(
        "recordings",
        type=Path,
        nargs="*",
        metavar="FILE.mcap",
        help="of one band; or bags' folders",
    ),
    flag("--mass", **MASS),
    flag("--name", metavar="NAME", help="what to call the band; default: as the first file"),
    flag("--diameter", **THICK),
    flag("--rest-length", **LONG),
    flag("--launches", type=Path, metavar="CSV", help="measured launches to learn from"),
    JSON,
)
def fit(arguments: argparse.Namespace) -> Done:
    from sling2sim2real.cli.fit.fit import NewBand, fit
    from sling2sim2real.cli.fit.screen import shown as screen

    band = NewBand(arguments.mass, arguments.diameter, arguments.rest_length)
    card = fit(arguments.recordings, arguments.name, band, arguments.launches)
    return kinds.shown(card, True) if arguments.json else screen(card)


@command(
    "check recordings and add their band to params.yaml",
    "orange --recording my.mcap --mass 0.0408",
    flag("name", help="what to call the band: small letters, digits and _"),
    flag("--recording", type=Path, required=True, nargs="+", metavar="FILE.mcap"),
    flag("--mass", required=True, **MASS),
    flag("--diameter", **THICK),
    flag("--rest-length", **LONG),
)
def add_band(arguments: argparse.Namespace) -> Done:
    from sling2sim2real.cli.preflight.add_band import add_band

    done = add_band(
        arguments.name,
        arguments.recording,
        mass=arguments.mass,
        diameter=arguments.diameter,
        rest_length=arguments.rest_length,
    )
    return f"{done}\n`sling fit --name {arguments.name}` identifies it"


@command(
    "check further recordings of a band and add them to it",
    "--band orange more.mcap",
    BAND,
    flag("recordings", type=Path, nargs="+", metavar="FILE.mcap", help="or bags' folders"),
)
def add_recording(arguments: argparse.Namespace) -> Done:
    from sling2sim2real.cli.preflight.recordings import add_recording

    done = add_recording(arguments.band, arguments.recordings)
    return f"{done}\n`sling fit --name {arguments.band}` identifies it anew"


@command(
    "say whether a recording can be used, what is missing and what costs accuracy",
    "my.mcap --mass 0.0408 --sheet my.png",
    flag("recording", type=Path, metavar="FILE.mcap", help="or a bag's folder"),
    flag("--band", metavar="NAME", help="band of params.yaml, for its mass and sizes"),
    flag("--mass", **MASS),
    flag("--diameter", **THICK),
    flag("--rest-length", **LONG),
    flag("--pull", type=kinds.count, metavar="N", help="which pull; default: the first usable one"),
    flag("--sheet", type=Path, metavar="OUT.png", help="draw six moments, force and coverage"),
    flag("--rrd", type=Path, metavar="OUT.rrd", help="write one timeline for Rerun's viewer"),
    flag("--pictures", type=Path, metavar="FOLDER", help="write the pictures to mask elsewhere"),
    flag("--frames", action="store_true", help="with --json, also a row for each picture"),
    JSON,
)
def check(arguments: argparse.Namespace) -> Done:
    from pipeline.params import load
    from sling2sim2real.cli.preflight.command import check
    from sling2sim2real.settings import Settings

    if arguments.frames and not arguments.json:
        arguments.refuse("argument --frames: used with --json alone")
    in_project = arguments.band or Path("params.yaml").exists()
    if not in_project:
        say("no params.yaml in this folder: the settings that come with the package are taken")
    return check(
        arguments.recording,
        load() if in_project else Settings.default(),
        band=arguments.band,
        mass=arguments.mass,
        diameter=arguments.diameter,
        rest_length=arguments.rest_length,
        as_json=arguments.json,
        frames=arguments.frames,
        sheet=arguments.sheet,
        rrd=arguments.rrd,
        pictures=arguments.pictures,
        pull=arguments.pull,
    )


@command(
    "write what you measured of your lab into params.yaml: tips, camera, floor, limits",
    "--left-tip=0.7,0.1375,0.42 --right-tip=0.7,-0.1375,0.42 --floor=-0.1",
    *(
        flag(f"--{name.replace('_', '-')}", type=kind, metavar=metavar, help=help_text)
        for name, (kind, metavar, help_text) in kinds.MEASURED.items()
    ),
    JSON,
)
def setup(arguments: argparse.Namespace) -> Done:
    """Asks at a terminal where nothing is given."""
    from sling2sim2real.cli import setup

    summary = {name: getattr(arguments, name) for name in kinds.MEASURED}
    measured = setup.LabMeasures(**summary)
    if measured.nothing and sys.stdin.isatty():
        done = setup.set_up(setup.requested(), agreed=setup.confirmed)
    else:
        done = setup.set_up(measured)
    return kinds.shown(done, True) if arguments.json else setup.shown(done)


@command(
    "plan the pull that a robot is to record, and check it against limits",
    "--mass 0.0408 --diameter 0.010 --rest-length 0.52 --recording earlier.mcap",
    flag("--band", metavar="NAME", help="of params.yaml; or with --mass: a new name"),
    flag("--mass", **MASS),
    flag("--diameter", **THICK),
    flag("--rest-length", **LONG),
    flag("--draw", type=kinds.draw, metavar="Y,Z", help="in metres, frame O; default plan.draw"),
    flag("--theta", type=Path, metavar="FILE", help="θ file that tells the force to hold"),
    flag(
        "--recording", type=Path, metavar="FILE.mcap", help="for base and force; default: its own"
    ),
    flag(
        "--pull",
        choices=kinds.PULLS,
        default=kinds.PULLS[0],
        help="with plan.dips (the default), or without",
    ),
    flag(
        "--precondition",
        type=kinds.count,
        default=0,
        metavar="N",
        help="stretch the band to the draw so often first, in the same grasp",
    ),
    flag("--pulls", type=kinds.count, default=1, metavar="N", help="in one recording; default 1"),
    flag("--out", type=Path, metavar="FOLDER", help="default data/plans/<band>"),
    flag("--rate", type=kinds.rate, default=100.0, metavar="HZ", help="of the CSV; default 100"),
    JSON,
)
def plan(arguments: argparse.Namespace) -> Done:
    from pipeline.params import load
    from sling2sim2real.cli.plan.plan import plan_recording, with_band

    sizes = arguments.mass, arguments.diameter, arguments.rest_length
    params, band = with_band(load(), arguments.band, *sizes)
    if any(sizes) and (taken := assumed(*sizes[1:])):
        say(f"assumed: {taken}")
    plan = plan_recording(
        params,
        band,
        draw=arguments.draw,
        theta=arguments.theta,
        recording=arguments.recording,
        pull=arguments.pull,
        precondition=arguments.precondition,
        pulls=arguments.pulls,
    )
    files = plan.write(arguments.out or Layout().plans(band), arguments.rate)
    return plan.to_json(files) if arguments.json else plan.to_text(files)


@command(
    "simulate one launch with identified or hand-written parameters",
    "--band band1 --draw=-0.30,-0.17",
    BAND,
    DRAW,
    flag("--method", metavar="NAME", help=f"whose θ; default {DEFAULT_METHOD}"),
    flag("--theta", type=Path, metavar="FILE", help="a θ file instead, such as of your own"),
    JSON,
)
def launch(arguments: argparse.Namespace) -> Done:
    from pipeline.params import load
    from sling2sim2real.cli import launch, safety
    from sling2sim2real.settings import expect_known

    params, method = load(), arguments.method or DEFAULT_METHOD
    if arguments.theta and arguments.method:
        arguments.refuse("give --method or --theta, not both")
    expect_known(params, "method", method, called="--method")
    theta = arguments.theta or Layout().theta(arguments.band, method)
    answer = launch.launch_output(params, arguments.band, theta, arguments.draw)
    return safety.shown(answer, arguments.json)


@command(
    "say where to draw for a target, by the trained policy",
    "--band band1 --target 1.925",
    BAND,
    METHOD,
    flag(
        "--target", type=kinds.target, required=True, metavar="M", help="along the floor, in metres"
    ),
    flag("--force", action="store_true", help="answer even if it misses, fails or pulls too hard"),
    JSON,
)
def aim(arguments: argparse.Namespace) -> Done:
    from pipeline.params import load
    from sling2sim2real.cli import safety
    from sling2sim2real.cli.aim import aim, why_refused
    from sling2sim2real.cli.pose import posed

    params, band = load(), arguments.band
    answer = aim(params, band, arguments.method, arguments.target)
    if not arguments.force and (why := why_refused(answer)):
        safety.tell(warning for warning in answer["warnings"] if warning.what != why)
        refusal = f"no draw for {arguments.target:g} m: {why}; --force answers all the same"
        if not arguments.json:
            raise Refusal(refusal)
        summary = {"refused": refusal, "warnings": safety.as_json(answer["warnings"])}
        return kinds.shown(summary, True), REFUSED
    return safety.shown(posed(answer, params, band), arguments.json)


@command(
    "learn from a launch that you measured: identify and train again with it",
    "--band band1 --draw=-0.30,-0.17 --landing 2.21",
    BAND,
    flag("--draw", **(DRAW[1] | {"required": False})),
    flag("--landing", type=kinds.landing, metavar="M", help="along the floor, in metres"),
    flag(
        "--draw-error",
        type=kinds.draw_error,
        metavar="M",
        help="standard deviation of the draw, in metres; default trials.actuation_error",
    ),
    METHOD,
    flag("--again", action="store_true", help="it equals one that is there, and is one more"),
    flag("--undo", action="store_true", help="take the band's last launch out instead"),
    flag("--no-run", action="store_true", help="only write the launch down, or take it out"),
    JSON,
)
def observe(arguments: argparse.Namespace) -> Done:
    from pipeline.params import load
    from sling2sim2real.cli import observe

    of_launch = {"--draw": arguments.draw, "--landing": arguments.landing}
    if arguments.undo:
        of_launch |= {"--draw-error": arguments.draw_error, "--again": arguments.again or None}
        if given := [name for name, value in of_launch.items() if value is not None]:
            arguments.refuse(f"--undo takes the last launch out, so it takes no {given[0]}")
    elif missing := [name for name, value in of_launch.items() if value is None]:
        arguments.refuse(f"the following arguments are required: {', '.join(missing)}")
    run = not arguments.no_run
    if arguments.undo:
        answer = observe.undo(load(), arguments.band, arguments.method, run=run)
    else:
        answer = observe.observe(
            load(),
            arguments.band,
            arguments.method,
            arguments.draw,
            arguments.landing,
            error=arguments.draw_error,
            again=arguments.again,
            run=run,
        )
    return kinds.shown(answer, True) if arguments.json else observe.shown(answer)


@command(
    "write an identified band for another engine, matched to the calibrated simulation",
    "--band band1 --to mjcf",
    BAND,
    METHOD,
    flag(
        "--to",
        required=True,
        choices=ENGINES,
        help="MuJoCo's XML, numbers and a loader for Newton, PhysX's USD",
    ),
    flag("--out", type=Path, metavar="FOLDER", help="default data/exports/<band>/<target>"),
    JSON,
)
def export(arguments: argparse.Namespace) -> Done:
    from pipeline.params import load
    from sling2sim2real.cli.export import export_of_run, shown

    band, method = arguments.band, arguments.method
    folder, card = export_of_run(load(), band, method, arguments.to, arguments.out)
    return kinds.shown(card, True) if arguments.json else shown(folder, card)


@command(
    "take a band of your own out of the project: recordings, results, card",
    "orange",
    flag("name", metavar="NAME", help="band of params.yaml that was recorded"),
    flag("--yes", action="store_true", help="do not ask"),
)
def remove_band(arguments: argparse.Namespace) -> Done:
    from sling2sim2real.cli.remove_band import ask, remove_band

    return remove_band(arguments.name, (lambda lines: True) if arguments.yes else ask)


@command(
    "give values of params.yaml back what the last commit has",
    "optimizer.k_top",
    flag("keys", nargs="*", metavar="KEY", help="default: all but your bands, setup and plan"),
)
def reset(arguments: argparse.Namespace) -> Done:
    from sling2sim2real.cli.reset import reset

    return "\n".join(reset(arguments.keys)) or "params.yaml is as committed there: nothing to do"


if __name__ == "__main__":
    main()
