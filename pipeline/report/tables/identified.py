"""What the searches found beside the parameters: derived quantities, losses."""

from __future__ import annotations

import math

import numpy as np

from pipeline.params import Params
from pipeline.report.results import Results
from pipeline.report.tables.cells import NONE, Table, number, percent
from pipeline.report.tables.parameters import exactly, printed_loss
from sling2sim2real.base.parameters import Quantity
from sling2sim2real.drawing.names import as_code, cell
from sling2sim2real.drawing.styles import Styles
from sling2sim2real.quantities import QUANTITIES, coordinate
from sling2sim2real.settings.identification import POSTERIOR

SEARCHES = {
    POSTERIOR: "a design, then Levenberg-Marquardt",
    "de": "differential evolution",
    "bo": "Bayesian optimisation",
    "adam": "Adam on finite differences",
}
TERMS = {"geom": "geom [cm]", "force": "force [N]", "work": "work [J]"}


def methods(results: Results, params: Params, styles: Styles) -> Table:
    """What each method searched, what it minimises, and what it holds fixed."""
    rows = []
    for method, style in styles.items():
        method_params = params.methods[method]
        terms = [
            term if weight == 1 else f"{weight:g} {term}"
            for term, weight in dict(method_params.weights).items()
            if weight
        ]
        search = SEARCHES.get(method_params.search, f"`{method_params.search}`")
        if method_params.search == "multistart":
            counts = {len(result.regions) for result in results if result.method == method}
            regions = " to ".join(str(count) for count in sorted({min(counts), max(counts)}))
            search = f"DE, then CMA-ES in {regions} region{'s' if max(counts) > 1 else ''}"
            search += "" if method_params.covariance else ", isotropic starts"
        fixed = [_held(name, value) for name, value in method_params.fixed.items()]
        held = ", ".join(fixed) or NONE
        if method_params.search == POSTERIOR:
            terms = ["−2 log p of all recordings and launches"]
        rows.append([style.name, f"`{method}`", search, " + ".join(terms), held])
    return ["method", "in params.yaml", "search", "minimises", "held fixed"], rows


def _held(name: str, value: float) -> str:
    """Write a fixed parameter as in "d 5.00 ms"."""
    return f"{QUANTITIES[name].symbol} {exactly(name, value)} {QUANTITIES[name].unit}".rstrip()


def derived(results: Results, styles: Styles) -> Table | None:
    """Quantities that data can see, with intervals; None where no θ has a confidence."""
    shown = [result for result in results if result.confidence]
    if not shown:
        return None
    present = {name: entry for r in shown for name, entry in r.confidence["derived"].items()}
    quantities = {name: quantity for name, quantity in QUANTITIES.items() if name in present}
    for name in sorted(present.keys() - quantities):
        words = name.replace("_", " ")
        quantities[name] = Quantity(name, words, words, present[name]["unit"])
    rows = []
    for result in shown:
        entries = result.confidence["derived"]
        cells = [
            ranged(entries.get(name), quantity.factor) for name, quantity in quantities.items()
        ]
        rows.append([result.band, styles[result.method].name, *cells])
    return ["band", "method", *(quantity.heading for quantity in quantities.values())], rows


def ranged(entry: dict | None, factor: float) -> str:
    """A value and its interval, with as many digits as the interval's width deserves."""
    if entry is None:
        return NONE
    if "low" not in entry:
        return f"{factor * entry['value']:.3g}"
    value, low, high = (factor * entry[key] for key in ("value", "low", "high"))
    width = high - low
    if width <= 0:
        return f"{value:.3g}, fixed"
    digits = max(1 - math.floor(math.log10(width)), 0)
    return f"{value:.{digits}f} ({low:.{digits}f} – {high:.{digits}f})"


def recordings(results: Results, styles: Styles) -> Table:
    """What of each recording the simulation leaves, and how the others alone would have it.

    The last two columns are for bands with several recordings.
    """
    rows = []
    for result in results:
        for count, recording in enumerate(result.confidence.get("recordings", []), 1):
            file, without = recording.get("source", {}).get("file"), recording.get("without_it")
            moved = without and max(without["moved"].items(), key=lambda pair: abs(pair[1]))
            rows.append(
                [
                    result.band,
                    styles[result.method].name,
                    cell(as_code(file)) if file else str(count),
                    f"{1e3 * recording['force_rms']:.0f}",
                    f"{1e3 * recording['held_rms']:.1f}",
                    f"{1e3 * recording['recoil_rms']:.1f}",
                    ", ".join(f"{1e3 * time:.0f}" for time in recording["pictures"]) or NONE,
                    f"{without['misfit']:.1f}" if without else NONE,
                    f"{coordinate(moved[0])} {moved[1]:+.1f} sd" if moved else NONE,
                ]
            )
    heads = ["band", "method", "recording", "force [mN]", "held band [mm]", "recoil [mm]"]
    return [*heads, "recoil seen after [ms]", "misfit without it", "which moves"], rows


def observed(results: Results, styles: Styles) -> Table | None:
    """Launches that were evidence: none of them is a score; None where there are none."""
    rows = [
        [
            result.band,
            styles[result.method].name,
            f"{launch['draw'][0]:.3f}, {launch['draw'][1]:.3f}",
            number(launch["landing"], ".3f"),
            NONE if launch["left"] is None else f"{100 * launch['left']:+.1f} %",
        ]
        for result in results
        for launch in result.confidence.get("launches", [])
    ]
    heads = ["band", "method", "draw (y, z) [m]", "landing [m]", "farther than simulated"]
    return (heads, rows) if rows else None


def losses(results: Results, params: Params, styles: Styles) -> Table:
    """Terms of the loss at θ, the share that each weighs, the printed total, and the budget."""
    loss_terms = {
        term for of_result in results for term in of_result.theta.get("loss", {}) if term != "total"
    }
    terms = TERMS | {term: term for term in sorted(loss_terms - TERMS.keys())}
    heads = ["band", "method", *terms.values(), "total of its own loss", "printed loss", "rollouts"]
    rows = []
    for result in results:
        loss, weights = result.theta.get("loss", {}), dict(params.methods[result.method].weights)
        another = params.methods[result.method].search == POSTERIOR  # minimises no such sum
        total = math.nan if another else loss.get("total", math.nan)
        cells = []
        for term in terms:
            weight, value = weights.get(term, 0.0), loss.get(term, math.nan)
            share = f" ({percent(weight * value / total)})" if weight else " (unused)"
            share = share if np.isfinite(value) and not another else ""
            cells.append(number(value, ".3g") + share)
        common = printed_loss(result)
        spent = result.theta.get("rollouts", len(result.evaluations))
        cells += [number(total, ".4g"), number(common, ".4g"), str(spent)]
        rows.append([result.band, styles[result.method].name, *cells])
    return heads, rows
