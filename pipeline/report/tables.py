"""Numbers of the report as tables: landing errors, identified parameters, losses, budgets.

A table is (heads, rows) of strings; `markdown` prints it. Centimetres and per cent appear here and
nowhere else.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import pandas as pd

from pipeline.params import TARGET_AREA
from pipeline.report import paper
from pipeline.report.results import Result, Results
from pipeline.sling.model import THETA

AIM = 0.05  # mean error of predicted landings inside the recorded stretch, share of the distance
Table = tuple[list[str], list[list[str]]]
NAMES = {
    "youngs_modulus": "E [Pa]",
    "poissons_ratio": "ν",
    "elasticity_damping": "d [ms]",
    "dynamic_friction": "friction",
    "damping_scale": "s",
}


def markdown(table: Table) -> str:
    heads, rows = table
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def landing_errors(trials: pd.DataFrame) -> dict:
    """Statistics of launches that had targets: by target, and under "all" over every target.

    A launch fails that has a failure or lands outside the fixed target area. Returns for each key
    launches, failed, and over the rest mean and std of |y - g|, and bias, the mean of y - g [m].
    "all" has two deviations, because the paper's mixes them: `pooled_std` (within targets) and
    `std` (over all launches). Deviations are those of a sample, NaN for fewer than two.
    """
    trials = trials[trials.target.notna()]
    inside = trials.landing_y.between(*TARGET_AREA)
    good = trials.failure.isna() & trials.landing_y.notna() & inside

    def statistics(chosen: pd.Series) -> dict:
        rows = trials[chosen & good]
        miss = rows.landing_y - rows.target
        return {
            "launches": int(chosen.sum()),
            "failed": int((chosen & ~good).sum()),
            "mean": float(miss.abs().mean()),
            "std": float(miss.abs().std(ddof=1)),
            "bias": float(miss.mean()),
        }

    result = {target: statistics(trials.target == target) for target in sorted(set(trials.target))}
    variances = [one["std"] ** 2 for one in result.values() if np.isfinite(one["std"])]
    everything = statistics(pd.Series(True, index=trials.index))
    everything["pooled_std"] = math.sqrt(np.mean(variances)) if variances else math.nan
    return {**result, "all": everything}


def landings(results: Results, band: str, kind: str) -> Table | None:
    """Landing error by method and target [cm] with the paper's beside it; None without launches."""
    rows = []
    targets: list[float] = []
    for method, result in results.methods[band].items():
        trials = result.trials[(result.trials.kind == kind) & result.trials.target.notna()]
        if trials.empty:
            continue
        errors = landing_errors(trials)
        targets = [key for key in errors if key != "all"]
        total = errors["all"]
        rows.append(
            [
                method,
                kind,
                *(_spread(errors[target], "std") for target in targets),
                _spread(total, "pooled_std"),
                _number(100 * total["std"], ".2f"),
                _number(100 * total["bias"], "+.2f"),
                f"{total['failed']} of {total['launches']}",
            ]
        )
    if not rows:
        return None
    their_band = paper.BANDS.get(band)
    shown_methods = {paper.METHODS.get(method) for method in results.methods[band]}
    for (of_band, method), cells in paper.LANDING.items():
        if (of_band, tuple(targets)) == (their_band, paper.TARGETS) and method in shown_methods:
            shown = [f"{c[0]:.2f} ± {c[1]:.2f}" if c else "N/A" for c in cells]
            rows.append([f"*paper: {method}*", "*paper, real robot*", *shown, "", "", ""])
    heads = [
        "method",
        "launches",
        *(f"g = {target:g} m" for target in targets),
        "all targets (± within targets)",
        "± over all",
        "bias",
        "failed",
    ]
    return heads, rows


def predictions(trials: pd.DataFrame) -> Table:
    """Predicted beside measured landing, launch by launch, with the error in % of distance."""
    measured = bool(trials.landing_y.notna().any() or trials.failure.notna().any())
    heads = ["draw y, z [m]", "stretch", "hold force, predicted [N]", "predicted [m]"]
    heads += ["measured [m]", "error"] if measured else ["target [m]"]
    rows = []
    for trial in trials.itertuples():
        beyond = "" if trial.stretch <= trial.recorded_stretch else " (beyond)"
        row = [
            f"{trial.draw_y:.3f}, {trial.draw_z:.3f}",
            f"{trial.stretch:.2f}{beyond}",
            _number(trial.hold_force, ".1f"),
            _number(trial.predicted_y, ".3f", trial.predicted_failure),
        ]
        if measured:
            error = 100 * (trial.predicted_y / trial.landing_y - 1)
            row += [_number(trial.landing_y, ".3f", trial.failure), _number(error / 100, "+.1%")]
        else:
            row += [_number(trial.target, ".3f", "")]
        rows.append(row)
    return heads, rows


def prediction_error(trials: pd.DataFrame) -> dict[str, dict]:
    """Errors predicted / measured - 1 inside and beyond the recorded stretch.

    Keys "inside", "beyond", "all", each with `launches` (those compared), `unpredicted` (their
    simulation failed) of `tried`, and over those compared the mean and max of the error's size and
    its signed mean, `bias` (fractions, NaN if none).
    """
    signed = trials.predicted_y / trials.landing_y - 1
    error = signed.abs()
    inside = trials.stretch <= trials.recorded_stretch
    parts = {"inside": inside, "beyond": ~inside, "all": pd.Series(True, index=trials.index)}
    return {
        name: {
            "launches": int((chosen & error.notna()).sum()),
            "mean": float(error[chosen].mean()),
            "max": float(error[chosen].max()),
            "bias": float(signed[chosen].mean()),
            "tried": int(chosen.sum()),
            "unpredicted": int((chosen & trials.predicted_y.isna()).sum()),
        }
        for name, chosen in parts.items()
    }


def prediction_summary(results: Results, band: str) -> Table | None:
    """Mean prediction error of each method on measured launches."""
    rows = []
    for method, result in results.methods[band].items():
        trials = result.trials[result.trials.kind == "measured"]
        if not trials.empty:
            parts = prediction_error(trials)
            total = parts["all"]
            rows.append(
                [
                    method,
                    *(_share(parts[name]) for name in ("inside", "beyond", "all")),
                    _number(100 * total["bias"], "+.1f"),
                    f"{total['unpredicted']} of {total['tried']}",
                ]
            )
    heads = ["method", "inside the recorded stretch", "beyond it", "all launches", "bias [%]"]
    heads += ["not predicted"]
    return (heads, rows) if rows else None


def parameters(results: Results, params) -> Table:
    """Identified θ by band and method, with the box of the search and the paper's own."""
    box = {name: getattr(params.parameters, name) for name in THETA}
    heads = ["band", "method", *(NAMES[name] for name in THETA)]
    bounds = [f"{_physical(n, box[n].low)} – {_physical(n, box[n].high)}" for n in THETA]
    rows = [["*box*", f"*{'/'.join(sorted({b.scale for b in box.values()}))} scale*", *bounds]]
    for band, methods in results.methods.items():
        for method, result in methods.items():
            theta = result.theta["theta"]
            cells = [
                _physical(name, theta[name]) + (" ⚠" if at_edge(theta[name], box[name]) else "")
                for name in THETA
            ]
            rows.append([band, method, *cells])
        if paper.BANDS.get(band) in paper.THETA:
            theirs = paper.THETA[paper.BANDS[band]]
            cells = [_physical(name, value) for name, value in zip(THETA, theirs[:5], strict=True)]
            rows.append([f"*{paper.BANDS[band]}*", "*paper, other solver*", *cells])
    return heads, rows


def at_edge(value: float, box) -> bool:
    """Whether the search ended within 1 % of a side of its box: the optimum may lie outside."""
    low, high = box.low, box.high
    if box.scale == "log":
        value, low, high = math.log(value), math.log(low), math.log(high)
    return not 0.01 <= (value - low) / (high - low) <= 0.99


def losses(results: Results, params) -> Table:
    """Terms of the loss at θ, the share that each weighs in the total, and the rollouts spent."""
    weights = {
        method: dict(params.methods[method].weights)
        for methods in results.methods.values()
        for method in methods
    }
    terms = list(dict.fromkeys(name for one in weights.values() for name in one))
    unit = {"geom": "cm", "force": "N", "work": "J", "taut": "cm"}
    heads = ["band", "method", *(f"{t} [{unit.get(t, '-')}]" for t in terms), "total", "rollouts"]
    rows = []
    for band, methods in results.methods.items():
        for method, result in methods.items():
            loss = result.theta.get("loss", {})
            total = loss.get("total", math.nan)
            cells = []
            for term in terms:
                weight = weights[method].get(term, 0.0)
                value = loss.get(term, math.nan)
                share = f" ({100 * weight * value / total:.0f} %)" if weight else " (unused)"
                cells.append(_number(value, ".3g", "–") + (share if np.isfinite(value) else ""))
            rows.append([band, method, *cells, _number(total, ".4g"), str(len(result.history))])
    return heads, rows


def aims(result: Result, targets: np.ndarray, draws: np.ndarray) -> Table:
    """The policy's draws, shape (N, 2) [m], for targets [m], and what its simulator says."""
    landed = result.landing_map(draws)
    heads = ["target [m]", "draw y, z [m]", "predicted [m]", "hold force [N]"]
    rows = [
        [
            f"{target:.3f}",
            f"{y:.4f}, {z:.4f}",
            _number(landing, ".3f", reason),
            _number(force, ".1f"),
        ]
        for target, (y, z), landing, force, reason in zip(
            targets,
            draws,
            landed.landing_y,
            landed.hold_force,
            (result.landing_map.reasons[code] for code in landed.failure),
            strict=True,
        )
    ]
    return heads, rows


def policies(results: Results) -> Table:
    """How each policy converged in its own simulator, and how well its map interpolates."""
    heads = ["band", "method", "converged", "mean error [cm]", "largest", "map error", "largest"]
    rows = []
    for result in each(results):
        training, near = result.card["training"], result.card["landing_map"]["target_range"]
        rows.append(
            [
                result.band,
                result.method,
                "yes" if training["converged"] else "**no**",
                *(
                    _number(value and 100 * value, ".2f")
                    for source in (training, near)
                    for value in (source["mean_error_m"], source["max_error_m"])
                ),
            ]
        )
    return heads, rows


def metrics(results: Results) -> dict:
    """What `dvc metrics show` shows: losses and landing errors by band and method."""
    content: dict = {}
    for result in each(results):
        entry: dict = {"loss": _rounded(result.theta.get("loss", {}).get("total"), 1)}
        entry["policy_error_cm"] = _rounded(result.card["training"]["mean_error_m"], 100)
        for kind, trials in result.trials.groupby("kind", sort=True):
            if kind != "predicted" and trials.target.notna().any():
                total = landing_errors(trials)["all"]
                entry[f"{kind}_landing_error_cm"] = _rounded(total["mean"], 100)
                entry[f"{kind}_failed"] = total["failed"]
            if kind == "measured":
                for part, error in prediction_error(trials).items():
                    entry[f"prediction_error_{part}_percent"] = _rounded(error["mean"], 100)
                    entry[f"prediction_bias_{part}_percent"] = _rounded(error["bias"], 100)
                    entry[f"unpredicted_{part}"] = error["unpredicted"]
        content.setdefault(result.band, {})[result.method] = entry
    return content


def each(results: Results) -> Iterable[Result]:
    for methods in results.methods.values():
        yield from methods.values()


def _physical(name: str, value: float) -> str:
    if name == "youngs_modulus":
        return f"{value:.2e}".replace("e+0", "e")
    if name == "elasticity_damping":
        return f"{1e3 * value:.3g}"
    return f"{value:.3g}"


def _spread(one: dict, deviation: str) -> str:
    """Mean ± deviation in cm, N/A where every launch failed; partial failures are counted."""
    if one["failed"] == one["launches"]:
        return "N/A"
    failed = f" ({one['failed']} failed)" if one["failed"] else ""
    if not np.isfinite(one[deviation]):
        return f"{100 * one['mean']:.2f}{failed}"
    return f"{100 * one['mean']:.2f} ± {100 * one[deviation]:.2f}{failed}"


def _share(part: dict) -> str:
    if not part["launches"]:
        return "no launches"
    return (
        f"{100 * part['mean']:.1f} % (max {100 * part['max']:.1f} %, {part['launches']} launches)"
    )


def _number(value: float, form: str, otherwise: str | None = "–") -> str:
    """`value` in a format such as ".3f", or `otherwise` where there is none."""
    if value is not None and np.isfinite(value):
        return format(value, form)
    return otherwise if isinstance(otherwise, str) else "–"


def _rounded(value: float | None, factor: float) -> float | None:
    return round(factor * value, 4) if value is not None and np.isfinite(value) else None
