"""What one setting changes: results with it and without it, over bands, recordings and seeds."""

from __future__ import annotations

from itertools import chain

import numpy as np

from validation.marked import row
from validation.paired import mean_interval

AS_IS = "as it is"
KEY = "method", "band", "switch", "recording", "seed"


def effects(results: list[dict], switches: list[str], methods: list[str], bands: list[str]) -> dict:
    """Means and changes by method, group of bands (`rig`, and each other band) and setting.

    Args:
        results: Each with "band", "recording", "switch", "method", "seed" and, unless it "failed",
            "youngs_modulus" [Pa], "peak_force" (predicted over recorded, less 1), "loss" and
            "miss": of a rig's band [m], of another as a share of the distance.
        bands: Of the rig; others are groups of their own.
    """
    by = {tuple(r[name] for name in KEY): r for r in results}
    others = sorted({r["band"] for r in results} - {*bands})
    groups = {"rig": bands} | {band: [band] for band in others}
    return {
        method: {
            group: {
                switch: effect
                for switch in switches
                if (effect := _effect(by, method, switch, group_bands)) is not None
            }
            for group, group_bands in groups.items()
        }
        for method in methods
    }


def _effect(by: dict, method: str, switch: str, bands: list[str]) -> dict | None:
    keys = [key for key in by if key[0] == method and key[1] in bands and key[2] == switch]
    if not keys:
        return None
    with_, plain = (
        [by.get((*key[:2], setting, *key[3:]), {}) for key in keys] for setting in (switch, AS_IS)
    )
    failed = sum("failed" in result for result in with_)

    def values(results: list[dict], name: str) -> np.ndarray:
        return np.array([result.get(name) for result in results], float)  # None is NaN

    effect = {"runs": len(keys), "failed": failed}
    for name in ("youngs_modulus", "peak_force", "force_rms_n", "loss", "miss"):
        effect[name] = mean_interval(values(with_, name))
    ratio = values(with_, "youngs_modulus") / values(plain, "youngs_modulus") - 1
    effect["youngs_modulus_change"] = mean_interval(ratio)
    for name in ("peak_force", "miss"):
        effect[f"{name}_change"] = mean_interval(values(with_, name) - values(plain, name))
    return effect


def table(figures: dict, rows: dict[str, str], methods: dict[str, str]) -> list[str]:
    """Lines of Markdown: a row for each setting and group of bands, three columns a method.

    Args:
        figures: As `effects` gives them.
        rows, methods: What settings and methods are called, in their order.
    """
    heads = [head for name in methods.values() for head in (f"{name}: E", "force", "miss")]
    lines = [row("as the paper has it", "bands", *heads), f"|---|---{'|---:' * len(heads)}|"]
    groups = dict.fromkeys(group for of_groups in figures.values() for group in of_groups)
    for switch, words in rows.items():
        for group in sorted(groups, key=lambda name: (name != "rig", name)):
            of = [figures[method].get(group, {}) for method in methods]
            if any(switch in effects_of for effects_of in of):
                cells = chain.from_iterable(_cells(some, switch, group) for some in of)
                lines.append(row(words, group, *cells))
    return lines


def _cells(switch_effects: dict, switch: str, group: str) -> tuple[str, str, str]:
    """E, force and miss of one method in a group of bands; changes where there is a setting."""
    effect, unit = switch_effects.get(switch), "cm" if group == "rig" else "%"
    if effect is None:
        return "", "", ""
    if not effect["miss"]["n"] and not effect["youngs_modulus"]["n"]:
        return ("no θ",) * 3 if effect["failed"] else ("", "", "")
    young, force = _of(effect, "youngs_modulus") / 1e5, f"{_of(effect, 'peak_force'):+.1f} %"
    miss = f"{_of(effect, 'miss'):.1f} {unit}"
    if switch == AS_IS:
        return _typeset(f"{young:.0f} kPa", force, miss)
    moved, low, high = (_of(effect, "miss_change", end) for end in ("mean", "low", "high"))
    change = f"{moved:+.1f}"
    if effect["miss_change"]["n"] > 1:  # a single pair has no interval
        change += f", {low:+.1f} to {high:+.1f}"
        change = f"**{change}**" if low > 0 or high < 0 else change
    return _typeset(f"{_of(effect, 'youngs_modulus_change'):+.1f} %", force, f"{miss} ({change})")


def runs(figures: dict, rows: dict[str, str], methods: dict[str, str]) -> list[str]:
    """Sentences: how many identifications are behind a row, and how many found nothing."""
    summary = []
    for method, name in methods.items():
        groups = [group for group in figures[method].values() if AS_IS in group]
        counts, failed = (
            {s: sum(group[s][figure] for group in groups if s in group) for s in rows}
            for figure in ("runs", "failed")
        )
        others = [f"{n} {rows[s]}" for s, n in counts.items() if n not in (0, counts[AS_IS])]
        summary.append(", ".join([f"{name}: {counts[AS_IS]} a row", *others]) + ".")
        summary += [
            f"{name}, {rows[s]}: {n} of {counts[s]} found no θ." for s, n in failed.items() if n
        ]
    return summary


def _typeset(*cells: str) -> tuple[str, ...]:
    """Typeset cells with a minus, and a dash where there is no number."""
    return tuple("–" if "nan" in cell else cell.replace("-", "−") for cell in cells)


def _of(figures: dict, name: str, end: str = "mean") -> float:
    """A hundred times a figure's mean, or an end of its interval; 0 is not -0."""
    value = figures[name][end]
    return round(100 * (np.nan if value is None else value), 6) + 0.0
