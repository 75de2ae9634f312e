"""Blocks of pages: code, and what a script writes between two marks."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Iterable
from pathlib import Path

from pipeline.base.errors import UserError
from pipeline.base.files import write_text

CODE_BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)  # language, code


def marks(name: str) -> tuple[str, str]:
    """The first and the last line of a block."""
    return f"<!-- {name}: begin -->\n", f"<!-- {name}: end -->\n"


def block_of(name: str, lines: Iterable[str]) -> str:
    """Lines between the marks of a block."""
    begin, end = marks(name)
    return begin + "\n".join(lines) + "\n" + end


def row(*cells: object) -> str:
    """A row of a table."""
    return f"| {' | '.join(map(str, cells))} |"


def with_block(page: str, block: str) -> str:
    """A page with `block`, from its first mark to its last, in the place of the one that it has.

    Raises UserError where the page has not each of the marks once.
    """
    begin, *_, end = block.splitlines(keepends=True)
    if page.count(begin) != 1 or page.count(end) != 1:
        raise UserError(f"the page has not one {begin.strip()} and one {end.strip()}")
    head, rest = page.split(begin)
    return head + block + rest.split(end)[1]


def fill(page: Path, block: str) -> None:
    """Write a block into a page, in the place of the one that it has."""
    write_text(page, with_block(page.read_text(encoding="utf-8"), block))


def compared_or_fixed(page: Path, drawn: Callable[[str], str], docstring: str | None) -> int:
    """The command of a page with a drawn block: exit status 1 if it is out of date, or `--fix`.

    Args:
        drawn: The page's text with today's block.
        docstring: The script's docstring.
    """
    parser = argparse.ArgumentParser(description=str(docstring).partition("\n")[0])
    parser.add_argument("--fix", action="store_true", help="write it anew")
    text = page.read_text(encoding="utf-8")
    if parser.parse_args().fix:
        page.write_text(drawn(text), encoding="utf-8")
        return 0
    return int(drawn(text) != text)
