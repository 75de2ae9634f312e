"""README's table and sentences of results, of the committed campaigns alone."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sling2sim2real.base.code import ROOT
from validation.campaigns import ablations, landings
from validation.campaigns.rig_scores import TARGETS
from validation.campaigns.runner import OURS, PAPER, read
from validation.reports import paragraph, row

LARGE = Path("reports/validation/ablations-large.json")
BANDS = {"band1": "silicone", "band2": "natural rubber that softens", "band3": "latex"}
SAME = {  # methods by the paper's pull, on the same recordings: words, whose rollouts they name
    PAPER: "the paper's method",
    "package_si": "Package SI",
    "real2sim2real": "Real2Sim2Real",
    OURS: "**`posterior`, the paper's pull**",
}


def block() -> list[str]:
    """The table by the campaigns, and a sentence on the held-out rubbers."""
    usual, large = read(ROOT / ablations.REPORT), read(ROOT / LARGE)
    rubbers = {name: read(ROOT / landings.report_of(name)) for name in ("bands", "sealed")}
    return [
        *table(usual, large, dips(rubbers["bands"]["recordings"])),
        "",
        *paragraph(differences(usual, large)),
        "",
        *landings.sentence(rubbers["sealed"]),
    ]


def each_of(content: dict, method: str) -> dict[str, np.ndarray]:
    """Mean miss of each recording by band [cm], of a campaign of ablations."""
    figures = content["figures"]
    return {
        band: np.array(figures[band]["methods"][method]["miss_cm_each"], float) for band in BANDS
    }


def dips(recordings: list[dict]) -> dict[str, np.ndarray]:
    """The same of our method by the pull with dips, of the campaign of landings."""
    chosen = [
        line
        for line in recordings
        if (line["pull"], line["method"]) == ("informative", OURS)
        and not (line["worn"] or line["launched"] or "failed" in line)
    ]
    return {
        band: np.array([
            100 * np.mean(np.abs(line["scores"]["error"] * TARGETS))
            for line in chosen
            if line["band"] == band
        ])
        for band in BANDS
    }  # fmt: skip


def cell(values: np.ndarray) -> str:
    """Mean, least and most."""
    return f"{np.nanmean(values):.1f} ({np.nanmin(values):.1f} to {np.nanmax(values):.1f})"


def line(words: str, each: dict[str, np.ndarray]) -> str:
    """A row: the bands, and the mean of their means."""
    mean = np.mean([np.nanmean(values) for values in each.values()])
    return row(words, *map(cell, each.values()), f"{mean:.1f}")


def table(usual: dict, large: dict, by_dips: dict[str, np.ndarray]) -> list[str]:
    """Mean miss, least and most recording [cm], by method and band."""
    heads = (f"{band}, {kind}" for band, kind in BANDS.items())
    rows = [
        row("mean miss (least, most recording) [cm]", *heads, "mean of the bands"),
        row("---", *["---:"] * (len(BANDS) + 1)),
    ]
    for content in (large, usual):
        budgets = content["settings"]["rollouts"]
        for method, words in SAME.items():
            if method not in budgets or (content is large and method != PAPER):
                continue
            each = each_of(content, method)
            count = min(map(len, each.values()))
            budget = "" if method == OURS else f", {budgets[method]:,} rollouts"
            rows.append(line(f"{words}{budget}, {count} recordings", each))
    count = min(map(len, by_dips.values()))
    return [*rows, line(f"**`posterior`, dips**, {count} other recordings", by_dips)]


def differences(usual: dict, large: dict) -> str:
    """How `posterior` by the paper's pull compares with the paper's method, by recording."""
    parts = []
    for content in (usual, large):
        theirs, ours = each_of(content, PAPER), each_of(usual, OURS)
        more = [
            f"{np.nanmean(ours[band][: len(theirs[band])] - theirs[band]):+.1f}" for band in BANDS
        ]
        budget, count = content["settings"]["rollouts"][PAPER], min(map(len, theirs.values()))
        parts.append(f"{listed(more)} cm ({budget:,} rollouts, {count} recordings)")
    text = (
        f"By the same pull, `posterior` misses by {' and by '.join(parts)} more than the paper's"
        " method."
    )
    return text.replace("-", "−")


def listed(words: Sequence[str]) -> str:
    """Join by commas and a last `and`."""
    return f"{', '.join(words[:-1])} and {words[-1]}"
