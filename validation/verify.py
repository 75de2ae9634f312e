"""`sling verify`: compare the simulator with closed forms, finer steps and other engines.

    python -m validation.verify [--device cpu]

Run in the project's folder; writes reports/simulator.md. Exit status 1 if a limit is not kept.
"""

from __future__ import annotations

from pipeline.params import load
from sling2sim2real.base import errors
from sling2sim2real.cli.command_line import Parser
from validation.simulator.verification import summary, verify


def parser() -> Parser:
    """Command line of `sling verify`."""
    parser = Parser(prog="sling verify", description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--device", default="cpu", help="cpu (default) or cuda:0")
    return parser


def main() -> int:
    text, missed = summary(verify(load(), parser().parse_args().device))
    print(text)
    return int(missed > 0)


if __name__ == "__main__":
    errors.run(main)
