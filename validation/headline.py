"""README's table and sentences of results, of the committed campaigns alone."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pipeline.layout import ROOT
from sling2sim2real.simulator.rubber import COROTATED
from validation.campaigns import ablations, landings
from validation.campaigns.rig_scores import TARGETS
from validation.campaigns.runner import OURS, read
from validation.reports import paragraph, row

ENGINE = Path("reports/validation/law-corotated.json")
BANDS = {"band1": "silicone", "band2": "natural rubber that softens", "band3": "latex"}
USUAL_ROWS = {  # methods of the usual campaign, which has another law for all but the last
    "package_si": "Package SI, neo-Hookean law",
    "real2sim2real": "Real2Sim2Real, neo-Hookean law",
    OURS: "**`posterior`, the same pull**",
}


def block() -> list[str]:
    """The table by the campaigns, and a sentence on the held-out rubbers."""
    usual, engine = read(ROOT / ablations.REPORT), read(ROOT / ENGINE)
    rubbers = {name: read(ROOT / landings.report_of(name)) for name in ("bands", "sealed")}
    return [
        *table(usual, engine, dips(rubbers["bands"]["recordings"])),
        "",
        *paragraph(differences(usual, engine)),
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


def table(usual: dict, engine: dict, by_dips: dict[str, np.ndarray]) -> list[str]:
    """Mean miss, least and most recording [cm], by method and band.

    Args:
        usual: The campaign of all methods.
        engine: That of the paper's method by the law of its engine, COROTATED.
        by_dips: Of our method by the pull with dips.
    """
    heads = (f"{band}, {kind}" for band, kind in BANDS.items())
    rows = [
        row("mean miss (least, most recording) [cm]", *heads, "mean of the bands"),
        row("---", *["---:"] * (len(BANDS) + 1)),
    ]
    paper = engine, COROTATED, "the paper's method, law of its engine"
    for content, method, words in (paper, *((usual, *pair) for pair in USUAL_ROWS.items())):
        each, rollouts = each_of(content, method), content["settings"]["rollouts"][method]
        budget = "" if method == OURS else f", {rollouts:,} rollouts"
        rows.append(line(f"{words}{budget}, {count(each)} recordings", each))
    return [*rows, line(f"**`posterior`, dips**, {count(by_dips)} other recordings", by_dips)]


def count(each: dict[str, np.ndarray]) -> int:
    """Recordings that each band has."""
    return min(map(len, each.values()))


def differences(usual: dict, engine: dict) -> str:
    """How ours by the paper's pull compares with the paper's method on the same recordings."""
    theirs, ours = each_of(engine, COROTATED), each_of(usual, OURS)
    ours = {band: each[: len(theirs[band])] for band, each in ours.items()}
    more = [f"{np.nanmean(ours[band] - theirs[band]):+.1f}" for band in BANDS]
    mean = np.mean([np.nanmean(each) for each in ours.values()])
    text = (
        f"By the same pull, on the same {count(theirs)} recordings, `posterior` misses by"
        f" {listed(more)} cm more than the paper's method, {mean:.1f} cm in the mean."
    )
    return text.replace("-", "−")


def listed(words: Sequence[str]) -> str:
    """Join by commas and a last `and`."""
    return f"{', '.join(words[:-1])} and {words[-1]}"
