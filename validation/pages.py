"""Blocks of pages that a script writes between two marks: from the code, or from results in Git.

python -m validation.pages          # exit status 1 if a page is out of date
python -m validation.pages --fix    # write them anew
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable
from pathlib import Path

from pipeline.layout import ROOT
from sling2sim2real.base import errors
from sling2sim2real.base.errors import UserError
from sling2sim2real.base.files import write_text
from sling2sim2real.recording.checks import CHECKS
from validation import headline
from validation.campaigns import ablations, field, landings
from validation.campaigns.runner import read
from validation.reports import row

CODE_BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)  # language, code


def checks() -> list[str]:
    """All checks of a recording."""
    heads = "check", "compares", "uncertainty", "warns", "refuses", "remedy"
    rows = [
        (f"`{check.name}`", *(getattr(check, head) or "–" for head in heads[1:]))
        for check in CHECKS.values()
    ]
    return [row(*cells) for cells in (heads, ("---",) * len(heads), *rows)]


BLOCKS: dict[str, tuple[str, Callable[[], list[str]]]] = {  # by page: name of its marks, its lines
    "README.md": ("landings", headline.block),
    "docs/reference/checks.md": ("checks", checks),
    "docs/identification.md": (
        "landings",
        lambda: landings.table(
            {name: read(ROOT / landings.report_of(name)) for name in ("sealed",)}
        ),
    ),
    "docs/paper.md": ("ablations", lambda: ablations.table(read(ROOT / ablations.REPORT))),
    "docs/recording.md": ("field", lambda: field.table(read(ROOT / field.REPORT))),
}


def drawn(page: str, root: Path = ROOT) -> str:
    """A page's text with today's block. Raises UserError where it has not each mark once."""
    name, lines = BLOCKS[page]
    begin, end = f"<!-- {name}: begin -->\n", f"<!-- {name}: end -->\n"
    text = (root / page).read_text(encoding="utf-8")
    if text.count(begin) != 1 or text.count(end) != 1:
        raise UserError(f"{page}: has not one {begin.strip()} and one {end.strip()}")
    head, rest = text.split(begin)
    return head + begin + "\n".join(lines()) + "\n" + end + rest.split(end)[1]


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--fix", action="store_true", help="write them anew")
    fix, late = parser.parse_args().fix, 0
    for page in BLOCKS:
        text = drawn(page)
        if text != (ROOT / page).read_text(encoding="utf-8"):
            late += 1
            print(f"{page}: {'written anew' if fix else 'out of date'}")
            if fix:
                write_text(ROOT / page, text)
    return int(late > 0 and not fix)


if __name__ == "__main__":
    errors.run(main)
