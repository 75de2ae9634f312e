"""Where launches landed: beside their targets, and beside their predictions."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from pipeline.report.noise import landed
from pipeline.report.results import Results
from pipeline.report.tables.cells import NONE, Table, number, percent
from sling2sim2real.drawing.styles import Styles

LAUNCHED = ("virtual", "measured")  # kinds of launches that landed, or failed to


def of_kind(trials: pd.DataFrame, *kinds: str) -> pd.DataFrame:
    """Launches of some kinds."""
    return trials.loc[trials.kind.isin(kinds)]


@dataclass(frozen=True)
class LandingErrors:
    """Launches at one target or at several, [m]; NaN where not known.

    Attributes:
        launches: All; `failed` of them have a failure or land outside the fixed target area; None
            where nobody says.
        mean, std: Of |y - g| over the rest. Deviations are those of a sample, NaN for fewer than
            two.
        within: Deviation within targets. The paper's "±" mixes the two.
        bias: The mean of y - g.
    """

    launches: int
    failed: int | None
    mean: float
    std: float
    within: float
    bias: float = math.nan


def landing_errors(trials: pd.DataFrame) -> dict[float | str, LandingErrors]:
    """Landing errors of launches that had targets: by target, and over every target under "all"."""
    trials = trials.loc[trials.target.notna()]
    good = landed(trials)

    def statistics(chosen: pd.Series) -> LandingErrors:
        rows = trials.loc[chosen & good]
        miss = rows.landing_y - rows.target
        std = float(miss.abs().std(ddof=1))
        return LandingErrors(
            launches=int(chosen.sum()),
            failed=int((chosen & ~good).sum()),
            mean=float(miss.abs().mean()),
            std=std,
            within=std,
            bias=float(miss.mean()),
        )

    result = {target: statistics(trials.target == target) for target in sorted(set(trials.target))}
    everything = statistics(pd.Series(True, index=trials.index))
    return {**result, "all": replace(everything, within=within(result.values()))}


def within(parts: Iterable[LandingErrors]) -> float:
    """Deviation within targets, each weighed by its launches less one [m]; NaN of none."""
    weighed = [(n.launches - (n.failed or 0) - 1, n.std) for n in parts if np.isfinite(n.std)]
    freedom = sum(count for count, _ in weighed)
    return math.sqrt(sum(n * std**2 for n, std in weighed) / freedom) if freedom else math.nan


def predictions(trials: pd.DataFrame) -> Table:
    """Predicted beside measured landing, launch by launch, with the error in % of distance."""
    measured = bool(trials.landing_y.notna().any() or trials.failure.notna().any())
    ranged = trials.predicted_low.notna().any()
    heads = ["draw y, z [m]", "stretch", "hold force, predicted [N]", "predicted [m]"]
    heads += ["90 % interval"] if ranged else []
    heads += ["measured [m]", "error"] if measured else ["target [m]"]
    rows = []
    for trial in trials.to_dict("records"):
        stretch, predicted, landing = (trial[n] for n in ("stretch", "predicted_y", "landing_y"))
        beyond = "" if stretch <= trial["recorded_stretch"] else " (beyond)"
        row = [f"{trial['draw_y']:.3f}, {trial['draw_z']:.3f}", f"{stretch:.2f}{beyond}"]
        row.append(number(trial["hold_force"], ".1f"))
        row.append(number(predicted, ".3f", trial["predicted_failure"]))
        if ranged:
            ends = (number(trial[f"predicted_{end}"], ".3f") for end in ("low", "high"))
            row.append(" – ".join(ends))
        if measured:
            error = predicted / landing - 1
            row += [number(landing, ".3f", trial["failure"]), number(error, "+.1%")]
        else:
            row.append(number(trial["target"], ".3f", ""))
        rows.append(row)
    return heads, rows


def _parts(trials: pd.DataFrame) -> dict[str, pd.Series]:
    """Which launches stretch the band no further than the recording did, which do, and all."""
    inside = trials.stretch <= trials.recorded_stretch
    return {"inside": inside, "beyond": ~inside, "all": inside | ~inside}


@dataclass(frozen=True)
class PredictionError:
    """Errors predicted / measured - 1 of some launches, as fractions; NaN of none.

    Attributes:
        launches: That could be compared.
        mean, max: Of the errors' size.
        bias: Their signed mean.
        tried, unpredicted: All launches, and those whose simulation failed.
    """

    launches: int
    mean: float
    max: float
    bias: float
    tried: int
    unpredicted: int


@dataclass(frozen=True)
class Coverage:
    """How many of `launches` landings lie in their predicted 90 % intervals.

    Attributes:
        width: Median width of the intervals, as a share of the landing.
    """

    launches: int
    covered: int
    width: float


def prediction_error(trials: pd.DataFrame) -> dict[str, PredictionError]:
    """Prediction errors "inside" and "beyond" the recorded stretch, and of "all"."""
    signed = trials.predicted_y / trials.landing_y - 1
    error = signed.abs()
    return {
        name: PredictionError(
            launches=int((chosen & error.notna()).sum()),
            mean=float(error[chosen].mean()),
            max=float(error[chosen].max()),
            bias=float(signed[chosen].mean()),
            tried=int(chosen.sum()),
            unpredicted=int((chosen & trials.predicted_y.isna()).sum()),
        )
        for name, chosen in _parts(trials).items()
    }


def intervals(trials: pd.DataFrame) -> dict[str, Coverage] | None:
    """Coverage of launches with landing and interval, by the same keys; None without intervals."""
    if trials.predicted_low.isna().all():
        return None
    both = trials.predicted_low.notna() & trials.landing_y.notna()
    covered = trials.landing_y.between(trials.predicted_low, trials.predicted_high)
    width = (trials.predicted_high - trials.predicted_low) / trials.landing_y
    return {
        name: Coverage(
            launches=int((chosen & both).sum()),
            covered=int((chosen & both & covered).sum()),
            width=float(width[chosen & both].median()),
        )
        for name, chosen in _parts(trials).items()
    }


def prediction_summary(results: Results, styles: Styles) -> Table | None:
    """Prediction error of each method on launches of each kind, and what its intervals cover."""
    rows, beyond = [], False
    for result in results:
        for kind in LAUNCHED:
            trials = of_kind(result.trials, kind)
            if trials.empty:
                continue
            parts, ranges = prediction_error(trials), intervals(trials) or {}
            beyond |= parts["beyond"].tried > 0
            bias = number(100 * parts["all"].bias, "+.1f")
            unpredicted = f"{parts['all'].unpredicted} of {parts['all'].tried}"
            mark = "" if result.confidence else " †"
            covered = [coverage(ranges.get(name)) for name in ("inside", "beyond")]
            covered = [text + mark * (text != NONE) for text in covered]
            shares = (_share(parts[name]) for name in ("inside", "beyond"))
            names = result.band, styles[result.method].name, kind
            rows.append([*names, *shares, bias, unpredicted, *covered])
    heads = ["band", "method", "launches", "error inside the recorded stretch", "beyond it"]
    heads += ["bias [%]", "not predicted", "in the 90 % interval, inside", "beyond"]
    if not beyond:
        columns = [n for n, head in enumerate(heads) if not head.startswith("beyond")]
        heads, *rows = ([row[n] for n in columns] for row in (heads, *rows))
    return (heads, rows) if rows else None


def _share(part: PredictionError) -> str:
    if not part.launches:
        return NONE
    mean, most = percent(part.mean, ".1f"), percent(part.max, ".1f")
    return f"{mean} (max {most}, {part.launches} launches)"


def coverage(part: Coverage | None) -> str:
    """How many landings lie in their intervals, and how wide these are."""
    if not part or not part.launches:
        return NONE
    width = percent(part.width, ".2g")
    return f"{part.covered} of {part.launches}, median width {width}"
