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
    """A table's cell of one method: E's change, the peak force's error, rig and orange misses."""
    rig = figures["rig"]
    if switch not in rig:
        return ""
    one, plain = rig[switch], rig[AS_IS]
    young = 100 * one["youngs_modulus_change"]["mean"]
    force, was = (100 * each["peak_force"]["mean"] for each in (one, plain))
    miss, before = (100 * each["miss"]["mean"] for each in (one, plain))
    text = f"E {young:+.0f} %, force {was:+.1f} → {force:+.1f} %, rig {before:.1f} → {miss:.1f} cm"
    for name in sorted(figures):
        if name != "rig" and switch in figures[name]:
            here, there = (100 * figures[name][key]["miss"]["mean"] for key in (switch, AS_IS))
            text += f", {name} {there:.1f} → {here:.1f} %"
    return text.replace("-", "−")
