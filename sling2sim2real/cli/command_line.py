"""How the `sling` command is put together: a table of commands, each a small function.

A user's mistake is one line on stderr.
"""

from __future__ import annotations

import argparse
import contextlib
import re
import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import NoReturn

from sling2sim2real import __version__
from sling2sim2real.base.errors import REFUSED as REFUSED
from sling2sim2real.base.errors import printable
from sling2sim2real.cli import checkout

Done = str | tuple[str, int]  # what to print, and an exit status that is not 0
EXITS = {
    0: "done",
    1: "bad input, a stage that failed, or a recording that cannot be used: one line says what",
    2: "a command line that cannot be understood",
    3: "refused: a draw that misses, fails or takes more force than the arm may hold (`sling aim`)",
    130: "interrupted",
}


@dataclass(frozen=True)
class Command:
    """A row of the table.

    Attributes:
        help: What it does, in a line.
        example: Arguments with which it works.
        flags: As argparse's `add_argument` takes them: names and options.
        run: Given the arguments.
    """

    help: str
    example: str
    flags: tuple[tuple[tuple, dict], ...]
    run: Callable[[argparse.Namespace], Done]


COMMANDS: dict[str, Command] = {}


def command(help: str, example: str, *flags: tuple) -> Callable:
    """Put a function into the table, under its own name."""

    def put(function: Callable[[argparse.Namespace], Done]) -> Callable:
        COMMANDS[function.__name__.replace("_", "-")] = Command(help, example, flags, function)
        return function

    return put


def flag(*names: str, **options) -> tuple[tuple, dict]:
    """An argument of a command, as argparse's `add_argument` takes it."""
    return names, options


JSON = flag("--json", action="store_true", help="print one JSON object instead of text")


class Parser(argparse.ArgumentParser):
    """A command line that cannot be understood is one line too."""

    def error(self, message: str) -> NoReturn:
        if "--draw: expected one argument" in message:
            message += ", joined by = because it begins with -: --draw=-0.30,-0.17"
        elif option := re.search(r"(--\S+): expected one argument$", message):
            message += f"; one that begins with - is joined by =: {option[1]}=-..."
        self.exit(2, f"error: {printable(message)} (see `{self.prog} --help`)\n")


def parser() -> argparse.ArgumentParser:
    """The whole command line."""
    lines = [f"  {status:<5}{meaning}" for status, meaning in EXITS.items()]
    top = Parser(
        prog="sling",
        description="From a recording of an elastic band to a slingshot policy.",
        epilog="\n".join(["exit status:", *lines]),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    top.add_argument("--version", action="version", version=f"sling2sim2real {__version__}")
    commands = top.add_subparsers(required=True, metavar="COMMAND")
    for name, entry in COMMANDS.items():
        sub = commands.add_parser(
            name,
            help=entry.help,
            description=f"{entry.help[0].upper()}{entry.help[1:]}.",
            epilog=f"example:  sling {name} {entry.example}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        for names, options in entry.flags:
            sub.add_argument(*names, **options)
        sub.set_defaults(command=entry.run, refuse=sub.error)
    for name, (_, help_text) in checkout.COMMANDS.items():  # read before the rest: see main()
        commands.add_parser(name, help=f"{help_text} (in a checkout)")
    return top


def say(text: str) -> None:
    """Print a message on stderr: stdout is for the answer."""
    print(text, file=sys.stderr, flush=True)


def execute(arguments: argparse.Namespace) -> int:
    """Run a command and print its text; whatever a library prints goes to stderr.

    Returns its exit status.
    """
    with contextlib.redirect_stdout(sys.stderr):
        done = arguments.command(arguments)
    text, status = done if isinstance(done, tuple) else (done, 0)
    print(text)
    return status
