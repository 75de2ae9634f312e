"""The first page: what this is, and what came out of it in short."""

from __future__ import annotations

import pandas as pd

from pipeline.report.looks import Look
from pipeline.report.results import Results
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


def summary(results: Results, looks: dict[str, Look]) -> str:
    """A line a band and method, and what did not go well."""
    lines = [INTRODUCTION, "## In short\n"]
    for result in results:
        best = result.theta.get("loss", {}).get("total")
        said = [f"loss {best:.4g} after {len(result.history)} rollouts"] if best else []
        said += landed(result.trials, "virtual") + landed(result.trials, "measured")
        unpredicted = int(result.trials.predicted_y.isna().sum())
        if unpredicted:
            said.append(f"{unpredicted} of {len(result.trials)} launches could not be predicted")
        if result.trials.landing_y.isna().all():
            said.append("no launch to compare its predictions with")
        lines.append(f"- **{result.band}, {looks[result.method].name}**: {'; '.join(said)}.")
    lines += [
        f"- The policy of {one.band}, {looks[one.method].name} did **not** converge in its own"
        " simulator."
        for one in results
        if not one.card["training"]["converged"]
    ]
    return "\n".join(lines) + "\n"


def landed(trials: pd.DataFrame, kind: str) -> list[str]:
    """What the launches of a kind say, in words."""
    trials, said = trials[trials.kind == kind], []
    if trials.target.notna().any():
        total = landing_errors(trials)["all"]
        failed = f"{total['failed']} of {total['launches']} {kind} launches failed"
        if total["failed"] < total["launches"]:
            said.append(f"{kind} launches land {100 * total['mean']:.1f} cm off their target")
        if total["failed"]:
            said.append(failed)
    if kind == "measured" and not trials.empty:
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
            f"{ranges['covered']} of {ranges['launches']} {kind} landings inside the recorded"
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
