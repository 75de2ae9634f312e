"""`sling flow`: run stale stages in parallel, as a flow of Prefect's.

    python -m pipeline.flow [STAGE ...] [--workers N] [--dask ADDRESS] [--slurm FILE]

Run in the project's folder. A STAGE is one of `dvc stage list`, or a step for all its stages.
"""

from __future__ import annotations

from pathlib import Path

from pipeline.flow import dvc, server
from pipeline.params import load
from sling2sim2real.base import errors
from sling2sim2real.base.disk import expect_ready
from sling2sim2real.cli import arguments as kinds
from sling2sim2real.cli.command_line import Parser


def parser() -> Parser:
    """Command line of `sling flow`."""
    parser = Parser(prog="sling flow", description=(__doc__ or "").partition("\n")[0])
    add = parser.add_argument
    add("targets", nargs="*", metavar="STAGE", help="or a step for all its stages; default: all")
    add("--workers", type=kinds.count, metavar="N", help="at a time; default: cores, or 16 away")
    add("--dask", type=kinds.address, metavar="ADDRESS", help="of a scheduler: its workers run")
    add("--slurm", type=Path, metavar="FILE", help="of SLURM jobs, which run")
    return parser


def main() -> None:
    given, root = parser().parse_args(), Path.cwd()
    if (root / "params.yaml").exists():
        load()  # a mistake is reported once, and not by each stage
    expect_ready(root)
    graph = dvc.stale(root, given.targets)
    if not graph:
        print("nothing is stale")
        return
    server.configure(root)
    from pipeline.flow.flow import run  # Prefect reads its settings when it is imported

    print(run(root, graph, given.workers, given.dask, given.slurm))


if __name__ == "__main__":
    errors.run(main)
