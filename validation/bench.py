"""`sling bench`: measure rollouts and launches per second.

python -m validation.bench [--device cpu] [--law rubber] [--json]
"""

from __future__ import annotations

import json

from pipeline.params import load
from sling2sim2real.base import errors
from sling2sim2real.cli.command_line import Parser
from sling2sim2real.simulator.rubber import NEO_HOOKEAN, RUBBER
from validation import throughput
from validation.environment import environment

LAWS = NEO_HOOKEAN, RUBBER


def parser() -> Parser:
    """Command line of `sling bench`."""
    parser = Parser(prog="sling bench", description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--device", default="cpu", help="cpu (default), or a GPU such as cuda:0")
    parser.add_argument(
        "--law", choices=LAWS, default=LAWS[0], help=f"of the band; default {LAWS[0]}"
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object, not text")
    return parser


def main() -> None:
    given = parser().parse_args()
    result = throughput.bench(load(), given.device, given.law)
    if not given.json:
        print(throughput.table(result))
        return
    command = f"sling bench --law {given.law} --device {given.device} --json"
    print(json.dumps(environment(given.device, command) | result, indent=2))


if __name__ == "__main__":
    errors.run(main)
