"""Write reports/README.md, its pictures and metrics.json."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pipeline.files import write_json, write_text
from pipeline.policy.aim import policy_draws
from pipeline.report.chapters.appendix import budget, papers_numbers, policies
from pipeline.report.chapters.band import band_chapter, compared
from pipeline.report.chapters.identification import identification
from pipeline.report.chapters.summary import summary
from pipeline.report.figures import confidence, episode, policy, search
from pipeline.report.looks import Look, drawn, looks
from pipeline.report.losses import has_another_loss
from pipeline.report.metrics import metrics
from pipeline.report.replay import Replay, replay
from pipeline.report.results import Results, gather


def write(params, root: str | Path = ".") -> None:
    """Write the report of everything in params.run. Raises UserError where an input is missing."""
    root = Path(root)
    results = gather(params, root)
    named = looks(dict.fromkeys(result.method for result in results))
    parts = [summary(results, named), identification(params, results, named)]
    for band in params.run.bands:
        replays = _replays(params, results, band)
        parts.append(band_chapter(params, results, band, replays, named, root))
        draw_figures(params, results, band, replays, named, root)
    parts += [policies(params, results, named), papers_numbers(), budget(params)]
    folder = root / "reports"
    write_json(folder / "metrics.json", metrics(results))
    write_text(folder / "README.md", "\n".join(parts))


def _replays(params, results: Results, band: str) -> dict[str, Replay]:
    """Of the methods that are drawn; of all where held-out data are to be compared."""
    recorded, methods = results.episodes[band], results.methods[band]
    return {
        method: replay(params, band, method, recorded, methods[method].theta)
        for method in (methods if params.loss.held_out.blocks else drawn(methods))
    }


def draw_figures(
    params,
    results: Results,
    band: str,
    replays: dict[str, Replay],
    named: dict[str, Look],
    root: Path,
) -> None:
    """Every picture of a band, as reports/figures/<band>-....png."""
    recorded, methods, about = results.episodes[band], results.methods[band], params.bands[band]
    near = drawn(methods)

    def path(name: str) -> Path:
        return root / "reports" / "figures" / f"{band}-{name}.png"

    shown = {method: replays[method] for method in near}
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
            policy_draws(root / "data" / "policies" / band / method, targets),
            np.array(params.trials.targets),
            float(result.trials.recorded_stretch.max()),
            params.setup.fork_width,
            about.rest_length,
        )
