"""The `sling` command: a table of commands, each a small function that calls the library.

Run `sling --help`, or `sling launch --help`. A user's mistake is one line on stderr and exit
status 1; a command line that cannot be understood is exit status 2.
"""

from __future__ import annotations

import argparse
import contextlib
import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

from app import __version__
from app.arguments import address, count, draw, finite, number, positive, shown, target
from pipeline.base.errors import UserError
from pipeline.base.layout import Layout
from stages.start import note_unmounted, run

DEFAULT_METHOD = "least_squares"
FURTHEST_DRAW = 2.0  # m
Done = str | tuple[str, int]  # what to print, and an exit status that is not 0
COMMANDS: dict[str, tuple[str, tuple, Callable[[argparse.Namespace], Done]]] = {}


def main() -> None:
    """Entry point of the console script."""
    arguments = parser().parse_args()
    run(lambda: execute(arguments))


def execute(arguments: argparse.Namespace) -> int:
    """Run a command and print its text; whatever a library prints goes to stderr."""
    with contextlib.redirect_stdout(sys.stderr):
        done = arguments.command(arguments)
    text, status = done if isinstance(done, tuple) else (done, 0)
    print(text)
    return status


class Parser(argparse.ArgumentParser):
    """A command line that cannot be understood is one line too."""

    def error(self, message: str) -> NoReturn:
        if "--draw: expected one argument" in message:
            message += ", joined by = because it begins with -: --draw=-0.30,-0.17"
        self.exit(2, f"error: {message} (see `{self.prog} --help`)\n")


def parser() -> argparse.ArgumentParser:
    """The whole command line."""
    top = Parser(
        prog="sling", description="From a recording of an elastic band to a slingshot policy."
    )
    top.add_argument("--version", action="version", version=f"sling2sim2real {__version__}")
    commands = top.add_subparsers(required=True, metavar="COMMAND")
    for name, (help, flags, function) in COMMANDS.items():
        sub = commands.add_parser(name, help=help, description=f"{help}.")
        for names, options in flags:
            sub.add_argument(*names, **options)
        sub.set_defaults(command=function, refuse=sub.error)
    return top


def flag(*names: str, **options) -> tuple:
    """An argument of a command, as argparse's `add_argument` takes it."""
    return names, options


def command(help: str, *flags: tuple) -> Callable:
    """Put a function into the table, under its own name."""

    def put(function: Callable) -> Callable:
        name = function.__name__.replace("_", "-")
        COMMANDS[name] = help, flags, function
        return function

    return put


JSON = flag("--json", action="store_true")


@command(
    "identify a band from its recordings, train its policy, write its card",
    flag("recordings", type=Path, nargs="*", metavar="FILE.mcap", help="of one band"),
    flag("--mass", type=positive, metavar="KG", help="of the band, on a scale"),
    flag("--name", metavar="NAME", help="of the band; default from the first file's name"),
    flag("--diameter", type=positive, metavar="M", help="of its section, default 0.010"),
    flag("--rest-length", type=positive, metavar="M", help="between the clamps, default 0.52"),
    flag("--launches", type=Path, metavar="CSV", help="measured launches, as evidence"),
    JSON,
)
def fit(arguments: argparse.Namespace) -> Done:
    from app.fit.fit import NewBand, fit
    from app.fit.screen import shown as screen

    band = NewBand(arguments.mass, arguments.diameter, arguments.rest_length)
    card = fit(arguments.recordings, arguments.name, band, arguments.launches)
    return shown(card, True) if arguments.json else screen(card)


@command(
    "check recordings and add their band to params.yaml",
    flag("name", help="what to call the band: small letters, digits and _"),
    flag("--recording", type=Path, required=True, nargs="+", metavar="FILE.mcap"),
    flag("--mass", type=positive, required=True, metavar="KG", help="on a scale"),
    flag("--diameter", type=positive, default=0.010, metavar="M", help="default 0.010"),
    flag(
        "--rest-length", type=positive, default=0.52, metavar="M", help="between the clamps, 0.52"
    ),
)
def add_band(arguments: argparse.Namespace) -> Done:
    from app.preflight.add_band import add_band

    return add_band(
        arguments.name,
        arguments.recording,
        mass=arguments.mass,
        diameter=arguments.diameter,
        rest_length=arguments.rest_length,
    )


@command(
    "check further recordings of a band and add them to it",
    flag("--band", required=True),
    flag("recordings", type=Path, nargs="+", metavar="FILE.mcap"),
)
def add_recording(arguments: argparse.Namespace) -> Done:
    from app.preflight.recordings import add_recording

    return add_recording(arguments.band, arguments.recordings)


@command(
    "say what is in a recording, what is missing, whether it can be used",
    flag("recording", type=Path, metavar="FILE.mcap"),
    flag("--band", metavar="NAME", help="of params.yaml: its diameter and rest length"),
    flag("--diameter", type=positive, metavar="M", help="else 0.010 is assumed"),
    flag(
        "--rest-length", type=positive, metavar="M", help="between the clamps; else 0.52 is assumed"
    ),
    flag("--pull", type=count, metavar="N", help="of several; default the first that can be used"),
    flag("--sheet", type=Path, metavar="OUT.png", help="six moments, force, coverage"),
    flag("--rrd", type=Path, metavar="OUT.rrd", help="one timeline for Rerun's viewer"),
    JSON,
)
def check(arguments: argparse.Namespace) -> Done:
    from app.preflight.command import check
    from pipeline.params import load

    return check(
        arguments.recording,
        load(),
        band=arguments.band,
        diameter=arguments.diameter,
        rest_length=arguments.rest_length,
        as_json=arguments.json,
        sheet=arguments.sheet,
        rrd=arguments.rrd,
        pull=arguments.pull,
    )


@command(
    "plan the pull that a robot is to record, and check it against limits",
    flag("--band", required=True),
    flag("--draw", type=draw, metavar="Y,Z", help="frame O [m]; default plan.draw"),
    flag("--theta", type=Path, metavar="FILE", help="says the force to hold the draw"),
    flag(
        "--recording", type=Path, metavar="FILE.mcap", help="earlier one: robot's base, and force"
    ),
    flag("--pulls", type=count, default=1, metavar="N", help="one after the other, default 1"),
    flag("--out", type=Path, metavar="FOLDER", help="default data/plans/<band>"),
    flag("--rate", type=positive, default=100.0, metavar="HZ", help="of the CSV, 100"),
    JSON,
)
def plan(arguments: argparse.Namespace) -> Done:
    from app.plan.plan import plan_recording
    from pipeline.params import load

    plan = plan_recording(
        load(),
        arguments.band,
        draw=arguments.draw,
        theta=arguments.theta,
        recording=arguments.recording,
        pulls=arguments.pulls,
    )
    files = plan.write(arguments.out or Layout().plans(arguments.band), arguments.rate)
    return plan.to_json(files) if arguments.json else plan.to_text(files)


@command(
    "simulate one launch with identified or hand-written parameters",
    flag("--theta", type=Path, required=True, metavar="FILE", help="data/theta/...json"),
    flag("--band", required=True),
    flag("--draw", type=draw, required=True, metavar="Y,Z", help="frame O [m]: --draw=-0.30,-0.17"),
    JSON,
)
def launch(arguments: argparse.Namespace) -> Done:
    from app.aim import pull_and_pause
    from pipeline.params import expect_known, load
    from pipeline.sling.launch import launch
    from pipeline.sling.theta import calibrated, load_theta, vector

    params = load()
    expect_known(params, "band", arguments.band)
    floor = -params.setup.fork_height
    if arguments.draw[1] < floor:
        raise UserError(
            f"--draw: z = {arguments.draw[1]:g} m lies below the floor, z = {floor:g} m"
            " (setup.fork_height in params.yaml)"
        )
    if math.hypot(*arguments.draw) > FURTHEST_DRAW:
        raise UserError(f"--draw: must be at most {FURTHEST_DRAW:g} m from the fork")
    content = load_theta(arguments.theta, arguments.band)
    note_unmounted(arguments.band)
    sling = calibrated(params, arguments.band, content)
    result = launch(sling, vector(content), arguments.draw, max_force=params.setup.max_force)
    answer = {
        "landing_y_m": finite(result.landing_y[0]),
        "speed_m_s": finite(result.speed[0]),
        "hold_force_n": finite(result.hold_force[0]),
        **pull_and_pause(params, content),
        "failure": result.failure[0],
    }
    return shown(answer, arguments.json)


@command(
    "say where to draw for a target, by the trained policy",
    flag("--band", required=True),
    flag("--method", default=DEFAULT_METHOD, help=f"default {DEFAULT_METHOD}"),
    flag("--target", type=target, required=True, metavar="M", help="along the floor"),
    JSON,
)
def aim(arguments: argparse.Namespace) -> Done:
    from app.aim import aim
    from app.pose import posed
    from pipeline.params import load

    params, band = load(), arguments.band
    answer = aim(params, band, arguments.method, arguments.target)
    answer = posed(answer, params, band)
    if arguments.json:
        return shown(answer, True)
    warnings = answer.pop("warnings")
    return "\n".join([shown(answer, False), *(f"warning: {line}" for line in warnings)])


@command(
    "tell a launch that you measured, and identify and train anew with it",
    flag("--band", required=True),
    flag("--draw", type=draw, required=True, metavar="Y,Z", help="frame O [m]: --draw=-0.30,-0.17"),
    flag("--landing", type=positive, required=True, metavar="M", help="along the floor"),
    flag("--draw-error", type=number, metavar="M", help="standard deviation; else a command's"),
    flag("--method", default=DEFAULT_METHOD, help=f"default {DEFAULT_METHOD}"),
    flag("--no-run", action="store_true", help="only write it down"),
    JSON,
)
def observe(arguments: argparse.Namespace) -> Done:
    from app import observe
    from pipeline.params import load

    answer = observe.observe(
        load(),
        arguments.band,
        arguments.method,
        arguments.draw,
        arguments.landing,
        error=arguments.draw_error,
        run=not arguments.no_run,
    )
    return shown(answer, True) if arguments.json else observe.shown(answer, arguments.landing)


@command(
    "run the stages that are stale in parallel, seen in the Prefect UI",
    flag("--workers", type=count, metavar="N", help="stages at a time; default all cores"),
    flag("--gpus", type=count, metavar="N", help="GPU stages at a time; default 1"),
    flag("--cluster", type=address, metavar="ADDRESS", help="Dask scheduler: tcp://HOST:8786"),
)
def flow(arguments: argparse.Namespace) -> Done:
    from app.flow import run as flow

    root, workers, gpus = Path.cwd(), arguments.workers, arguments.gpus
    if arguments.cluster is None:
        return flow.run(root, workers=workers, gpus=gpus)
    from app.cluster.cluster import Cluster

    with Cluster(root, arguments.cluster) as cluster:
        return flow.run(
            root,
            workers=workers or cluster.slots,
            gpus=gpus or cluster.slots,
            place=cluster.run_stage,
        )


@command(
    "serve the Prefect UI of this project, on this machine's loopback",
    flag("--port", type=count, metavar="N", help="default 4200"),
)
def ui(arguments: argparse.Namespace) -> Done:
    from app.flow.server import serve

    return serve(Path.cwd(), arguments.port)


@command(
    "hold the simulator against closed forms, finer steps, other engines",
    flag("--device", default="cpu", help="cpu (default) or cuda:0"),
)
def verify(arguments: argparse.Namespace) -> Done:
    from pipeline.params import load
    from validation.engines import checks as peers
    from validation.simulator.verification import summary, verify

    text, missed = summary(
        verify(load(), arguments.device, extra={"against MuJoCo": peers.section})
    )
    return text, int(missed > 0)


@command(
    "measure rollouts and launches a second",
    flag("--device", help="cpu (default), cuda:0, cuda:0,cuda:1, or cuda: all GPUs"),
    flag(
        "--scaling",
        nargs="?",
        const="",
        metavar="BAND",
        help="several GPUs against one, on a band's recording or the yardstick",
    ),
    flag("--peers", action="store_const", const=True, help="MuJoCo and Newton beside ours"),
    flag("--recording", type=Path, metavar="FILE.mcap", help="time how it becomes clouds"),
    flag("--methods", nargs="*", metavar="METHOD", help="time searches, all or of these methods"),
    flag("--budget", choices=("laptop", "large"), help="of --methods, default laptop"),
    flag("--law", choices=("neo_hookean", "rubber"), help="of the band, default neo_hookean"),
    JSON,
)
def bench(arguments: argparse.Namespace) -> Done:
    from app.bench import asked, bench

    try:
        what = asked(arguments)
    except argparse.ArgumentTypeError as error:
        arguments.refuse(str(error))
    return bench(arguments, what)


if __name__ == "__main__":
    main()
