"""Texts with gaps: `*.j2` of Jinja2 beside the code that fills them.

A template has all words, and says which of them stand when; the code has all numbers.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined


def filled(path: Path, /, **values: object) -> str:
    """The text of a template; it may extend and include others of its folder.

    Raises:
        jinja2.UndefinedError: It names a value that is not given.
    """
    return _environment(path.parent).get_template(path.name).render(values)


@cache
def _environment(folder: Path) -> Environment:
    """Environment of plain text, in which a line that is a statement alone leaves nothing."""
    return Environment(
        loader=FileSystemLoader(folder),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
