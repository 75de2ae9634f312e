"""Dips of a pull that suit a band: `sling plan --pull designed`."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from app.plan.trajectory import Trajectory
from pipeline.base.errors import UserError
from pipeline.base.machine import cores
from pipeline.episode.planned import PULL
from pipeline.identify.posterior.design import PullDesign, PullLimits, searched
from pipeline.params import Params
from pipeline.params.identification import LEAST_SQUARES
from pipeline.params.lab import Dip, PlanParams
from pipeline.simulator.rubber import RUBBER

LONGEST = 15.0  # s from the grasp to the release
HALF = 1.645  # standard deviations: of a 90 % interval
USUAL = 0.5  # of setup.max_force: what a band of unknown force is taken to hold


@dataclass(frozen=True)
class DesignedPull:
    """Dips that were found, and what is expected of them.

    Attributes:
        dips: In the order of the pull.
        targets: Landings [m], shape (T,).
        paths: By pull: times from the pull's begin [s], and how far the band is drawn [m].
        half_widths: By pull: of the landings' 90 % intervals [m], shape (T,).
        draws: Of the prior, that were averaged over.
        tried: How many pulls.
    """

    dips: tuple[Dip, ...]
    targets: np.ndarray
    paths: dict[str, tuple[np.ndarray, np.ndarray]]
    half_widths: dict[str, np.ndarray]
    draws: int
    tried: int

    def content(self) -> dict:
        """Return the design for JSON."""
        return {
            "targets_m": self.targets.tolist(),
            "half_width_m": {name: row.tolist() for name, row in self.half_widths.items()},
            "prior_draws": self.draws,
            "pulls_tried": self.tried,
        }

    def to_text(self) -> str:
        lines = [f"{'expected 90 % interval at':<28}" + "".join(f"{t:>9g} m" for t in self.targets)]
        for name, row in self.half_widths.items():
            lines.append(f"{name:<28}" + "".join(f"   ±{100 * w:4.1f} cm" for w in row))
        lines += [
            f"over {self.draws} bands that could be this one, {self.tried} pulls tried; pictures of"
            " the recoil and what the law gets wrong are left out",
            "to keep these dips, write under `plan:` of params.yaml:",
            as_yaml(self.dips),
        ]
        return "\n".join(lines)

    def picture(self) -> bytes:
        """PNG: the pulls, and the intervals."""
        from matplotlib.figure import Figure
        from matplotlib.style import context

        from pipeline.report.drawing.styles import COLORS, THEME

        with context(THEME):
            figure = Figure(figsize=(7.0, 3.0))
            left, right = figure.subplots(1, 2, width_ratios=(2, 1))
            for i, (name, (time, way)) in enumerate(self.paths.items()):
                left.plot(time, way, color=COLORS[i], label=name, zorder=3 - i)
                right.plot(self.targets, 100 * self.half_widths[name], "o-", color=COLORS[i])
            left.set_xlabel("time [s]")
            left.set_ylabel("drawn [m]")
            left.legend()
            right.set_xlabel("target [m]")
            right.set_ylabel("90 % interval [± cm]")
            right.set_ylim(bottom=0)
            file = io.BytesIO()
            figure.savefig(file, dpi=150, format="png")
        return file.getvalue()


def designed_pull(
    params: Params,
    band: str,
    plan: PlanParams,
    way: Trajectory,
    longest: float,
    force: float | None,
    progress: Callable[[str], None] = lambda line: None,
) -> DesignedPull:
    """Search dips for a band that `force` [N] holds at the draw; None: unknown.

    Args:
        plan: With the draw, and the dips that are to be beaten.
        way: Without dips.
        longest: From the grasp to the release [s].
        progress: Of the search, a line now and then.

    Raises:
        UserError: params.yaml has no method that could use them.
    """
    methods = params.methods.items()
    method = next(
        (
            name
            for name, method_params in methods
            if (method_params.search, method_params.law) == (LEAST_SQUARES, RUBBER)
        ),
        None,
    )
    if method is None:
        raise UserError(
            f"params.yaml: no method has search: {LEAST_SQUARES} and law: {RUBBER}, which alone"
            " learns from dips; take --pull informative or paper"
        )
    lasts = way.until("release")
    design = PullDesign.of(
        params,
        method,
        band,
        plan.draw,
        (lasts[PULL], lasts["pause"]),
        force if force is not None else USUAL * params.setup.max_force,
        params.trials.targets,
        cores(),
    )
    if not len(design.phi):
        raise UserError(
            "no launch of any band that could be this one lands: look at setup.draw_y, draw_z and"
            " trials.targets"
        )
    limits = PullLimits(
        plan.max_speed,
        plan.max_acceleration,
        min(LONGEST, longest) - sum(lasts[name] for name in ("grasp", "lift", PULL, "pause")),
    )
    count = 0

    def tell(dips: Sequence[Dip], variance: float) -> None:
        nonlocal count
        count += 1
        if count % 5 == 1:
            progress(
                f"pull {count}: {len(dips)} dips, ±{100 * HALF * variance**0.5:.2f} % of a landing"
            )

    dips = searched(design, limits, tell)
    targets = np.array(params.trials.targets)
    pulls = {"paper": (), "plan.dips": plan.dips, "designed": dips}
    return DesignedPull(
        dips=dips,
        targets=targets,
        paths={name: _path(design, candidate) for name, candidate in pulls.items()},
        half_widths={
            name: HALF * np.sqrt(design.variances(candidate)) * targets
            for name, candidate in pulls.items()
        },
        draws=len(design.phi),
        tried=count,
    )


def _path(design: PullDesign, dips: Sequence[Dip]) -> tuple[np.ndarray, np.ndarray]:
    episode = design.episode(dips)
    away = np.array([0.0, *design.draw]) / np.hypot(*design.draw)
    way = episode.position @ away
    held = (episode.time < episode.release_time) & (episode.time > episode.grasp_time)
    held &= np.maximum.accumulate(way) > 1e-3
    return episode.time[held] - episode.time[held][0], way[held]


def as_yaml(dips: Sequence[Dip]) -> str:
    """Write dips in the form of params.yaml."""
    if not dips:
        return "  dips: []"
    rows = [
        f"  {'-' if i == 0 else ' '} {name}: {value}"
        for dip in dips
        for i, (name, value) in enumerate(dip.model_dump().items())
    ]
    return "\n".join(["  dips:", *rows])
