"""The table of all checks of a recording in docs/faq.md.

python tools/checks.py          # exit status 1 if the page is out of date
python tools/checks.py --fix    # write it anew
"""

from __future__ import annotations

import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from pipeline.recording.checks.table import CHECKS  # noqa: E402
from validation.marked import compared_or_fixed, marks, with_block  # noqa: E402

PAGE = ROOT / "docs" / "faq.md"
HEADS = ("check", "compares", "uncertainty", "warns", "refuses", "remedy")


def table() -> str:
    """All rows as Markdown."""
    rows = [HEADS, ("---",) * len(HEADS)]
    rows += [
        (
            f"`{check.name}`",
            check.compares,
            check.uncertainty,
            check.warns,
            check.refuses,
            check.remedy,
        )
        for check in CHECKS
    ]
    return "".join(f"| {' | '.join(cell or '–' for cell in row)} |\n" for row in rows)


def drawn(page: str) -> str:
    """The page with today's table."""
    begin, end = marks("checks")
    return with_block(page, begin + table() + end)


if __name__ == "__main__":
    sys.exit(compared_or_fixed(PAGE, drawn, __doc__))
