"""Names that others have given, such as those of files, in markdown and in pictures."""

from __future__ import annotations

import re

from sling2sim2real.base.errors import printable


def as_code(name: str) -> str:
    """Write a name as code, whatever is in it: no markup of it counts."""
    shown = printable(name)
    fence = "`" * (1 + max(map(len, re.findall("`+", shown)), default=0))
    return f"{fence} {shown} {fence}" if "`" in shown else f"{fence}{shown}{fence}"


def as_text(words: str) -> str:
    """Words with names in them, in a sentence: no markup of theirs counts."""
    shown = printable(words).replace("&", "&amp;").replace("<", "&lt;").replace("](", "]\\(")
    return re.sub(r"([`*])", r"\\\1", shown)


def cell(text: str) -> str:
    """Escape text for a table, where a bar would end the cell, in code too."""
    return text.replace("|", "\\|")


def as_label(name: str) -> str:
    """Escape a name for matplotlib to draw letter by letter: between dollars it would read TeX."""
    return printable(name).replace("$", r"\$")
