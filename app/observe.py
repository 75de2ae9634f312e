"""Observe: a measured launch becomes evidence, and what follows from it runs again."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np

from app import evidence
from app.flow import child
from pipeline.base import launch_table as table
from pipeline.base.errors import UserError
from pipeline.base.layout import Layout
from pipeline.landing.simulator import simulator
from pipeline.launches.spread import LEVEL, landing_intervals
from pipeline.params import expect_known
from pipeline.params.identification import LEAST_SQUARES
from pipeline.posterior.evidence import expect_error
from pipeline.sling.theta import load_samples, load_theta

FURTHEST_DRAW = 2.0  # m


def observe(
    params,
    band: str,
    method: str,
    draw: tuple[float, float],
    landing: float,
    *,
    error: float | None = None,
    run: bool = True,
    root: Path | str = ".",
) -> dict:
    """Put a launch into data/evidence/<band>.csv and run the stages that it makes stale.

    Args:
        params: The whole of params.yaml.
        method: That is identified anew, one that searches by least squares.
        draw, landing: As measured [m].
        error: Standard deviation of the draw along each axis [m]; None: of a commanded one.
        run: Whether stages run; else the launch is noted, no more.
        root: Of the project.

    Returns:
        `file`, `launches` in it, and what `known` says `before` and `after`.

    Raises:
        UserError: It can be no launch, or is known already, and nothing is written; or a stage
            fails, and the launch stays.
    """
    expect_known(params, "band", band, called="--band")
    expect_known(params, "method", method, called="--method")
    if params.methods[method].search != LEAST_SQUARES:
        raise UserError(f"--method {method}: takes no launches as evidence, least_squares does")
    layout = Layout(Path(root))
    expect_launch(params, draw, landing, error)
    stage = policy_stage(params, band, method) if run else None
    number = evidence.add(layout, band, params, [(*draw, error, landing)])
    answer = {"file": str(layout.evidence / f"{band}.csv"), "launches": number}
    answer["before"] = known(params, band, method, draw, layout.root)
    if stage:
        child.repro(layout.root, stage, lambda line: print(line, file=sys.stderr, flush=True))
    answer["after"] = known(params, band, method, draw, layout.root) if run else None
    return answer


def expect_launch(params, draw: tuple[float, float], landing: float, error: float | None) -> None:
    """Raises UserError where no launch can be so."""
    if math.hypot(*draw) > FURTHEST_DRAW:
        raise UserError(
            f"--draw: must be at most {FURTHEST_DRAW:g} m from the fork; is it in centimetres?"
        )
    floor = -params.setup.fork_height
    if draw[1] < floor:
        raise UserError(f"--draw: z = {draw[1]:g} m lies below the floor, z = {floor:g} m")
    furthest = table.LIMITS[table.LANDING][1]
    if not landing < furthest:
        raise UserError(
            f"--landing: must be below {furthest:g} m, got {landing:g}; is it in centimetres?"
        )
    if error is not None:
        expect_error("--draw-error", error)


def known(params, band: str, method: str, draw: tuple[float, float], root: Path) -> dict | None:
    """What θ and its samples say; None where nothing has been identified.

    `landing_m` of `draw` and its `interval_90_m` (None where the launch fails), `failure`,
    `returned_share` and its `share_90`.
    """
    layout = Layout(root)
    file = layout.theta(band, method)
    if not file.is_file():
        return None
    content, samples = load_theta(file, band), load_samples(layout.confidence(band, method))
    launcher = simulator(params, band, content, root=root)
    once = launcher(np.array([draw]))
    told = {"landing_m": None, "interval_90_m": None, "failure": once.failure[0]}
    if once.failure[0] is None:
        told["landing_m"] = float(once.landing_y[0])
        error = params.trials.actuation_error
        found = landing_intervals(launcher, np.array(draw), samples, error)[0]
        told["interval_90_m"] = found.tolist() if np.isfinite(found).all() else None
    told["returned_share"] = content.get("returned_share", 1.0)
    ends = [(1 - LEVEL) / 2, (1 + LEVEL) / 2]
    told["share_90"] = None if samples is None else np.quantile(samples[:, -1], ends).tolist()
    return told


def policy_stage(params, band: str, method: str) -> str:
    """Of dvc.yaml. Raises UserError where params.yaml runs the method on no such band."""
    asked = params.run
    if band in asked.bands and method in asked.methods:
        return f"policy@{band}-{method}"
    if band in asked.ablations.bands and method in asked.ablations.methods:
        return f"ablation_policy@{band}-{method}"
    raise UserError(f"{method} does not run on {band}: see `run:` in params.yaml, or --no-run")


def shown(answer: dict, landing: float) -> str:
    """A few lines for people."""
    count = answer["launches"]
    lines = [f"{answer['file']}: {count} launch{'es' if count > 1 else ''} as evidence"]
    for when in ("before", "after"):
        if told := answer[when]:
            share = _with_ends(told["returned_share"], told["share_90"], "")
            landed = told["failure"] and f"fails in simulation: {told['failure']}"
            landed = landed or _with_ends(told["landing_m"], told["interval_90_m"], " m")
            lines.append(f"{when:6}  landing {landed}, returned share {share}")
            if when == "after" and told["failure"]:
                lines.append("warning: a launch that fails in simulation counts for nothing")
    lines.append(f"measured  {landing:.3f} m" + ("" if answer["after"] else "; nothing has run"))
    return "\n".join(lines)


def _with_ends(value: float, ends: list[float] | None, unit: str) -> str:
    told = "" if ends is None else f" (90 %: {ends[0]:.3f} to {ends[1]:.3f}{unit})"
    return f"{value:.3f}{unit}{told}"
