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
    "run stale stages in parallel, as a flow of Prefect's",
    "theta@band1-sling2sim2real --workers 2",
    flag("targets", nargs="*", metavar="STAGE", help="or a step for all its stages; default: all"),
    flag(
        "--workers",
        type=kinds.count,
        metavar="N",
        help="stages at a time; default: as many as cores, 16 on a cluster",
    ),
    flag("--gpus", type=kinds.count, metavar="N", help="GPU stages at a time; default 1"),
    flag("--dask", type=kinds.address, metavar="ADDRESS", help="of a scheduler: its workers run"),
    flag("--slurm", type=Path, metavar="FILE", help="of SLURM jobs, which run"),
)
def flow(arguments: argparse.Namespace) -> Done:
    from pipeline.flow.run import run
    from pipeline.params import load

    if Path("params.yaml").exists():
        load()  # a mistake in it is reported once, and not by each of them
    options = {name: getattr(arguments, name) for name in ("workers", "gpus", "dask", "slurm")}
    return run(Path.cwd(), arguments.targets, **options)


@command(
    "serve the Prefect UI, with recent and present runs, for this machine alone",
    "--port 4201",
    flag("--port", type=kinds.count, metavar="N", help="default 4200"),
)
def ui(arguments: argparse.Namespace) -> Done:
    from pipeline.flow.server import PORT, serve

    return serve(Path.cwd(), arguments.port or PORT)
