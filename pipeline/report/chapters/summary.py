"""The first page: what this is, and what came out of it in short."""

from __future__ import annotations

import pandas as pd

from pipeline.drawing.styles import Styles
from pipeline.report.report import Report
from pipeline.report.results import Result, Results
from pipeline.report.tables.benchmark import APART
from pipeline.report.tables.landings import AIM, intervals, landing_errors, prediction_error

INTRODUCTION = """\
# What came out

One recording of a robot that pulls and releases an elastic band goes in. A simulator of the band is
fitted to it (five parameters θ), a slingshot policy is trained in that simulator alone, and its
launches are compared with launches that the simulator has never seen. This file is written by the
last stage of `dvc repro`; equal inputs give an equal file.

Frame: origin midway between the fork tips, y towards the target, z up. A *draw* is the drawn
position (y, z) of the projectile, y < 0; a *target* g is a distance along y on the floor.
"""


def summary(report: Report) -> str:
    """A line a band of the rig, one a method where launches were measured, and what went wrong."""
    results, styles = report.results, report.styles
    named = [(one, f"{one.band}, {styles[one.method].name}") for one in results]
    lines = [INTRODUCTION, "## In short\n"]
    lines += [line for band in results.methods for line in _virtual(results, band, styles)]
    for one, name in named:
        if said := measured(one.trials):
            lines.append(f"- **{name}**: {'; '.join(said)}.")
    lines += [f"- {line}" for one, name in named for line in _doubts(one, name)]
    lines += [
        f"- {band}: {count} measured launches name a method that does not run on this band."
        for band, count in results.unused.items()
    ]
    return "\n".join(lines) + "\n"


def _virtual(results: Results, band: str, styles: Styles) -> list[str]:
    """How far the methods miss, beside what errors of the launch alone would give.

    Ablations are left to their tables.
    """
    said, floor = [], results.floors.get(band, {}).get("mean_error_m")
    for method, result in results.methods[band].items():
        trials = result.trials[result.trials.kind == "virtual"]
        if method in APART or trials.empty:
            continue
        total = landing_errors(trials)["all"]
        words = f"{styles[method].name} {100 * total['mean']:.1f} cm"
        if total["failed"] == total["launches"]:
            words = f"{styles[method].name} N/A"
        elif total["failed"]:
            words += f" ({total['failed']} of {total['launches']} launches failed)"
        elif floor:
            words += f" ({total['mean'] / floor:.1f} times the floor)"
        said.append(words)
    least = f"; the actuation floor is {100 * floor:.1f} cm" if floor else ""
    launches = "virtual launches, mean distance from the target"
    return [f"- **{band}**, {launches}: {', '.join(said)}{least}."] if said else []


def _doubts(result: Result, name: str) -> list[str]:
    """What did not go well."""
    said, count = [], len(result.trials)
    unpredicted = int(result.trials.predicted_y.isna().sum())
    if unpredicted:
        said.append(f"{name}: {unpredicted} of {count} launches could not be predicted.")
    if set(result.trials.kind) == {"predicted"}:
        said.append(f"{name}: no launch to compare its predictions with.")
    if not result.card["training"]["converged"]:
        said.append(f"The policy of {name} did **not** converge in its own simulator.")
    return said


def measured(trials: pd.DataFrame) -> list[str]:
    """What the measured launches say of a method, in words; nothing where there are none."""
    trials, said = trials[trials.kind == "measured"], []
    if trials.empty:
        return []
    if trials.target.notna().any():
        total = landing_errors(trials)["all"]
        if total["failed"] < total["launches"]:
            said.append(f"measured launches land {100 * total['mean']:.1f} cm off their target")
        if total["failed"]:
            said.append(f"{total['failed']} of {total['launches']} measured launches failed")
    error = prediction_error(trials)
    parts = [
        f"{100 * error[part]['mean']:.1f} % {where} ({error[part]['launches']} launches)"
        for part, where in (("inside", "inside the recorded stretch"), ("beyond", "beyond it"))
        if error[part]["launches"]
    ]
    if parts:
        bias = 100 * error["all"]["bias"]
        said.append(
            f"measured landings are predicted within {' and '.join(parts)} on average,"
            f" with a bias of {bias:+.1f} %"
        )
    said.append(_aim(error["inside"]))
    ranges = (intervals(trials) or {}).get("inside")
    if ranges and ranges["launches"]:
        said.append(
            f"{ranges['covered']} of {ranges['launches']} measured landings inside the recorded"
            " stretch lie in their 90 % interval"
        )
    return said


def _aim(inside: dict) -> str:
    """Whether the measured landings inside the recorded stretch are predicted well enough."""
    aim = f"the aim, at most {100 * AIM:g} % of the distance inside the recorded stretch,"
    if not inside["tried"]:
        return f"{aim} cannot be judged: no launch lies there"
    if inside["unpredicted"]:
        return f"{aim} is **not** met: {inside['unpredicted']} launches there are not predicted"
    if not inside["launches"]:
        return f"{aim} cannot be judged: no launch landed there"
    return f"{aim} is {'met' if inside['mean'] <= AIM else '**not** met'}"
