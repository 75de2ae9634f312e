"""What the paper's evaluation says besides its tables: bullseye, sensitivity, hanging bands."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import root_scalar

from pipeline.base.weight import LONGEST, READINGS, tension
from pipeline.identify.results.theta import calibrated, parameters_of
from pipeline.params import Params
from pipeline.report.drawing.styles import Styles
from pipeline.report.run.noise import landed
from pipeline.report.run.results import Result, Results
from pipeline.report.run.tables.benchmark import band_name, ordered
from pipeline.report.run.tables.cells import NONE, Table, number
from pipeline.report.run.tables.landings import LAUNCHED, of_kind
from pipeline.simulator.launch import landing_gradient
from pipeline.simulator.model import ClampedBand
from pipeline.simulator.parameters import Parameters
from pipeline.simulator.rubber import RUBBER, uniaxial

BULLSEYE = 0.20  # m, the target's radius in the paper (III-C)


def bullseye(results: Results, styles: Styles) -> Table | None:
    """How many launches land within BULLSEYE of their target; one that fails is no hit."""
    rows, targets = [], sorted(set(results.trials.target.dropna()))
    for band, methods in results.methods.items():
        for method in ordered(methods):
            for kind in LAUNCHED:
                trials = of_kind(methods[method].trials, kind)
                trials = trials.loc[trials.target.notna()]
                if trials.empty:
                    continue
                hit = landed(trials) & ((trials.landing_y - trials.target).abs() <= BULLSEYE)
                cells = [_share(hit[trials.target == target]) for target in targets]
                all_of_them = f"{_share(hit)} ({100 * hit.mean():.0f} %)"
                rows.append([band_name(band), styles[method].name, kind, *cells, all_of_them])
    heads = ["band", "method", "launches", *(f"g = {100 * g:.1f}" for g in targets), "all targets"]
    return (heads, rows) if rows else None


def _share(hit) -> str:
    return f"{int(hit.sum())} of {len(hit)}" if len(hit) else NONE


def sensitivity(
    results: Results, draws: Mapping[tuple[str, str], np.ndarray], styles: Styles
) -> Table:
    """Table of how far a landing moves for a draw that is 1 cm off, in the worst direction.

    Args:
        draws: By band and method, of the policy for evenly spread targets [m], shape (N, 2).
    """
    rows = []
    for result in results:
        path = draws.get((result.band, result.method))
        if path is None:
            continue
        slope = steepness(result, path)
        finite = slope[np.isfinite(slope)]
        ends = (finite.min(), np.median(finite), finite.max()) if len(finite) else (np.nan,) * 3
        name = styles[result.method].name
        rows.append([band_name(result.band), name, *(number(end, ".0f") for end in ends)])
    return ["band", "method", "least [cm]", "median [cm]", "most [cm]"], rows


def steepness(result: Result, draws: np.ndarray) -> np.ndarray:
    """Size of the landing's gradient by the draw (N, 2) [1], shape (N,), off the simulator's map.

    It is cm of landing for each cm of draw; NaN where a launch fails.
    """
    _, gradient = landing_gradient(lambda some: result.landing_map(some).landing_y, draws)
    return np.linalg.norm(gradient, axis=1)


@dataclass(frozen=True)
class Hanging:
    """Length of half a band with the weight [m], by strands that share it (base/weight.py).

    Attributes:
        method: None: the rig's own rubber.
        rest: Without the weight [m].
        lengths: NaN where the band would be stretched beyond what its law is asked.
        recorded: Largest stretch that the recording shows.
    """

    band: str
    method: str | None
    rest: float
    lengths: dict[int, float]
    recorded: float


def hanging(params: Params, results: Results, methods: tuple[str, ...]) -> list[Hanging]:
    """Rows of every band: the rig's rubber where it is known, then the methods that ran."""
    rows = []
    for band, ran in results.methods.items():
        rest = params.bands[band].rest_length / 2
        recorded = float(next(iter(ran.values())).trials.recorded_stretch.max())
        true = results.floors.get(band, {}).get("hanging_stretch", {})
        if true:
            lengths = {n: rest * (true.get(str(n)) or math.nan) for n in READINGS}
            rows.append(Hanging(band, None, rest, lengths, recorded))
        for method in methods:
            if method in ran:
                theta = ran[method].theta
                sling, best = calibrated(params, band, theta), parameters_of(theta)
                lengths = {n: rest * hanging_stretch(sling, best, n) for n in READINGS}
                rows.append(Hanging(band, method, rest, lengths, recorded))
    return rows


def hanging_stretch(sling: ClampedBand, parameters: Parameters, strands: int) -> float:
    """Stretch of a strand by the calibrated law, ten seconds after it was loaded.

    That is where the law `rubber` has its modulus (simulator/rubber.py). Rubber is taken as
    incompressible and as never loaded before. NaN: beyond LONGEST.

    Args:
        parameters: One sample.
    """
    value = parameters.sample()
    shape = ("mooney_share", "upturn") if parameters.law == RUBBER else ()
    curve = [value[name] for name in shape] or [0.0]
    shear = value["youngs_modulus"] / 3

    def missing(stretch: float) -> float:
        stress = shear * float(uniaxial(np.array(stretch), *curve))
        return stress * sling.area - tension(strands)

    if missing(LONGEST) < 0:
        return float("nan")
    return float(root_scalar(missing, bracket=(1.0, LONGEST)).root)


def hanging_table(rows: list[Hanging], styles: Styles) -> Table:
    """Lengths [cm]; in brackets how much a method is off the rig's; * beyond the recording."""
    true = {row.band: row.lengths for row in rows if row.method is None}
    lines = []
    for row in rows:
        cells = []
        for strands, length in row.lengths.items():
            cell = number(100 * length, ".1f", "not held")
            cell += "*" if length / row.rest > row.recorded else ""
            right = true.get(row.band, {}).get(strands, math.nan)
            off = number(100 * (length / right - 1), "+.0f", "") if row.method else ""
            cells.append(f"{cell} ({off} %)" if off else cell)
        name = "the rig's rubber" if row.method is None else styles[row.method].name
        lines.append([band_name(row.band), name, f"{100 * row.rest:.0f}", *cells])
    return [
        "band",
        "by",
        "without [cm]",
        *(f"{reading} [cm]" for reading in READINGS.values()),
    ], lines
