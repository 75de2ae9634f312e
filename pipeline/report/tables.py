"""The tables of the report: DataFrames of text, and those of numbers for machines.

Centimetres, milliseconds and per cent appear in tables and nowhere else.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Sequence

import numpy as np
import pandas as pd

from pipeline.report import paper
from pipeline.report.data import Result, Run
from pipeline.report.statistics import ALL, landing_errors, prediction_errors, within
from sling2sim2real.identification.results.ranges import searched
from sling2sim2real.quantities import QUANTITIES, rounded
from sling2sim2real.settings.identification import LAWS, POSTERIOR
from sling2sim2real.simulator.parameters import THETA
from sling2sim2real.simulator.rubber import RUBBER

NONE = "–"
MINUS = re.compile(r"(?<![\w.])-(?=\d)")  # before a number, not in 1E-3
PAPER = "paper, real robot"
FLOOR, ORACLE = "actuation floor", "virtual, oracle"
PRIOR, LOSS = "prior", "loss"  # what stands in the place of a source, and of a name
BULLSEYE = 0.20  # m, the target's radius in the paper (III-C)
APART = {*paper.OPTIMISERS, *paper.ABLATIONS} - set(paper.BENCHMARK)  # tables 3 and 4 hold these
NAMES = (*THETA, *LAWS[RUBBER])
RECORDED = {"rig": "virtual", "recording": "measured"}
TERMS = {"geom": "geom [cm]", "force": "force [N]", "work": "work [J]"}


def markdown(table: pd.DataFrame | None, *, repeats: bool = True) -> str:
    """Write a table as markdown; "" of None or of no rows.

    Without `repeats`, cells of the first two columns that repeat those above are blank.
    """
    if table is None or table.empty:
        return ""
    table = table.map(lambda text: MINUS.sub("−", text))
    if not repeats:
        first, second = (table[name] == table[name].shift() for name in table.columns[:2])
        table.iloc[:, 0] = table.iloc[:, 0].mask(first, "")
        table.iloc[:, 1] = table.iloc[:, 1].mask(first & second, "")
    return f"{table.to_markdown(index=False, disable_numparse=True)}\n"


def number(value: float | None, form: str, otherwise: str | None = NONE) -> str:
    """`value` in a format such as ".3f", or `otherwise` where there is none."""
    if value is not None and np.isfinite(value):
        return format(value, form)
    return otherwise if isinstance(otherwise, str) else NONE


def percent(fraction: float, form: str = ".0f") -> str:
    return f"{100 * fraction:{form}} %"


def without_empty(table: pd.DataFrame) -> pd.DataFrame:
    """Without the columns that have nothing in any row."""
    return table.loc[:, (table != NONE).any()]


def ordered(methods: Iterable[str]) -> list[str]:
    """Methods of tables 1 and 2 that ran: the paper's, then others, those of APART last."""
    theirs = [method for method in paper.BENCHMARK if method in methods]
    return list(dict.fromkeys([*theirs, *sorted(methods, key=APART.__contains__)]))


def called(run: Run, method: str) -> str:
    """Name of a method, or of the floor, for readers."""
    return run.styles[method].name if method in run.styles else method


def wide(run: Run, table: pd.DataFrame, column: str, order: Sequence) -> pd.DataFrame:
    """A row a band, method and source, as they stand in `table`, and its `text` by `column`."""
    whose = ["band", "method", "source"]
    cells = table.pivot(index=whose, columns=column, values="text").reindex(columns=list(order))
    cells = cells.fillna(NONE).reset_index()
    cells = pd.DataFrame(table, columns=whose).drop_duplicates().merge(cells, how="left")
    cells["band"] = [paper.BANDS.get(band, band) for band in cells.band]
    cells["method"] = [called(run, method) for method in cells.method]
    return cells


def lowest(values: pd.Series, *groups: pd.Series) -> pd.Series:
    """Which values are the lowest of their group, of those that have two or more."""
    of_group = values.groupby(list(groups))
    return (values == of_group.transform("min")) & of_group.transform("count").gt(1)


def bold(text: pd.Series, chosen: pd.Series) -> pd.Series:
    return text.mask(chosen, "**" + text + "**")


def outcome(run: Run) -> pd.DataFrame | None:
    """Landing errors of the main method and the paper's a recording, and predictions."""
    trials = run.trials.loc[run.trials.source != "predicted"]
    means = landing_errors(trials).query("target == @ALL").set_index(["name", "source", "method"])
    names, rows = [called(run, method) for method in run.references], []
    main = pd.concat([trials.loc[(trials.method == run.main) & (trials.band == band)]
                      for band in run.results])  # fmt: skip
    for _, launches in main.groupby(["band", "name", "source"], sort=False):
        band, name, source = (launches[key].iloc[0] for key in ("band", "name", "source"))
        keys = [(name, source, method) for method in run.references]
        errors = [means.loc[key] if key in means.index else None for key in keys]
        mean = math.nan if errors[0] is None else errors[0]["mean"]
        floor = run.least.get(band, math.nan) if source == "virtual" else math.nan
        found = prediction_errors(launches)
        cells = [NONE if of is None else number(100 * of["mean"], ".1f", "N/A") for of in errors]
        failed = [str(of.failed) for of in errors if of is not None]
        rows.append(
            [
                name if name == band else f"{band}, {name.removeprefix(f'{band}-')}",
                f"{len(launches)} {source}",
                *cells,
                number(100 * floor, ".1f"),
                number(mean / floor, ".1f"),
                " · ".join(failed) or NONE,
                number(100 * found["mean"], ".1f"),
                number(100 * found["bias"], "+.1f"),
                _covered(found),
            ]
        )
    heads = ["band", "launches", *(f"{name} [cm]" for name in names), "actuation floor [cm]"]
    heads += [f"{names[0]} / floor", f"failed: {' · '.join(names)}"]
    heads += ["prediction off by [%]", "bias [%]", "in the 90 % interval"]
    table = pd.DataFrame(rows, columns=heads)
    return without_empty(table) if rows else None


def _covered(found: dict) -> str:
    """How many landings lie in their intervals, and how wide these are."""
    if not found["ranged"]:
        return NONE
    return f"{found['covered']} of {found['ranged']}, median width {percent(found['width'], '.2g')}"


def benchmark(run: Run, methods: Sequence[str] = ()) -> pd.DataFrame:
    """Landing errors as `landing_errors` has them, the paper's own below those of its methods.

    Args:
        methods: Rows of table 3 or 4, on bands where one of APART ran. Of table 1 none: every
            method that stands in no other table, and the actuation floor.
    """
    errors, parts = landing_errors(run.launched), []
    for band, ran in run.results.items():
        if methods and not APART & {*methods} & {*ran}:
            continue
        here = errors.loc[errors.band == band]
        for method in methods or [method for method in ordered(ran) if method not in APART]:
            own = here.loc[here.method == method].sort_values("source", ascending=False)
            parts.append(own)
            if len(own) and (cells := paper.LANDING.get((band, method))):
                parts.append(_papers(band, method, cells))
        if not methods and band in run.floors:
            parts.append(_floor(band, run.floors[band]))
    parts = [part for part in parts if len(part)]
    return pd.concat(parts, ignore_index=True) if parts else errors.iloc[:0]


def _papers(band: str, method: str, cells: Sequence[tuple | None]) -> pd.DataFrame:
    """The paper's cells; its total's ± is what it prints."""
    rows = [
        {"target": target, "mean": cell[0] / 100, "std": cell[1] / 100}
        if cell
        else {"target": target, "mean": math.nan, "std": math.nan}
        for target, cell in zip((*paper.TARGETS, ALL), cells, strict=True)
    ]
    table = pd.DataFrame(rows).assign(within=lambda t: t["std"], failed=math.nan, bias=math.nan)
    table["launches"] = [*[paper.REPEATS] * len(paper.TARGETS), paper.REPEATS * len(paper.TARGETS)]
    table.loc[table.target == ALL, "std"] = math.nan
    return table.assign(name=band, band=band, method=method, source=PAPER)


def _floor(band: str, floor: dict) -> pd.DataFrame:
    """The oracle's launches (rig/oracle/floor.py)."""

    def row(target: float | str, content: dict) -> dict:
        numbers = {n: content.get(f"{n}_m") for n in ("mean_error", "std", "bias")}
        numbers = {n: math.nan if value is None else value for n, value in numbers.items()}
        counts = {"launches": content["launches"], "failed": content.get("failed", 0)}
        mean = numbers.pop("mean_error")
        return {"target": target, "mean": mean, "within": numbers["std"]} | numbers | counts

    of_targets = [row(float(target), content) for target, content in floor["targets"].items()]
    total = row(ALL, floor) | {"within": within(of_targets)}
    table = pd.DataFrame([*of_targets, total])
    return table.assign(name=band, band=band, method=FLOOR, source=ORACLE)


def benchmark_text(run: Run, errors: pd.DataFrame) -> pd.DataFrame:
    """Mean ± deviation in cm; bold: the lowest of a band and source where no launch failed."""
    fair = pd.Series(errors["mean"]).mask(errors.failed > 0)
    best = lowest(fair, errors.band, errors.source, errors.target)
    texts = pd.Series([_spread(row) for row in errors.to_dict("records")], errors.index)
    cells = errors.assign(text=bold(texts, best))
    papers = paper.TARGETS if (errors.source == PAPER).any() else ()
    tried = {target for target in errors.target if target != ALL}
    targets = [*sorted({*run.params.trials.targets, *papers, *tried}), ALL]
    heads = {target: f"g = {100 * target:.1f}" for target in targets[:-1]} | {ALL: "all targets"}
    table = wide(run, cells, "target", targets).rename(columns=heads)
    totals = errors.loc[errors.target == ALL]
    table["± over all"] = [number(100 * std, ".2f") for std in totals["std"]]
    counts = zip(totals.failed, totals.launches, strict=True)
    table["failed"] = [NONE if pd.isna(n) else f"{n:.0f} of {count}" for n, count in counts]
    return table


def _spread(errors: dict) -> str:
    """Mean ± deviation [cm]; N/A where no launch counts; partial failures are counted."""
    if not np.isfinite(errors["mean"]):
        return "N/A"
    around = f" ± {100 * errors['within']:.2f}" if np.isfinite(errors["within"]) else ""
    failed = f", {errors['failed']:.0f} failed" if errors["failed"] > 0 else ""
    return f"{100 * errors['mean']:.2f}{around}{failed}"


def benchmark_records(errors: pd.DataFrame) -> pd.DataFrame:
    """The same for machines: a line a cell, for every target that was tried; empty: not known."""
    columns = {"mean": "mean_error", "std": "std", "within": "std_within_targets", "bias": "bias"}
    names = ["band", "method", "source", "target", "launches", "failed"]
    table = pd.DataFrame(errors, columns=names).astype({"failed": "Int64"})
    table = table.rename(columns={"target": "target_m"})
    for name, words in columns.items():
        table[f"{words}_cm"] = 100 * errors[name]
    table["mean_error_cm"] = [number(mean, ".4g", "N/A") for mean in table.mean_error_cm]
    return table


def identified(run: Run) -> pd.DataFrame:
    """Table 2 [SI]: a row a parameter of each method and band, the paper's own below its methods'.

    Columns band, method, source, name, value, low and high of the 90 % interval (NaN: none known),
    edge (at which end of its range the search ended, or ""), and state: "identified", "not
    identified", "fixed" (not searched), PRIOR (no value, but what is known without the recording)
    or "" where no confidence is known. The printed loss is a row of the name LOSS.
    """
    rows = []
    for band, ran in run.results.items():
        for method in ordered(ran):
            whose, entries = {"band": band, "method": method}, ran[method].confidence
            recorded = whose | {"source": RECORDED[run.params.bands[band].source]}
            rows += [recorded | row for row in _parameters(run, ran[method])]
            rows += [
                whose | {"source": PRIOR, "state": PRIOR, "name": name}
                | dict(zip(("low", "high"), entry["prior"], strict=True))
                for name, entry in entries.get("parameters", {}).items()
                if entry.get("prior")
            ]  # fmt: skip
            printed = dict(zip((*THETA, LOSS), paper.THETA.get((band, method), ()), strict=False))
            rows += [
                whose | {"source": PAPER, "name": name, "value": value}
                for name, value in printed.items()
            ]
    empty = {"value": math.nan, "low": math.nan, "high": math.nan, "state": "", "edge": ""}
    return pd.DataFrame([empty | row for row in rows])


def _parameters(run: Run, result: Result) -> Iterator[dict]:
    ranges, theta = searched(run.params, result.method), result.theta["theta"]
    for name in (name for name in NAMES if name in theta):
        row = {"name": name, "value": theta[name]}
        entry = result.confidence.get("parameters", {}).get(name)
        if name in run.params.methods[result.method].fixed:
            row |= {"state": "fixed"}
        else:
            row |= {"edge": ranges[name].edge(theta[name])}
            if entry:
                state = "identified" if entry["identifiable"] else "not identified"
                row |= {"state": state, "low": entry["low"], "high": entry["high"]}
        yield row
    yield {"name": LOSS, "value": result.printed_loss}


def identified_text(run: Run, table: pd.DataFrame) -> pd.DataFrame:
    """Parameters with their intervals; bold: the least loss of a band and source."""
    text = pd.Series([_value(row) for row in table.to_dict("records")], table.index)
    losses = table.value.where(table.name == LOSS)
    cells = table.assign(text=bold(text, lowest(losses, table.band, table.source)))
    names = [name for name in NAMES if name in THETA or (table.name == name).any()]
    heads = {name: QUANTITIES[name].heading for name in names}
    return wide(run, cells, "name", [*names, LOSS]).rename(columns=heads)


def _value(row: dict) -> str:
    name, value, state = row["name"], row["value"], row["state"]
    if name == LOSS:
        return number(value, ".4f")
    if state == PRIOR:
        return _between(name, row["low"], row["high"])
    shown = _physical(name, value) + " ⚠" * bool(row["edge"])
    if state != "identified":
        return f"{shown}, {state}" if state else shown
    outside = "" if row["low"] <= value <= row["high"] else " †"
    return f"{shown}{outside} ({_between(name, row['low'], row['high'])})"


def _between(name: str, low: float, high: float) -> str:
    """An interval with as few digits as a value, or as many more as tell its ends apart."""
    ends = [(_physical(name, low, n), _physical(name, high, n)) for n in (2, 3, 4, 5)]
    return " to ".join(next((pair for pair in ends if pair[0] != pair[1]), ends[-1]))


def _physical(name: str, value: float, digits: int = 2) -> str:
    """Text as in 929, 11.1, 0.46: a digit more with a unit, else so many after the point."""
    quantity = QUANTITIES[name]
    value *= quantity.factor
    if quantity.unit and value:
        digits = max(digits - math.floor(math.log10(abs(value))), 0)
    return f"{value:.{digits}f}"


def hits(run: Run) -> pd.DataFrame | None:
    """How many launches land within BULLSEYE of their target; one that fails is no hit."""
    launched = run.launched.loc[run.launched.target.notna()]
    if launched.empty:
        return None
    pairs = [(band, method) for band, ran in run.results.items() for method in ordered(ran)]
    order = [pairs.index(pair) for pair in zip(launched.band, launched.method, strict=True)]
    near = launched.assign(order=order, hit=launched.miss.abs() <= BULLSEYE).sort_values("order")
    cells = [
        table.groupby(["order", "band", "method", "source", "target"]).hit.agg(["sum", "size"])
        for table in (near, near.assign(target=ALL))
    ]
    counts = (
        pd.concat(cells).reset_index().sort_values(["order", "source"], ascending=[True, False])
    )
    share = (100 * counts["sum"] / counts["size"]).map(" ({:.0f} %)".format)
    text = counts["sum"].astype(str) + " of " + counts["size"].astype(str)
    counts["text"] = text + share.where(counts.target == ALL, "")
    targets = sorted({*launched.target})
    heads = {target: f"g = {100 * target:.1f}" for target in targets} | {ALL: "all targets"}
    return wide(run, counts, "target", [*targets, ALL]).rename(columns=heads)


def predicted(run: Run) -> pd.DataFrame | None:
    """Prediction error of each method on launches of each source, and what its intervals cover."""
    rows, beyond = [], False
    for result in run:
        here = run.launched.loc[
            (run.launched.band == result.band) & (run.launched.method == result.method)
        ]
        for source in sorted({*here.source}, reverse=True):
            launches = here.loc[here.source == source]
            parts = [
                prediction_errors(launches.loc[launches.inside == side]) for side in (True, False)
            ]
            whole, doubt = prediction_errors(launches), "" if result.confidence else " †"
            beyond |= parts[1]["tried"] > 0
            covered = [_covered(part) + doubt * (part["ranged"] > 0) for part in parts]
            rows.append(
                [
                    result.band,
                    called(run, result.method),
                    source,
                    *map(_share, parts),
                    number(100 * whole["bias"], "+.1f"),
                    f"{whole['unpredicted']} of {whole['tried']}",
                    *covered,
                ]
            )
    heads = ["band", "method", "launches", "error inside the recorded stretch", "beyond it"]
    heads += ["bias [%]", "not predicted", "in the 90 % interval, inside", "beyond"]
    table = pd.DataFrame(rows, columns=heads)
    if not beyond:
        table = table.drop(columns=["beyond it", "beyond"])
    return table if rows else None


def _share(part: dict) -> str:
    if not part["compared"]:
        return NONE
    mean, most = (percent(part[name], ".1f") for name in ("mean", "most"))
    return f"{mean} (max {most}, {part['compared']} launches)"


def launches(trials: pd.DataFrame) -> pd.DataFrame:
    """Predicted beside measured landing, launch by launch, with the error in % of distance."""
    rows = []
    for trial in trials.to_dict("records"):
        ends = [number(trial[f"predicted_{end}"], ".3f") for end in ("low", "high")]
        rows.append(
            {
                "draw y, z [m]": f"{trial['draw_y']:.3f}, {trial['draw_z']:.3f}",
                "stretch": f"{trial['stretch']:.2f}{'' if trial['inside'] else ' (beyond)'}",
                "hold force, predicted [N]": number(trial["hold_force"], ".1f"),
                "predicted [m]": number(trial["predicted_y"], ".3f", trial["predicted_failure"]),
                "90 % interval": " to ".join(ends) if NONE not in ends else NONE,
                "measured [m]": number(trial["landing_y"], ".3f", trial["failure"]),
                "error": number(trial["off"], "+.1%"),
            }
        )
    return without_empty(pd.DataFrame(rows))


def losses(run: Run) -> pd.DataFrame:
    """Terms of the loss at θ, the share that each weighs, the printed total, and the budget."""
    found = {term for result in run for term in result.theta.get("loss", {})} - {"total", *TERMS}
    terms, rows = TERMS | {term: term for term in sorted(found)}, []
    for result in run:
        method = run.params.methods[result.method]
        loss, weights = result.theta.get("loss", {}), dict(method.weights)
        another = method.search == POSTERIOR  # minimises no such sum
        total = math.nan if another else loss.get("total", math.nan)
        row = {"band": result.band, "method": called(run, result.method)}
        for term, heading in terms.items():
            weight, value = weights.get(term, 0.0), loss.get(term, math.nan)
            share = f" ({percent(weight * value / total)})" if weight else " (unused)"
            row[heading] = number(value, ".3g") + share * (math.isfinite(value) and not another)
        row["total of its own loss"] = number(total, ".4g")
        row["printed loss"] = number(result.printed_loss, ".4g")
        rows.append(row | {"rollouts": str(result.rollouts)})
    return pd.DataFrame(rows)


def policies(run: Run) -> pd.DataFrame:
    """How each policy converged in its own simulator."""
    rows = []
    for result in run:
        training = result.card["training"]
        errors = (training[name] for name in ("mean_error_m", "max_error_m"))
        rows.append(
            {
                "band": result.band,
                "method": called(run, result.method),
                "converged": "yes" if training["converged"] else "**no**",
                **{
                    head: number(None if error is None else 100 * error, ".2f")
                    for head, error in zip(("mean error [cm]", "largest [cm]"), errors, strict=True)
                },
                "failed targets": str(training.get("failed_targets", NONE)),
            }
        )
    return pd.DataFrame(rows)


def summary(run: Run) -> dict[str, float]:
    """reports/summary.json: the run in a dozen numbers, for `dvc metrics` and `dvc exp show`.

    `<band>_cm`, the mean landing error of the main method, or where none is known `<band>_kPa`, its
    Young's modulus; over bands: `floors`, the error in actuation floors, and `paper_cm`, the error
    of the paper's method; over launches of the main method: `failed`, `bias_%` of its predictions,
    `in_90_%` of its intervals, and their median `width_%` of the distance. Names are short, so that
    a terminal of 120 columns has room for three bands.
    """
    trials, modulus = run.launched, QUANTITIES["youngs_modulus"]
    aimed = trials.loc[trials.target.notna()]
    means = aimed.miss.abs().groupby([aimed.method, aimed.band]).mean().dropna()
    metrics: dict[str, float] = {}
    for band, of_band in run.results.items():
        if (run.main, band) in means.index:
            metrics[f"{band}_cm"] = 100 * means[run.main, band]
        else:
            value = of_band[run.main].theta["theta"]["youngs_modulus"]
            metrics[f"{band}_{modulus.unit}"] = modulus.factor * value
    main = means.get(run.main, pd.Series(dtype=float))
    metrics["floors"] = (main / pd.Series(run.least, dtype=float)).mean()
    if len(run.references) > 1:
        metrics["paper_cm"] = (
            100 * means.get(run.references[1], main.iloc[:0]).reindex(main.index).mean()
        )
    mine, found = trials.loc[trials.method == run.main], {}
    if len(mine):
        found = prediction_errors(mine)
        if mine.target.notna().any():
            metrics["failed"] = int((mine.target.notna() & mine.miss.isna()).sum())
        metrics["bias_%"] = 100 * found["bias"]
    if found.get("ranged"):
        metrics["in_90_%"] = 100 * found["covered"] / found["ranged"]
        metrics["width_%"] = 100 * found["width"]
    return {
        name: value if isinstance(value, int) else rounded(value)
        for name, value in metrics.items()
        if np.isfinite(value)
    }
