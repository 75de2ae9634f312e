"""Names that others have given, such as those of files, in pictures."""

from __future__ import annotations

from pipeline.base.errors import printable


def as_label(name: str) -> str:
    """As matplotlib draws it letter by letter: between dollars it would read TeX."""
    return printable(name).replace("$", r"\$")
