"""Commands that take back: a band of one's own, values of params.yaml."""

from __future__ import annotations

import argparse

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
