"""`sling ui`: serve the Prefect UI, with past and present runs, for this machine alone.

python -m pipeline.flow.ui [--port N]
"""

from __future__ import annotations

from pathlib import Path

from pipeline.flow.server import PORT, serve
from sling2sim2real.base import errors
from sling2sim2real.cli import arguments as kinds
from sling2sim2real.cli.command_line import Parser


def parser() -> Parser:
    """Command line of `sling ui`."""
    parser = Parser(prog="sling ui", description=(__doc__ or "").partition("\n")[0])
    parser.add_argument(
        "--port", type=kinds.count, metavar="N", default=PORT, help=f"default {PORT}"
    )
    return parser


def main() -> None:
    print(serve(Path.cwd(), parser().parse_args().port))


if __name__ == "__main__":
    errors.run(main)
