"""Observe: a measured launch becomes evidence, and what follows from it runs again."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from pipeline.flow.dvc import repro
from pipeline.params import Params
from sling2sim2real.base.disk import expect_ready
from sling2sim2real.base.errors import UserError
from sling2sim2real.base.layout import Layout, NotMade
from sling2sim2real.cli import evidence, safety
from sling2sim2real.cli.command_line import say
from sling2sim2real.cli.launch import expect_above_floor, interval_90
from sling2sim2real.cli.safety import Hazard
from sling2sim2real.cli.stretched import further
from sling2sim2real.episode.episode import Episode
from sling2sim2real.episode.pull import deepest_draw
from sling2sim2real.identification.results.theta import load_samples, load_theta, parameters_of
from sling2sim2real.launching.surface.simulator import simulator
from sling2sim2real.launching.trials.spread import LEVEL
from sling2sim2real.settings import expect_known
from sling2sim2real.settings.identification import POSTERIOR
from sling2sim2real.simulator.rubber import RUBBER
from stages.start import stage_of


def observe(
    params: Params,
    band: str,
    method: str,
    draw: tuple[float, float],
    landing: float,
    *,
    error: float | None = None,
    again: bool = False,
    run: bool = True,
    root: Path | str = ".",
) -> dict:
    """Put a launch into data/evidence/<band>.csv and run the stages that it makes stale.

    Args:
        params: The whole of params.yaml.
        method: That is identified anew, one that searches by least squares.
        draw, landing: As measured [m].
        error: Standard deviation of the draw along each axis [m]; None: of a commanded one.
        again: Whether one that equals another is one more launch, instead of a mistake.
        run: Whether stages run; else the launch is noted, no more.
        root: Of the project.

    Returns:
        `file`, `launches` in it, `measured_m` of this one, what `prediction_of` says `before` and
        `after`, and `warnings`, which are printed on stderr before stages run.

    Raises:
        UserError: It can be no launch, or is known already, and nothing is written; or a stage
            fails, and the launch stays.
    """
    layout, stage = _place_and_stage(params, band, method, run, root)
    expect_above_floor(params, draw)
    equal = "added" if again else "refused"
    number = evidence.add(layout, band, [(*draw, error, landing)], equal)
    answer = {"file": str(layout.evidence / f"{band}.csv"), "launches": number}
    answer["measured_m"] = landing
    answer["before"] = prediction_of(params, band, method, draw, layout.root, error)
    doubts = list(doubted(answer["before"], landing, answer["file"]))
    earlier = evidence.read(layout.evidence / f"{band}.csv")[:-1]
    doubts += softened(params, band, method, draw, layout, [launch[:2] for launch in earlier])
    safety.tell(doubts)
    ran = _run(stage, layout)
    answer["after"] = prediction_of(params, band, method, draw, layout.root, error) if ran else None
    if failure := (answer["after"] or {}).get("failure"):
        what = f"the launch fails in simulation, so it counts for nothing: {failure}"
        doubts.append(Hazard("failure", what))
        safety.tell(doubts[-1:])
    answer["warnings"] = safety.as_json(doubts)
    return answer


def undo(
    params: Params, band: str, method: str, *, run: bool = True, root: Path | str = "."
) -> dict:
    """Take the last launch out of data/evidence/<band>.csv, and run what that makes stale.

    Returns:
        As `observe` does, and `removed`: `draw` and `error` of the launch.

    Raises:
        UserError: There is none, and nothing has changed; or a stage fails, and it stays out.
    """
    layout, stage = _place_and_stage(params, band, method, run, root)
    (y, z, error, landing), number = evidence.without_last(layout, band)
    answer = {"file": str(layout.evidence / f"{band}.csv"), "launches": number}
    answer |= {"measured_m": landing, "removed": {"draw": [y, z], "error": error}}
    answer["before"] = prediction_of(params, band, method, (y, z), layout.root, error)
    ran = _run(stage, layout)
    answer["after"] = (
        prediction_of(params, band, method, (y, z), layout.root, error) if ran else None
    )
    return answer | {"warnings": []}


def _place_and_stage(
    params: Params, band: str, method: str, run: bool, root: Path | str
) -> tuple[Layout, str | None]:
    """Where the band's files lie, and the stage of dvc.yaml that is to run. Raises UserError."""
    expect_known(params, "band", band, called="--band")
    expect_known(params, "method", method, called="--method")
    if params.methods[method].search != POSTERIOR:
        raise UserError(f"--method {method}: takes no launches as evidence, posterior does")
    stage = stage_of(params, "policy", band, method) if run else None
    if run and not stage:
        raise UserError(f"{method} does not run on {band}: see `run:` in params.yaml, or --no-run")
    if run:
        expect_ready(Path(root))
    return Layout(Path(root)), stage


def _run(stage: str | None, layout: Layout) -> bool:
    """Have DVC run a stage; whether there was one. Raises UserError."""
    if stage:
        repro(layout.root, stage, say)
    return bool(stage)


def doubted(before: dict | None, landing: float, file: str) -> Iterator[Hazard]:
    """A measured landing [m] outside the interval that `prediction_of` gave before."""
    if before is None or before["interval_90_m"] is None:
        return
    low, high = before["interval_90_m"]
    if not low <= landing <= high:
        yield Hazard(
            "miss",
            f"{landing:g} m lies outside the predicted interval, {low:.3f} to {high:.3f} m: if draw"
            f" or landing was mistaken, take its row out of {file}",
        )


def softened(
    params: Params,
    band: str,
    method: str,
    draw: tuple[float, float],
    layout: Layout,
    launches: Sequence[tuple[float, float]],
) -> Iterator[Hazard]:
    """A draw (y, z) [m] further than the recordings' and those of `launches` before it."""
    try:
        recorded = deepest_draw(Episode.load_all(layout.episodes(band)))
    except NotMade:
        return
    before = max([recorded, *(float(np.hypot(*earlier_draw)) for earlier_draw in launches)])
    if not further(params.bands[band], params.setup, before, float(np.hypot(*draw))):
        return
    method_params = params.methods[method]
    note = "the launches after it count as of the softened band"
    if method_params.law != RUBBER or method_params.fixed.get("softening") == 0:
        note = f"{method} leaves that out, a new recording tells by how much"
    yield Hazard(
        "stretch",
        f"this launch drew {band} to {np.hypot(*draw):.3f} m, {before:.3f} m was the most before:"
        f" rubber softens up to its largest stretch; {note}",
    )


def prediction_of(
    params: Params,
    band: str,
    method: str,
    draw: tuple[float, float],
    root: Path,
    error: float | None = None,
) -> dict | None:
    """What θ and its samples say; None where nothing has been identified.

    `landing_m` of `draw` and its `interval_90_m` (None where the launch fails), `failure`,
    `returned_share` and its `share_90`.
    """
    layout = Layout(root)
    file = layout.theta(band, method)
    if not file.is_file():
        return None
    content = load_theta(file, band)
    samples = load_samples(layout.confidence(band, method), parameters_of(content))
    launcher = simulator(params, band, content, root=root)
    once = launcher(np.array([draw]))
    note = {"landing_m": None, "interval_90_m": None, "failure": once.failure[0]}
    if once.failure[0] is None:
        note["landing_m"] = float(once.landing_y[0])
        spread = params.trials.actuation_error if error is None else error
        note["interval_90_m"] = interval_90(launcher, draw, samples, spread)
    note["returned_share"] = content.get("returned_share", 1.0)
    ends = [(1 - LEVEL) / 2, (1 + LEVEL) / 2]
    note["share_90"] = (
        None if samples is None else np.quantile(samples.column("returned_share"), ends).tolist()
    )
    return note


def shown(answer: dict) -> str:
    """A few lines for people."""
    count = answer["launches"]
    lines = [f"{answer['file']}: {count} launch{'' if count == 1 else 'es'} as evidence"]
    if removed := answer.get("removed"):
        lines.append("taken out: the draw to {:g}, {:g}".format(*removed["draw"]))
    for when in ("before", "after"):
        if note := answer[when]:
            share = _with_ends(note["returned_share"], note["share_90"], "")
            landed = note["failure"] and f"fails in simulation: {note['failure']}"
            landed = landed or _with_ends(note["landing_m"], note["interval_90_m"], " m")
            lines.append(f"{when:6}  landing {landed}, returned share {share}")
    nothing = "" if answer["after"] else "; nothing has run"
    lines.append(f"measured  {answer['measured_m']:.3f} m{nothing}")
    return "\n".join(lines)


def _with_ends(value: float, ends: list[float] | None, unit: str) -> str:
    note = "" if ends is None else f" (90 %: {ends[0]:.3f} to {ends[1]:.3f}{unit})"
    return f"{value:.3f}{unit}{note}"
