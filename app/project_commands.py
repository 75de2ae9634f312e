"""Commands that take back a band or values of params.yaml, and that run and show stages."""

from __future__ import annotations

import argparse
from pathlib import Path

from app import arguments as kinds
from app.command_line import Done, command, flag


@command(
    "take a band of your own out of the project: recordings, results, card",
    "orange",
    flag("name", metavar="NAME", help="band of params.yaml that was recorded"),
    flag("--yes", action="store_true", help="do not ask"),
)
def remove_band(arguments: argparse.Namespace) -> Done:
    from app.remove_band import ask, remove_band

    return remove_band(arguments.name, (lambda lines: True) if arguments.yes else ask)


@command(
    "give values of params.yaml back what the last commit has",
    "optimizer.k_top",
    flag("keys", nargs="*", metavar="KEY", help="default: all but your bands, setup and plan"),
)
def reset(arguments: argparse.Namespace) -> Done:
    from app.reset import reset

    return "\n".join(reset(arguments.keys)) or "params.yaml is as committed there: nothing to do"


@command(
    "run all stale stages in parallel",
    "--workers 2",
    flag(
        "--workers",
        type=kinds.count,
        metavar="N",
        help="stages at a time; default: as many as cores",
    ),
    flag("--gpus", type=kinds.count, metavar="N", help="GPU stages at a time; default 1"),
    flag("--cluster", type=kinds.address, metavar="ADDRESS", help="Dask, as tcp://10.0.0.5:8786"),
)
def flow(arguments: argparse.Namespace) -> Done:
    from app.flow import run as flow
    from pipeline.params import load

    if Path("stages").is_dir():  # whose scripts read params.yaml
        load()  # a mistake in it is reported once, and not by each of them
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
    "serve the Prefect UI, with recent and present runs, for this machine alone",
    "--port 4201",
    flag("--port", type=kinds.count, metavar="N", help="default 4200"),
)
def ui(arguments: argparse.Namespace) -> Done:
    from app.flow.server import serve

    return serve(Path.cwd(), arguments.port)
