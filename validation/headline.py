r"""README's table and sentences of results, of the committed campaigns alone.

python -m validation.campaigns.ablations --recordings 10 --seeds 1 --preset large \
        --methods posterior paper package_si real2sim2real --report reports/validation/headline.json
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pipeline.layout import ROOT
from validation.campaigns import landings
from validation.campaigns.rig_scores import TARGETS
from validation.campaigns.runner import PAPER, POSTERIOR, read
from validation.reports import paragraph, row

SAME_PULL = Path("reports/validation/headline.json")
BANDS = {"band1": "silicone", "band2": "natural rubber that softens", "band3": "latex"}
ROWS = {  # by the paper's pull
    PAPER: "the paper's method",
    "package_si": "Package SI",
    "real2sim2real": "Real2Sim2Real",
    POSTERIOR: "**`posterior`, the same pull**",
}


def block() -> list[str]:
    """The table by the campaigns, and a sentence on the held-out rubbers."""
    same = read(ROOT / SAME_PULL)
    rubbers = {name: read(ROOT / landings.report_of(name)) for name in ("bands", "sealed")}
    return [
        *table(same, dips(rubbers["bands"]["recordings"])),
        "",
        *paragraph(differences(same)),
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
    """The same of `posterior` by the pull with dips, of the campaign of landings."""
    chosen = [
        line
        for line in recordings
        if (line["pull"], line["method"]) == ("informative", POSTERIOR)
        and not (line["launched"] or "failed" in line)
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


def table(same: dict, by_dips: dict[str, np.ndarray]) -> list[str]:
    """Mean miss, least and most recording [cm], by method and band.

    Args:
        same: The campaign of all methods on the same recordings.
        by_dips: Of `posterior` by the pull with dips.
    """
    heads = (f"{band}, {kind}" for band, kind in BANDS.items())
    rows = [
        row("mean miss (least, most recording) [cm]", *heads, "mean of the bands"),
        row("---", *["---:"] * (len(BANDS) + 1)),
    ]
    for method, words in ROWS.items():
        each, rollouts = each_of(same, method), same["settings"]["rollouts"][method]
        budget = "" if method == POSTERIOR else f", {rollouts:,} rollouts"
        rows.append(line(f"{words}{budget}, {count(each)} recordings", each))
    return [*rows, line(f"**`posterior`, dips**, {count(by_dips)} other recordings", by_dips)]


def count(each: dict[str, np.ndarray]) -> int:
    """Recordings that each band has."""
    return min(map(len, each.values()))


def differences(same: dict) -> str:
    """How `posterior` compares with the paper's method by the paper's pull, band by band."""
    theirs, ours = each_of(same, PAPER), each_of(same, POSTERIOR)
    more = {band: np.nanmean(ours[band] - theirs[band]) for band in BANDS}
    signs = {bool(value > 0) for value in more.values()}
    shown = "no difference is shown" if len(signs) > 1 else "all bands agree"
    text = (
        f"By the same pull, on the same {count(theirs)} recordings, `posterior` misses by"
        f" {listed([f'{value:+.1f}' for value in more.values()])} cm more than the paper's method:"
        f" {shown}."
    )
    return text.replace("-", "−")


def listed(words: Sequence[str]) -> str:
    """Join by commas and a last `and`."""
    return f"{', '.join(words[:-1])} and {words[-1]}"
