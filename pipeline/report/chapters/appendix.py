"""The rest: what the differences are worth, predictions, searches, confidence, policies, budget."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pipeline.report.chapters.paper_tables import write_csv
from pipeline.report.figures import confidence, landings, policy, search
from pipeline.report.figures.pull import pull
from pipeline.report.noise import LEVEL, RESAMPLES
from pipeline.report.report import Report
from pipeline.report.results import has_another_loss
from pipeline.report.tables import differences, identified
from pipeline.report.tables.cells import markdown, percent
from pipeline.report.tables.landings import LAUNCHED, of_kind, prediction_summary, predictions
from pipeline.report.tables.policies import policies
from sling2sim2real.base.template import filled


def appendix(report: Report) -> str:
    """The second page; writes differences.csv where methods are compared."""
    params, results, styles = report.params, report.results, report.styles
    predicted, derived = prediction_summary(results, styles), identified.derived(results, styles)
    alt = "force against draw, residual force, distance of the clouds"
    return filled(
        Path(__file__).with_name("appendix.md.j2"),
        main=styles[report.main].name,
        level=percent(LEVEL),
        resamples=f"{RESAMPLES:,}",
        differences=_differences(report),
        predicted=markdown(predicted, repeats=False),
        predictions=predicted and _predictions(report),
        measured={
            band: markdown(predictions(launches))
            for band, methods in results.methods.items()
            if not (launches := of_kind(methods[report.main].trials, "measured")).empty
        },
        pull=report.picture("pull", alt, pull, results.episodes, report.replays, styles),
        methods=markdown(identified.methods(results, params, styles)),
        losses=markdown(identified.losses(results, params, styles), repeats=False),
        convergence=_convergence(report),
        corner=_corner(report),
        derived=markdown(derived),
        recordings=markdown(identified.recordings(results, styles)),
        observed=markdown(identified.observed(results, styles)),
        correlation=derived and _correlation(report),
        policies=markdown(policies(results, styles), repeats=False),
        training=_training(report),
        maps=_maps(report),
        explored=params.optimizer.population * (params.optimizer.generations + 1),
        optimizer=params.optimizer,
        policy=params.policy,
        trials=params.trials,
        rig=params.run.rig,
    )


def _differences(report: Report) -> str:
    rows = differences.compared(report.results, report.references, report.params.trials.seed)
    if not rows:
        return ""
    write_csv(report.folder / "tables" / "differences.csv", differences.records(rows))
    return markdown(differences.as_table(rows, report.styles), repeats=False)


def _predictions(report: Report) -> str | None:
    """Predicted beside actual landings, where any landed."""
    results = report.results
    if results.trials.landing_y.isna().all():
        return None
    trusted = {(result.band, result.method) for result in results if result.confidence}
    drawing = of_kind(results.trials, *LAUNCHED), trusted, report.shown(report.results.shared)
    alt = "predicted beside actual landings"
    return report.picture("predictions", alt, landings.predictions, *drawing)


def _convergence(report: Report) -> str | None:
    """Picture of the searches on one loss, and of the main one; None where no band has several."""
    searches = {
        band: {
            method: result
            for method, result in methods.items()
            if method == report.main
            or not has_another_loss(dict(report.params.methods[method].weights))
        }
        for band, methods in report.results.methods.items()
    }
    if all(len(of_band) < 2 for of_band in searches.values()):
        return None
    alt = "loss of the best so far against rollouts"
    return report.picture("convergence", alt, search.convergence, searches, report.styles)


def _corner(report: Report) -> dict[str, str] | None:
    """Picture of all θ of the first search that refines regions; None where none did."""
    result = next((searched for searched in report.results if searched.regions), None)
    if result is None:
        return None
    name = report.styles[result.method].name
    alt = f"every θ that {name} evaluated for {result.band}"
    drawing = search.corner, result, report.params.parameters, name
    picture = report.picture("corner", alt, *drawing)
    return {"method": name, "band": result.band, "picture": picture}


def _correlation(report: Report) -> str | None:
    trusted = {
        band: methods[report.main].confidence
        for band, methods in report.results.methods.items()
        if methods[report.main].confidence.get("correlation")
    }
    if not trusted:
        return None
    alt = "correlations of the density's coordinates"
    return report.picture("correlation", alt, confidence.correlation, trusted)


def _training(report: Report) -> str:
    curves = {
        band: {method: of_band[method].training for method in report.results.shared}
        for band, of_band in report.results.methods.items()
    }
    alt = "training error by iteration"
    return report.picture("training", alt, policy.training, curves, report.styles)


def _maps(report: Report) -> str:
    params = report.params
    path = np.linspace(*params.policy.targets, 101)  # from near to far
    main = {band: of_band[report.main] for band, of_band in report.results.methods.items()}
    return report.picture(
        "maps",
        "landing against draw",
        policy.landing_maps,
        {band: result.landing_map for band, result in main.items()},
        {band: report.draws(result, path) for band, result in main.items()},
        np.array(params.trials.targets),
        {band: float(result.trials.recorded_stretch.max()) for band, result in main.items()},
        params.setup.fork_width,
        {band: params.bands[band].rest_length for band in main},
    )
