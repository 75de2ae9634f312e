"""Developers' commands: the only ones that import validation/, which proves and measures."""

from __future__ import annotations

import argparse
from pathlib import Path

from app.command_line import JSON, Done, command, flag


@command(
    "compare the simulator with closed forms, finer steps and other engines",
    "--device cpu",
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
    "measure rollouts and launches per second",
    "--law rubber --json",
    flag("--device", help="cpu (default), cuda:0, cuda:0,cuda:1, or cuda: all GPUs"),
    flag(
        "--scaling",
        nargs="?",
        const="",
        metavar="BAND",
        help="several GPUs against one, on a band's recording or on the yardstick",
    ),
    flag("--peers", action="store_const", const=True, help="MuJoCo and Newton beside ours"),
    flag("--recording", type=Path, metavar="FILE.mcap", help="time how a recording becomes clouds"),
    flag("--methods", nargs="*", metavar="METHOD", help="time searches: all, or these methods"),
    flag("--budget", choices=("laptop", "large"), help="of --methods, --scaling; default laptop"),
    flag("--law", choices=("neo_hookean", "rubber"), help="of the band; default neo_hookean"),
    JSON,
)
def bench(arguments: argparse.Namespace) -> Done:
    from validation.benchmarks.bench import bench, requested

    try:
        what = requested(arguments)
    except argparse.ArgumentTypeError as error:
        return arguments.refuse(str(error))  # which exits
    return bench(arguments, what)


@command(
    "say of which code each JSON under reports/ is, and whether it meets what it asks",
    "--json",
    JSON,
)
def figures(arguments: argparse.Namespace) -> Done:
    from app.flow.graph import outdated
    from validation.figures import as_json, listed, shown

    committed = listed(Path.cwd(), outdated)
    return as_json(committed) if arguments.json else shown(committed)
