"""Write reports/README.md, its pictures and metrics.json."""

from __future__ import annotations

import platform
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pandas as pd

from pipeline.files import write_json, write_text
from pipeline.policy.aim import policy_draws
from pipeline.report import figures, paper, tables
from pipeline.report.replay import replay
from pipeline.report.results import Results, gather
from pipeline.report.tables import markdown
from pipeline.theta import vector

PACKAGES = ("numpy", "scipy", "warp-lang", "cma", "torch", "rsl-rl-lib", "pyarrow", "dvc")
SOURCE = {
    "rig": "recorded by the **virtual rig**, whose rubber follows another law than the simulator",
    "recording": "a recording that was brought in",
}
INTRODUCTION = """\
# What came out

One recording of a robot that pulls and releases an elastic band goes in. A simulator of the band is
fitted to it (five parameters θ), a slingshot policy is trained in that simulator alone, and its
launches are compared with launches that the simulator has never seen. This file is written by the
last stage of `dvc repro`; equal inputs give an equal file.

Frame: origin midway between the fork tips, y towards the target, z up. A *draw* is the drawn
position (y, z) of the projectile, y < 0; a *target* g is a distance along y on the floor.
"""


def write(params, root: str | Path = ".") -> None:
    """Write the report of everything in params.run. Raises UserError where an input is missing."""
    root = Path(root)
    results = gather(params, root)
    folder = root / "reports"
    for band in params.run.bands:
        _draw_figures(params, results, band, root)
    parts = [INTRODUCTION, _summary(params, results), _identified(params, results)]
    parts += [_band(params, results, band, root) for band in params.run.bands]
    parts += [_policies(params, results), _paper(), _budget(params, results)]
    write_json(folder / "metrics.json", tables.metrics(results))
    write_text(folder / "README.md", "\n".join(parts))


def _summary(params, results: Results) -> str:
    lines = ["## In short\n"]
    for band, methods in results.methods.items():
        for method, result in methods.items():
            best = result.theta.get("loss", {}).get("total")
            said = [f"loss {best:.4g} after {len(result.history)} rollouts"] if best else []
            said += _landed(result.trials, "virtual") + _landed(result.trials, "measured")
            unpredicted = int(result.trials.predicted_y.isna().sum())
            if unpredicted:
                said.append(
                    f"{unpredicted} of {len(result.trials)} launches could not be predicted"
                )
            if result.trials.landing_y.isna().all():
                said.append("no launch to compare its predictions with")
            lines.append(f"- **{band}, {method}**: {'; '.join(said)}.")
    unsure = [r for r in tables.each(results) if not r.card["training"]["converged"]]
    lines += [
        f"- The policy of {r.band}, {r.method} did **not** converge in its own simulator."
        for r in unsure
    ]
    return "\n".join(lines) + "\n"


def _landed(trials: pd.DataFrame, kind: str) -> list[str]:
    """What the launches of a kind say, in words."""
    trials, said = trials[trials.kind == kind], []
    if trials.target.notna().any():
        total = tables.landing_errors(trials)["all"]
        failed = f"{total['failed']} of {total['launches']} {kind} launches failed"
        if total["failed"] < total["launches"]:
            said.append(f"{kind} launches land {100 * total['mean']:.1f} cm off their target")
        if total["failed"]:
            said.append(failed)
    if kind == "measured" and not trials.empty:
        error = tables.prediction_error(trials)
        parts = [
            f"{100 * error[part]['mean']:.1f} % {where} ({error[part]['launches']} launches)"
            for part, where in (("inside", "inside the recorded stretch"), ("beyond", "beyond it"))
            if error[part]["launches"]
        ]
        if parts:
            bias = 100 * error["all"]["bias"]
            said.append(
                f"measured landings are predicted within {' and '.join(parts)} on average,"
                f" with a bias of {bias:+.1f} %"
            )
        said.append(_aim(error["inside"]))
    return said


def _aim(inside: dict) -> str:
    """Whether the measured landings inside the recorded stretch are predicted well enough."""
    aim = f"the aim, at most {100 * tables.AIM:g} % of the distance inside the recorded stretch,"
    if not inside["tried"]:
        return f"{aim} cannot be judged: no launch lies there"
    if inside["unpredicted"]:
        return f"{aim} is **not** met: {inside['unpredicted']} launches there are not predicted"
    if not inside["launches"]:
        return f"{aim} cannot be judged: no launch landed there"
    return f"{aim} is {'met' if inside['mean'] <= tables.AIM else '**not** met'}"


def _identified(params, results: Results) -> str:
    edges = any(
        tables.at_edge(value, getattr(params.parameters, name))
        for result in tables.each(results)
        for name, value in result.theta["theta"].items()
    )
    note = (
        "\n⚠ the search ended at a side of its box: the optimum may lie outside.\n" if edges else ""
    )
    return f"""\
## What was identified

θ = Young's modulus E, Poisson's ratio ν, elasticity damping d (viscous stress = d × rate of the
elastic stress), friction of the finger pads, and damping scale s (share of d that acts on shape).
E and ν are nearly interchangeable in the force, and mostly the product of s and d can be seen, so
single values are less certain than the behaviour that they give together.

{markdown(tables.parameters(results, params))}{note}
Terms of the loss at θ: mean distance of the point clouds (geom), mean force error (force), error of
the mechanical work (work), and the distance of the clouds in the few taut frames of the recoil
(taut). Per cent: what a term weighs in the total of its method; totals of different methods are not
comparable where their weights differ.

{markdown(tables.losses(results, params))}"""


def _band(params, results: Results, band: str, root: Path) -> str:
    about = params.bands[band]
    text = [
        f"## {band}\n",
        f"{about.mass * 1e3:g} g, {about.rest_length * 100:g} cm between the clamps,"
        f" {about.diameter * 1e3:g} mm thick; {SOURCE[about.source]}.\n",
    ]
    virtual = tables.landings(results, band, "virtual")
    measured = tables.landings(results, band, "measured")
    for table, title, words in (
        (virtual, "Landing errors, virtual", "Launches on the **virtual rig**, not on a robot."),
        (measured, "Landing errors, measured", "Launches that were measured by the user."),
    ):
        if table:
            text.append(
                f"### {title}\n\n{words} Mean ± deviation of |landing − target| in cm, and the"
                f" bias, the mean of landing − target. A launch that fails or lands outside"
                f" y = {tables.TARGET_AREA[0]} – {tables.TARGET_AREA[1]} m is counted as failed and"
                f" left out of the mean.\n\n{markdown(table)}"
            )
    text += _point_by_point(results, band)
    if _compared(results, band):
        text.append(f"![predicted and actual landings](figures/{band}-landings.png)\n")
    text.append(
        "### Recording and calibrated simulation\n\n"
        "Force of the band on the hand; both pass the same filter.\n\n"
        f"![force over time](figures/{band}-force.png)\n\n"
        "Points that the camera saw (one side of the band) and the simulated band (line: its"
        " middle, shade: its thickness).\n\n"
        f"![point clouds](figures/{band}-clouds.png)\n\n"
        "Search: the best loss so far.\n\n"
        f"![convergence](figures/{band}-convergence.png)\n\n"
        "### Policy\n\n"
        f"![training](figures/{band}-training.png)\n"
    )
    targets = np.array(params.trials.targets)
    for method, result in results.methods[band].items():
        draws = policy_draws(root / "data" / "policies" / band / method, targets)
        text.append(f"{method}: its draws for the targets of the trials, in its own simulator:\n")
        text.append(markdown(tables.aims(result, targets, draws)))
        text.append("Where each draw of the box lands there, and the policy's path over it:\n")
        text.append(f"![landing map](figures/{band}-{method}-map.png)\n")
    return "\n".join(text)


def _point_by_point(results: Results, band: str) -> list[str]:
    text = []
    summary = tables.prediction_summary(results, band)
    if summary:
        text.append(
            "### Predicted and measured landings\n\nThe measured landings took no part in the"
            " identification. Error in per cent of the measured distance; bias is its signed mean,"
            " predicted less measured; *not predicted* are launches whose simulation fails, which"
            " the means leave out; *beyond* marks draws that"
            " stretch the band further than the recording did.\n\n" + markdown(summary)
        )
    for method, result in results.methods[band].items():
        for kind, title in (("measured", "launch by launch"), ("predicted", "predictions")):
            trials = result.trials[result.trials.kind == kind]
            if not trials.empty:
                text.append(f"{method}, {title}:\n\n{markdown(tables.predictions(trials))}")
                if kind == "predicted":
                    text.append(
                        "No landing of this band has been measured. Launch from these draws and put"
                        f" the landings into `data/trials/measured/{band}.csv` to compare.\n"
                    )
    return text


def _policies(params, results: Results) -> str:
    low, high = params.policy.targets
    return f"""\
## Policies

PPO on the launches of each calibrated simulator, targets {low:g} – {high:g} m. Converged: the mean
error of the deterministic policy over 256 targets is at most 1 cm in its own simulator. Training
reads landings off a map of simulated launches; the map's own error, within the
range of targets, is in the last two columns.

{markdown(tables.policies(results))}"""


def _paper() -> str:
    heads = ["band", "method", *(f"g = {target:g} m" for target in paper.TARGETS), "all targets"]
    rows = [
        [band, method, *(f"{c[0]:.2f} ± {c[1]:.2f}" if c else "N/A" for c in cells)]
        for (band, method), cells in paper.LANDING.items()
    ]
    return f"""\
## The paper's own numbers

Landing errors [cm] that the authors of Sling2Sim2Real measured on their robot, with their bands.
They are not results of this run: other rubber, another rig, real launches. Their row "without
covariance and multi-start" averages 7.17 by its own cells, a tie with the full method, though 7.83
is printed.

{markdown((heads, rows))}"""


def _budget(params, results: Results) -> str:
    optimizer, policy, trials = params.optimizer, params.policy, params.trials
    versions = [f"python {platform.python_version()}", *(f"{n} {version(n)}" for n in PACKAGES)]
    return f"""\
## Budget and versions

- Search: {optimizer.population} agents over {optimizer.generations} generations of differential
  evolution, then {optimizer.cma_rollouts} rollouts of CMA-ES shared by up to {optimizer.k_top}
  regions. Rollouts really spent are in the table of losses.
- Policy: {policy.map_size[0]} × {policy.map_size[1]} simulated launches, then {policy.iterations}
  iterations of PPO with {policy.envs} × {policy.steps} samples each.
- Trials: {len(trials.targets)} targets × {trials.repeats} launches, the draw off by
  {1e3 * trials.actuation_error:g} mm (standard deviation) on the virtual rig, with the same errors
  for every method.
- Seeds: search {optimizer.seed}, policy {policy.seed}, trials {trials.seed}.
- Versions: {", ".join(versions)}.
"""


def _draw_figures(params, results: Results, band: str, root: Path) -> None:
    folder = root / "reports" / "figures"
    episode, methods, about = results.episodes[band], results.methods[band], params.bands[band]
    replays = {
        method: replay(params, band, episode, vector(result.theta))
        for method, result in methods.items()
    }
    figures.force(folder / f"{band}-force.png", episode, replays)
    figures.clouds(folder / f"{band}-clouds.png", episode, replays, about.diameter)
    figures.convergence(folder / f"{band}-convergence.png", methods)
    figures.training(folder / f"{band}-training.png", methods)
    if _compared(results, band):
        trials = results.trials
        figures.landings(
            folder / f"{band}-landings.png", trials[trials.band == band], list(methods)
        )
    targets = np.linspace(*params.policy.targets, 101)
    for method, result in methods.items():
        draws = policy_draws(root / "data" / "policies" / band / method, targets)
        figures.landing_map(
            folder / f"{band}-{method}-map.png",
            result,
            draws,
            np.array(params.trials.targets),
            float(result.trials.recorded_stretch.max()),
            params.setup.fork_width,
            about.rest_length,
        )


def _compared(results: Results, band: str) -> bool:
    trials = results.trials
    return bool((trials.landing_y.notna() & (trials.band == band)).any())
