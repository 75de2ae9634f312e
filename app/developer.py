"""Developers' commands: the only ones that import validation/, which proves and measures."""

from __future__ import annotations

import argparse

from app import arguments as kinds
from app.command_line import JSON, Done, command, flag
from pipeline.simulator.rubber import NEO_HOOKEAN, RUBBER

LAWS = NEO_HOOKEAN, RUBBER


@command(
    "compare the simulator with closed forms, finer steps and other engines",
    "--device cpu",
    flag("--device", default="cpu", help="cpu (default) or cuda:0"),
)
def verify(arguments: argparse.Namespace) -> Done:
    from pipeline.params import load
    from validation.simulator.verification import summary, verify

    text, missed = summary(verify(load(), arguments.device))
    return text, int(missed > 0)


@command(
    "measure rollouts and launches per second",
    "--law rubber --json",
    flag("--device", default="cpu", help="cpu (default), cuda:0, cuda:0,cuda:1, or cuda: all GPUs"),
    flag("--law", choices=LAWS, default=LAWS[0], help=f"of the band; default {LAWS[0]}"),
    JSON,
)
def bench(arguments: argparse.Namespace) -> Done:
    from pipeline.params import load
    from validation.benchmarks import throughput
    from validation.environment import environment

    device, law = arguments.device, arguments.law
    result = throughput.bench(load(), device, law)
    if not arguments.json:
        return throughput.table(result)
    return kinds.shown(
        environment(device, f"sling bench --law {law} --device {device} --json") | result, True
    )
