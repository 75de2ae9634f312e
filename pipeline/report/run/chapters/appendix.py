"""The rest: what the differences are worth, predictions, searches, confidence, policies, budget."""

from __future__ import annotations

import numpy as np

from pipeline.report.run.chapters.paper_tables import write_csv
from pipeline.report.run.figures import confidence, landings, policy, search
from pipeline.report.run.figures.pull import pull
from pipeline.report.run.noise import LEVEL, RESAMPLES
from pipeline.report.run.report import Report
from pipeline.report.run.results import has_another_loss
from pipeline.report.run.tables import differences, identified
from pipeline.report.run.tables.cells import markdown, percent
from pipeline.report.run.tables.landings import (
    LAUNCHED,
    of_kind,
    prediction_summary,
    predictions,
)
from pipeline.report.run.tables.policies import policies

INTRODUCTION = """\
# Appendix

What stands behind the [report](README.md).
"""
NOISE = f"""\
## Which differences are more than noise

By how much a method misses more (+) or less (−) than another: difference of the mean |landing −
target| in cm, averaged over the targets that both reach, with its {percent(LEVEL)} interval by a
bootstrap over launches ({RESAMPLES:,} resamples within each target). Virtual launches of equal
number share their errors and are compared in pairs; measured ones are not. Bold: the interval
leaves out zero. Failed launches are left out, with their pairs. Of twenty true ties, one is
expected to look like a difference.

The intervals hold for **launches of these policies**, not for the methods at large: what another
recording or seed would give is not in them.
"""
PREDICTED = """\
## Predicted and actual landings

No launch of these was fitted; defaults of ours were chosen with landings in sight
([choices](../docs/paper.md#choices-and-what-they-were-made-on)). Error in per cent of the landing
distance, of every launch that came down; bias is its signed mean, predicted less landed; *beyond*:
draws that stretch the band further than the recording did.
"""
ALONE = """\
† The interval holds the draw's error alone: the method says nothing of how well it knows θ.
"""
LOSS = """\
Terms of the loss at θ: mean distance of the point clouds (geom), mean force error (force), and
error of the mechanical work (work). Per cent: what a term weighs in the method's own total; such
totals compare only between equal weights. The *printed loss*, geom + force + work as in the paper,
is one measure for all.
"""
TRAINED = {  # by policy.landings: what training reads, and what a sample of it is
    "map": (
        "Training reads landings off maps of simulated launches; the maps' own error comes next.",
        "samples",
    ),
    "simulated": (
        "Training simulates every launch. Maps are for this report alone; their error comes next.",
        "simulated launches",
    ),
}


def appendix(report: Report) -> str:
    """The second page, a chapter each part."""
    parts = (_noise, _predicted, _recording, _methods, _confidence, _policies, _budget)
    text = [INTRODUCTION, *(line for part in parts for line in part(report))]
    return "\n".join(text)


def _noise(report: Report) -> list[str]:
    seed = report.params.trials.seed
    rows = differences.compared(report.results, report.references, seed)
    if not rows:
        return []
    write_csv(report.folder / "tables" / "differences.csv", differences.records(rows))
    return [NOISE, markdown(differences.as_table(rows, report.styles), repeats=False)]


def _predicted(report: Report) -> list[str]:
    """Predictions beside launches; measured launches of the main method one by one."""
    results, styles = report.results, report.styles
    table = prediction_summary(results, styles)
    if table is None:
        return []
    text = [PREDICTED, markdown(table, repeats=False)]
    text += [ALONE] if any("†" in cell for row in table[1] for cell in row) else []
    trials = results.trials
    if trials.landing_y.notna().any():
        trusted = {(one.band, one.method) for one in results if one.confidence}
        shown = report.shown(report.params.run.methods)
        alt = "predicted beside actual landings"
        drawing = landings.predictions, of_kind(trials, *LAUNCHED), trusted, shown
        text.append(report.picture("predictions", alt, *drawing))
    for band, methods in results.methods.items():
        launches = of_kind(methods[report.main].trials, "measured")
        if not launches.empty:
            words = f"{band}, {styles[report.main].name}, measured launches:\n"
            text += [words, markdown(predictions(launches))]
    return text


def _recording(report: Report) -> list[str]:
    episodes, styles = report.results.episodes, report.styles
    alt = "force against draw, residual force, distance of the clouds"
    text = [
        "## Recording and simulation\n",
        "Force of the band on the hand against the hand's draw; size of measured less simulated"
        " force, both through the same filter; mean distance of each frame's point cloud from the"
        " simulated band.\n",
        report.picture("pull", alt, pull, episodes, report.replays, styles),
    ]
    if report.params.loss.held_out.blocks:
        text += [
            "Blocks of the pull that no search has seen, and the rest of the pull: mean force"
            " error, and mean distance of the clouds. Blocks may be harder or easier than the"
            " rest: compare methods, rather than a method's two columns.\n",
            markdown(identified.held_out(report.replays, styles), repeats=False),
        ]
    return text


def _methods(report: Report) -> list[str]:
    params, results, styles = report.params, report.results, report.styles
    text = [
        "## Searches and losses\n",
        markdown(identified.methods(results, params, styles)),
        LOSS,
        markdown(identified.losses(results, params, styles), repeats=False),
    ]
    searches = {}
    for band, methods in results.methods.items():
        comparable = {
            method: one
            for method, one in methods.items()
            if method == report.main or not has_another_loss(dict(params.methods[method].weights))
        }
        searches[band] = comparable
    if any(len(of_band) > 1 for of_band in searches.values()):
        name, alt = styles[report.main].name, "loss of the best so far against rollouts"
        picture = report.picture("convergence", alt, search.convergence, searches, styles)
        words = f"The printed loss of methods that minimise it, and of {name}"
        text += [f"{words}. Dots: where each ends.\n", picture]
    one = next((one for one in results if one.regions), None)
    if one:
        name = styles[one.method].name
        drawing = search.corner, one, params.parameters, name
        text += [
            f"Every θ that {name} evaluated for {one.band}, in the unit cube of the search, with"
            " the regions that CMA-ES refined; on the diagonal the loss against one"
            " parameter.\n",
            report.picture("corner", f"every θ that {name} evaluated for {one.band}", *drawing),
        ]
    return text


def _confidence(report: Report) -> list[str]:
    """What the densities say beside table 2; nothing where there are none."""
    results, styles = report.results, report.styles
    derived = identified.derived(results, styles)
    if derived is None:
        return []
    text = ["## What the data can see\n", "Most likely value and 90 % interval:\n"]
    text += [markdown(derived)]
    text += [
        "What each recording shows and the simulation does not (root mean square); of several"
        " recordings, also how much worse the fit to the others alone meets it, and what moves"
        " most, in standard deviations:\n",
        markdown(identified.recordings(results, styles)),
    ]
    known = identified.observed(results, styles)
    if known:
        words = "Launches that were evidence (`sling observe`); none of them is scored anywhere:\n"
        text += [words, markdown(known)]
    trusted = {
        band: methods[report.main].confidence
        for band, methods in results.methods.items()
        if methods[report.main].confidence.get("correlation")
    }
    if trusted:
        alt = "correlations of the density's coordinates"
        text.append(report.picture("correlation", alt, confidence.correlation, trusted))
    return text


def _policies(report: Report) -> list[str]:
    params, results, styles = report.params, report.results, report.styles
    low, high = params.policy.targets
    methods = report.results.methods
    path = np.linspace(low, high, 101)  # from near to far
    main = {band: of_band[report.main] for band, of_band in methods.items()}
    drawing = (
        policy.landing_maps,
        {band: one.landing_map for band, one in main.items()},
        {band: report.draws(one, path) for band, one in main.items()},
        np.array(params.trials.targets),
        {band: float(one.trials.recorded_stretch.max()) for band, one in main.items()},
        params.setup.fork_width,
        {band: params.bands[band].rest_length for band in main},
    )
    curves = {
        band: {method: of_band[method].training for method in params.run.methods}
        for band, of_band in methods.items()
    }
    return [
        "## Policies\n",
        f"PPO on the launches of each calibrated simulator, targets {low:g} – {high:g} m."
        " Converged: the policy misses by at most 1 cm on average over 256 targets, launched in its"
        f" own simulator. {TRAINED[params.policy.landings][0]}\n",
        markdown(policies(results, styles), repeats=False),
        report.picture("training", "training error by iteration", policy.training, curves, styles),
        f"Where draws land in the simulator that {styles[report.main].name} calibrated:\n",
        report.picture("maps", "landing against draw", *drawing),
    ]


def _budget(report: Report) -> list[str]:
    params = report.params
    optimizer, policy_, trials = params.optimizer, params.policy, params.trials
    _, samples = TRAINED[policy_.landings]
    explored = optimizer.population * (optimizer.generations + 1)
    virtual = ""
    if params.run.rig:
        virtual = f" × {trials.repeats} on the virtual rig, with the same errors for every method"
        virtual += f" (of the draw {1e3 * trials.actuation_error:g} mm, standard deviation)"
    return [
        f"""\
## Budget

- Search: {explored} rollouts of exploration ({optimizer.population} agents, moved
  {optimizer.generations} times), then {optimizer.cma_rollouts} of CMA-ES shared by the regions; a
  search of one phase spends both. Rollouts really spent are in the table of losses.
- Policy: {policy_.map_size[0]} × {policy_.map_size[1]} simulated launches, then
  {policy_.iterations} iterations of PPO with {policy_.envs} × {policy_.steps} {samples} each.
- Launches: {len(trials.targets)} targets{virtual}.
- Seeds: search {optimizer.seed}, policy {policy_.seed}, trials {trials.seed}.
"""
    ]
