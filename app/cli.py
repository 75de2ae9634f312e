"""The `sling` command: one small function a subcommand, each calling the library.

Run `sling --help`, or `sling launch --help`. A user's mistake is one line on stderr and exit
status 1; a command line that cannot be understood is exit status 2.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import math
import sys
from pathlib import Path
from typing import NoReturn

from pipeline.base.errors import UserError
from pipeline.base.layout import Layout
from stages.start import note_unmounted, run

DEFAULT_METHOD = "sling2sim2real_taut"
FURTHEST_TARGET, FURTHEST_DRAW = 100.0, 2.0  # m


def main() -> None:
    """Entry point of the console script."""
    arguments = parser().parse_args()
    run(lambda: execute(arguments))


def execute(arguments: argparse.Namespace) -> int:
    """Run a subcommand and print its text; whatever a library prints goes to stderr."""
    with contextlib.redirect_stdout(sys.stderr):
        text, status = arguments.command(arguments)
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
    commands = top.add_subparsers(required=True, metavar="COMMAND")

    def command(function, help: str) -> argparse.ArgumentParser:
        name = function.__name__.removeprefix("run_").replace("_", "-")
        sub = commands.add_parser(name, help=help, description=f"{help}.")
        sub.set_defaults(command=function)
        return sub

    sub = command(run_add_band, "check a recording and add its band to params.yaml")
    sub.add_argument("name", help="what to call the band: small letters, digits and _")
    sub.add_argument("--recording", type=Path, required=True, metavar="FILE.mcap")
    sub.add_argument("--mass", type=positive, required=True, metavar="KG", help="on a scale")
    sub.add_argument("--diameter", type=positive, default=0.010, metavar="M", help="default 0.010")
    sub.add_argument(
        "--rest-length", type=positive, default=0.52, metavar="M", help="between the clamps, 0.52"
    )

    sub = command(run_check, "say what is in a recording, what is missing, whether it can be used")
    sub.add_argument("recording", type=Path, metavar="FILE.mcap")
    sub.add_argument("--band", metavar="NAME", help="of params.yaml: its diameter and rest length")
    sub.add_argument("--diameter", type=positive, metavar="M", help="else 0.010 is assumed")
    sub.add_argument(
        "--rest-length", type=positive, metavar="M", help="between the clamps; else 0.52 is assumed"
    )
    sub.add_argument("--sheet", type=Path, metavar="OUT.png", help="six moments, force, coverage")
    sub.add_argument("--rrd", type=Path, metavar="OUT.rrd", help="one timeline for Rerun's viewer")
    sub.add_argument("--json", action="store_true")

    sub = command(run_plan, "plan the pull that a robot is to record, and check it against limits")
    sub.add_argument("--band", required=True)
    sub.add_argument("--draw", type=draw, metavar="Y,Z", help="frame O [m]; default plan.draw")
    sub.add_argument("--theta", type=Path, metavar="FILE", help="says the force to hold the draw")
    sub.add_argument(
        "--recording", type=Path, metavar="FILE.mcap", help="earlier one: robot's base, and force"
    )
    sub.add_argument("--out", type=Path, metavar="FOLDER", help="default data/plans/<band>")
    sub.add_argument("--rate", type=positive, default=100.0, metavar="HZ", help="of the CSV, 100")
    sub.add_argument("--json", action="store_true")

    sub = command(run_launch, "simulate one launch with identified or hand-written parameters")
    sub.add_argument("--theta", type=Path, required=True, metavar="FILE", help="data/theta/...json")
    sub.add_argument("--band", required=True)
    sub.add_argument(
        "--draw", type=draw, required=True, metavar="Y,Z", help="frame O [m]: --draw=-0.30,-0.17"
    )
    sub.add_argument("--json", action="store_true")

    sub = command(run_aim, "say where to draw for a target, by the trained policy")
    sub.add_argument("--band", required=True)
    sub.add_argument("--method", default=DEFAULT_METHOD, help=f"default {DEFAULT_METHOD}")
    sub.add_argument("--target", type=target, required=True, metavar="M", help="along the floor")
    sub.add_argument("--robust", action="store_true", help="by the method's second policy")
    sub.add_argument("--json", action="store_true")

    sub = command(run_flow, "run the stages that are stale in parallel, seen in the Prefect UI")
    sub.add_argument(
        "--workers", type=count, metavar="N", help="stages at a time; default all cores"
    )
    sub.add_argument("--gpus", type=count, metavar="N", help="GPU stages at a time; default 1")
    sub.add_argument("--cluster", metavar="ADDRESS", help="of a Dask scheduler: tcp://HOST:8786")

    sub = command(run_ui, "serve the Prefect UI of this project, on this machine's loopback")
    sub.add_argument("--port", type=count, metavar="N", help="default 4200")

    sub = command(run_verify, "hold the simulator against closed forms, finer steps, other engines")
    sub.add_argument("--device", default="cpu", help="cpu (default) or cuda:0")

    sub = command(run_bench, "measure rollouts and launches a second")
    sub.add_argument(
        "--device", default="cpu", help="cpu (default), cuda:0, cuda:0,cuda:1, or cuda: all GPUs"
    )
    sub.add_argument(
        "--scaling",
        nargs="?",
        const="",
        metavar="BAND",
        help="several GPUs against one, on a band's recording or the yardstick",
    )
    sub.add_argument("--peers", action="store_true", help="MuJoCo and Newton beside ours")
    sub.add_argument(
        "--recording", type=Path, metavar="FILE.mcap", help="time how it becomes clouds"
    )
    sub.add_argument(
        "--methods",
        nargs="*",
        metavar="METHOD",
        help="time searches, all or of these methods",
    )
    sub.add_argument("--budget", choices=("laptop", "large"), default="laptop", help="of --methods")
    sub.add_argument("--json", action="store_true")
    return top


def positive(text: str) -> float:
    """A finite number above 0."""
    value = number(text)
    if value <= 0:
        raise argparse.ArgumentTypeError(f"must be above 0, got {text}")
    return value


def count(text: str) -> int:
    """A whole number above 0."""
    if not (text.isascii() and text.isdigit() and int(text) > 0):
        raise argparse.ArgumentTypeError(f"must be a whole number above 0, got {text!r}")
    return int(text)


def number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"must be a number, got {text!r}")
    return value


def target(text: str) -> float:
    """A distance along the floor that a slingshot may be asked for [m]."""
    value = positive(text)
    if value > FURTHEST_TARGET:
        raise argparse.ArgumentTypeError(f"must be at most {FURTHEST_TARGET:g} m, got {text}")
    return value


def draw(text: str) -> tuple[float, float]:
    """A drawn position (y, z), frame O [m]."""
    parts = text.split(",")
    if len(parts) != 2:
        raise argparse.ArgumentTypeError(f"must be Y,Z such as --draw=-0.30,-0.17, got {text!r}")
    y, z = map(number, parts)
    if y >= 0:
        raise argparse.ArgumentTypeError(f"y must be below 0 (behind the fork), got {y:g}")
    return y, z


def shown(content: dict, as_json: bool) -> tuple[str, int]:
    """A flat result as one JSON object, or one line an entry, with exit status 0."""
    if as_json:
        return json.dumps(content, allow_nan=False), 0
    width = max(map(len, content))
    return "\n".join(f"{key:{width}}  {readable(value)}" for key, value in content.items()), 0


def readable(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list):
        return " ".join(map(readable, value)) or "-"
    return "-" if value is None else str(value)


def run_add_band(arguments: argparse.Namespace) -> tuple[str, int]:
    from app.preflight.add_band import add_band

    done = add_band(
        arguments.name,
        arguments.recording,
        mass=arguments.mass,
        diameter=arguments.diameter,
        rest_length=arguments.rest_length,
    )
    return done, 0


def run_check(arguments: argparse.Namespace) -> tuple[str, int]:
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
    )


def run_plan(arguments: argparse.Namespace) -> tuple[str, int]:
    from app.plan.plan import plan_recording
    from pipeline.params import load

    plan = plan_recording(
        load(),
        arguments.band,
        draw=arguments.draw,
        theta=arguments.theta,
        recording=arguments.recording,
    )
    files = plan.write(arguments.out or Layout().plans(arguments.band), arguments.rate)
    return plan.to_json(files) if arguments.json else plan.to_text(files), 0


def run_launch(arguments: argparse.Namespace) -> tuple[str, int]:
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
    return shown(
        {
            "landing_y_m": finite(result.landing_y[0]),
            "speed_m_s": finite(result.speed[0]),
            "hold_force_n": finite(result.hold_force[0]),
            "failure": result.failure[0],
        },
        arguments.json,
    )


def run_aim(arguments: argparse.Namespace) -> tuple[str, int]:
    from app.aim import aim
    from app.pose import posed
    from pipeline.params import load

    params, band = load(), arguments.band
    answer = aim(params, band, arguments.method, arguments.target, robust=arguments.robust)
    answer = posed(answer, params, band)
    if arguments.json:
        return shown(answer, True)
    warnings = answer.pop("warnings")
    text, status = shown(answer, False)
    return "\n".join([text, *(f"warning: {line}" for line in warnings)]), status


def run_flow(arguments: argparse.Namespace) -> tuple[str, int]:
    from app.flow import run as flow

    root, workers, gpus = Path.cwd(), arguments.workers, arguments.gpus
    if arguments.cluster is None:
        return flow.run(root, workers=workers, gpus=gpus), 0
    from app.cluster.cluster import Cluster

    with Cluster(root, arguments.cluster) as cluster:
        done = flow.run(
            root,
            workers=workers or cluster.slots,
            gpus=gpus or cluster.slots,
            place=cluster.run_stage,
        )
    return done, 0


def run_ui(arguments: argparse.Namespace) -> tuple[str, int]:
    from app.flow.server import serve

    return serve(Path.cwd(), arguments.port), 0


def run_verify(arguments: argparse.Namespace) -> tuple[str, int]:
    from pipeline.params import load
    from validation.engines import checks as peers
    from validation.simulator.report import summary, verify

    text, missed = summary(
        verify(load(), arguments.device, extra={"against MuJoCo": peers.section})
    )
    return text, int(missed > 0)


def run_bench(arguments: argparse.Namespace) -> tuple[str, int]:
    from pipeline.params import load
    from validation.benchmarks.simulator import bench, environment, table

    if arguments.recording:
        from validation.benchmarks import recording

        result = recording.bench_recording(arguments.recording, load())
        if arguments.json:
            return json.dumps(environment("cpu", "sling bench --recording --json") | result), 0
        return recording.table(result), 0
    if arguments.scaling is not None:
        from validation.benchmarks import scaling as several

        band, device, size = arguments.scaling, arguments.device, arguments.budget
        method = (arguments.methods or ["sling2sim2real"])[0]
        result = several.bench_scaling(load(), device, band or None, method, size)
        if arguments.json:
            command = f"sling bench --scaling {band} --methods {method} --budget {size}"
            command += f" --device {device} --json"
            return json.dumps(environment(device, command) | result), 0
        return several.table(result), 0
    if arguments.methods is not None:
        from validation.benchmarks import methods

        result = methods.bench_methods(
            load(), arguments.device, arguments.budget, arguments.methods
        )
        if arguments.json:
            command = " ".join(["sling bench --methods", *arguments.methods])
            command += f" --budget {arguments.budget} --device {arguments.device} --json"
            return json.dumps(environment(arguments.device, command) | result), 0
        return methods.table(result), 0
    if arguments.peers:
        from validation.benchmarks import engines as peers

        entries = peers.bench_peers(load(), arguments.device)
        if arguments.json:
            command = f"sling bench --peers --device {arguments.device} --json"
            return json.dumps(environment(arguments.device, command) | {"peers": entries}), 0
        return peers.table(entries), 0
    result = bench(load(), device=arguments.device)
    if arguments.json:
        return json.dumps(environment(arguments.device) | result), 0
    return table(result), 0


def finite(value: float) -> float | None:
    """JSON has no NaN: what is not known is null."""
    return float(value) if math.isfinite(value) else None
