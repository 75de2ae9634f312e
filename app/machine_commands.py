"""Commands about this machine: what runs on it, how exactly and how fast."""

from __future__ import annotations

import argparse
from pathlib import Path

from app import arguments as kinds
from app.command_line import JSON, Done, command, flag


@command(
    "run all stale stages in parallel, and show them in the Prefect UI",
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
        load()  # a mistake in it is told once, and not by each of them
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
    "serve the Prefect UI of this project, for this machine alone",
    "--port 4201",
    flag("--port", type=kinds.count, metavar="N", help="default 4200"),
)
def ui(arguments: argparse.Namespace) -> Done:
    from app.flow.server import serve

    return serve(Path.cwd(), arguments.port)


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
    from app.bench import asked, bench

    try:
        what = asked(arguments)
    except argparse.ArgumentTypeError as error:
        arguments.refuse(str(error))
    return bench(arguments, what)


@command(
    "say of which code each JSON under reports/ is, and whether it meets what it asks",
    "--json",
    JSON,
)
def figures(arguments: argparse.Namespace) -> Done:
    from app.figures import as_json, listed, shown

    found = listed(Path.cwd())
    return as_json(found) if arguments.json else shown(found)
