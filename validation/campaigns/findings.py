"""The table of docs/paper.md: which of the paper's findings hold by the large budget.

    python -m validation.campaigns.findings          # exit status 1 if it is out of date
    python -m validation.campaigns.findings --fix

Filled from reports/validation/ablations-large.json (validation/campaigns/ablations.py).
"""

from __future__ import annotations

import sys

from pipeline.base.code import ROOT
from pipeline.report.drawing.styles import styles
from validation.campaigns.runner import PAPER, read
from validation.marked import block_of, compared_or_fixed, row, with_block

PAGE, REPORT = ROOT / "docs" / "paper.md", ROOT / "reports/validation/ablations-large.json"
NAMES = {
    "late": "late frames weigh little",
    "geom_quarter": "geometry weighs a quarter",
    "search_rubber": "the law `rubber`",
}  # of variants of the paper's method


def block(content: dict) -> str:
    """What the page has between its marks, of a report's content."""
    figures, rollouts = content["figures"]["all"], content["settings"]["rollouts"]
    methods, against = figures["methods"], figures[f"less_{PAPER}"]
    named = styles(methods)
    rows = [
        "| method | rollouts | its loss | misses by [cm] | more than the paper's by [cm] | p |"
        " farther off on |",
        "|---|---:|---:|---:|---:|---:|---:|",
    ]
    for name in sorted(
        methods, key=lambda method: (method in NAMES, methods[method]["miss_cm"]["mean"])
    ):
        of, less, paper = methods[name], against.get(name), methods[PAPER]["miss_cm_each"]
        cells = [NAMES.get(name, named[name].name), f"{rollouts[name]:,}"]
        cells += [f"{of['loss']['mean']:.3f}", interval(of["miss_cm"], "{:.1f}")]
        if less:
            each = [m > p for m, p in zip(of["miss_cm_each"], paper, strict=True)]
            p = less["p_holm"]
            cells += [interval(less, "{:+.1f}"), "< 0.001" if p < 1e-3 else f"{p:.2g}"]
            cells.append(f"{sum(each)} of {len(each)}")
        else:
            cells += ["–", "–", "–"]
        rows.append(row(*cells).replace(" -", " −").replace("(-", "(−"))
    return block_of("findings", rows)


def interval(estimate: dict, form: str) -> str:
    """A mean with its interval."""
    mean, low, high = (form.format(estimate[name]) for name in ("mean", "low", "high"))
    return f"{mean} ({low} to {high})"


def drawn(page: str) -> str:
    return with_block(page, block(read(REPORT)))


if __name__ == "__main__":
    sys.exit(compared_or_fixed(PAGE, drawn, __doc__))
