"""Write reports/: README.md, its pictures, tables and metrics, and all in index.html."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pipeline.files import write_json, write_text
from pipeline.report.chapters.appendix import budget, policies
from pipeline.report.chapters.band import band_chapter, compared
from pipeline.report.chapters.identification import identification
from pipeline.report.chapters.pictures import pictures
from pipeline.report.chapters.summary import summary
from pipeline.report.figures import confidence, episode, launches, loaded, policy, search
from pipeline.report.looks import SIDE_BY_SIDE, drawn, looks
from pipeline.report.losses import has_another_loss
from pipeline.report.metrics import metrics
from pipeline.report.page import write_page
from pipeline.report.replay import Replay, replay
from pipeline.report.report import Report
from pipeline.report.results import Result, Results, gather
from pipeline.report.tables.paper_tables import write_tables


def write(params, root: str | Path = ".") -> None:
    """Write the report of everything in params.run. Raises UserError where an input is missing."""
    root = Path(root)
    results = gather(params, root)
    named = looks(dict.fromkeys(result.method for result in results))
    replays = {band: _replays(params, results, band) for band in params.run.bands}
    report = Report(params, results, replays, named, root)
    common_figures(report)
    parts = [
        summary(results, named),
        write_tables(params, results, named, results.floors, report.folder / "tables"),
        pictures(report),
    ]
    for band in params.run.bands:
        parts.append(band_chapter(report, band))
        draw_figures(report, band)
    parts += [identification(params, results, named), policies(params, results, named)]
    parts.append(budget(params))
    markdown = "\n".join(parts)
    for name, content in metrics(results).items():
        write_json(report.folder / "metrics" / f"{name}.json", content)
    write_text(report.folder / "README.md", markdown)
    write_page(report, markdown)


def _replays(params, results: Results, band: str) -> dict[str, Replay]:
    """Of the methods that are drawn; of all where held-out data are to be compared."""
    recorded, methods = results.episodes[band], results.methods[band]
    some = {*drawn(methods, SIDE_BY_SIDE), *drawn(params.run.methods, SIDE_BY_SIDE)}
    return {
        method: replay(params, band, method, recorded, methods[method].theta)
        for method in methods
        if method in some or params.loss.held_out.blocks
    }


def common_figures(report: Report) -> None:
    """Pictures that show all bands beside each other."""
    results, named, setup = report.results, report.looks, report.params.setup
    folder, methods = report.folder / "figures", drawn(report.params.run.methods, SIDE_BY_SIDE)
    launches.trajectories(folder / "trajectories.png", results, methods, named, setup.fork_height)
    launches.scatter(folder / "scatter.png", results, methods, named)
    shown = {band: {m: of_band[m] for m in methods} for band, of_band in report.replays.items()}
    loaded.loaded(
        folder / "loaded.png",
        results.episodes,
        shown,
        named,
        setup.fork_width,
        setup.fork_height,
    )


def draw_figures(report: Report, band: str) -> None:
    """Every picture of a band, as reports/figures/<band>-....png."""
    params, results, named = report.params, report.results, report.looks
    recorded, methods, about = results.episodes[band], results.methods[band], params.bands[band]
    near = drawn(methods)

    def path(name: str) -> Path:
        return report.folder / "figures" / f"{band}-{name}.png"

    shown = {method: report.replays[band][method] for method in near}
    frames = episode.moments(recorded)
    episode.force(path("force"), recorded, shown, named)
    episode.work(path("work"), recorded, shown, named)
    episode.clouds(path("clouds"), recorded, shown, named, frames, about.diameter)
    own = {m for m in methods if has_another_loss(dict(params.methods[m].weights))}
    search.convergence(path("convergence"), methods, named, own)
    policy.training(path("training"), methods, named)
    trusted = {method: methods[method] for method in near if methods[method].confidence}
    if trusted:
        confidence.profiles(path("profiles"), trusted, named, params.parameters)
        confidence.correlation(path("correlation"), trusted, named)
    if compared(results, band):
        trials = results.trials
        of_band = {method: named[method] for method in methods}
        policy.landings(path("landings"), trials[trials.band == band], of_band, near)
    targets = np.linspace(*params.policy.targets, 101)
    for method in near:
        result, name = methods[method], named[method].name
        search.corner(path(f"{method}-corner"), result, params.parameters, name)
        policy.landing_map(
            path(f"{method}-map"),
            result,
            _draws(report, result, targets),
            np.array(params.trials.targets),
            float(result.trials.recorded_stretch.max()),
            params.setup.fork_width,
            about.rest_length,
        )


def _draws(report: Report, result: Result, targets: np.ndarray) -> dict[str, np.ndarray]:
    """Draws (N, 2) for targets (N,) of a method's policy, and of its robust one where there is."""
    draws = {"the policy's": report.draws(result.band, result.method, targets)}
    if result.robust_card:
        draws["the robust policy's"] = report.draws(
            result.band, result.method, targets, robust=True
        )
    return draws
