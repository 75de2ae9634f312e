"""What one setting changes: results with it and without it, over bands, recordings and seeds."""

from __future__ import annotations

import numpy as np

from validation.paired import mean_interval

AS_IS = "as it is"
KEY = "method", "band", "switch", "recording", "seed"


def effects(results: list[dict], switches: list[str], methods: list[str], bands: list[str]) -> dict:
    """By method, group of bands (`rig`, and each other band) and setting: means and changes.

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
                switch: found
                for switch in switches
                if (found := _effect(by, method, switch, own)) is not None
            }
            for group, own in groups.items()
        }
        for method in methods
    }


def _effect(by: dict, method: str, switch: str, bands: list[str]) -> dict | None:
    keys = [key for key in by if key[0] == method and key[1] in bands and key[2] == switch]
    if not keys:
        return None
    with_, plain = (
        [by.get((*key[:2], one, *key[3:]), {}) for key in keys] for one in (switch, AS_IS)
    )
    failed = sum("failed" in one for one in with_)

    def values(results: list[dict], name: str) -> np.ndarray:
        return np.array([one.get(name) for one in results], float)  # None is NaN

    found = {"runs": len(keys), "failed": failed}
    for name in ("youngs_modulus", "peak_force", "force_rms_n", "loss", "miss"):
        found[name] = mean_interval(values(with_, name))
    ratio = values(with_, "youngs_modulus") / values(plain, "youngs_modulus") - 1
    found["youngs_modulus_change"] = mean_interval(ratio)
    for name in ("peak_force", "miss"):
        found[f"{name}_change"] = mean_interval(values(with_, name) - values(plain, name))
    return found


def cell(figures: dict, switch: str) -> str:
    """A table's cell of one method: how far launches miss with and without a setting."""
    return ", ".join(
        f"{group} {_of(found[AS_IS], 'miss'):.1f} → {_of(found[switch], 'miss'):.1f} {unit}"
        for group, found, unit in _groups(figures)
        if switch in found
    )


def table(figures: dict, switches: list[str]) -> list[str]:
    """Lines of Markdown: a row for each setting and group of bands, of one method."""
    lines = [
        "| setting | bands | E | peak force, off the recorded | loss | miss | change of the miss |",
        "|---|---|---:|---:|---:|---:|---:|",
    ]
    for switch in switches:
        for group, found, unit in _groups(figures):
            if switch not in found:
                continue
            one, plain = found[switch], switch == AS_IS
            young = f"{_of(one, 'youngs_modulus') / 1e5:.0f} kPa"
            if not plain:
                young = f"{_of(one, 'youngs_modulus_change'):+.1f} %"
            low, mean, high = (_of(one, "miss_change", end) for end in ("low", "mean", "high"))
            moved = "" if plain else f"{mean:+.1f} {unit} [{low:+.1f}, {high:+.1f}]"
            lines.append(
                f"| {switch if plain else f'`{switch}`'} | {group} | {young} |"
                f" {_of(one, 'peak_force'):+.1f} % | {_of(one, 'loss') / 100:.2f} |"
                f" {_of(one, 'miss'):.1f} {unit} | {moved} |"
            )
    return [line.replace("-", "−") if number > 1 else line for number, line in enumerate(lines)]


def _groups(figures: dict):
    """Name, figures and the unit of a miss: of the rig first."""
    for name in ("rig", *sorted({*figures} - {"rig"})):
        yield name, figures[name], "cm" if name == "rig" else "%"


def _of(figures: dict, name: str, end: str = "mean") -> float:
    """A hundred times a figure's mean, or an end of its interval; 0 is not -0."""
    value = figures[name][end]
    return round(100 * (np.nan if value is None else value), 6) + 0.0
