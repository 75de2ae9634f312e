"""The policies, the paper's own numbers, budget and versions."""

from __future__ import annotations

import platform
from importlib.metadata import version

from pipeline.report import paper
from pipeline.report.looks import Look
from pipeline.report.results import Results
from pipeline.report.tables import policies as tables
from pipeline.report.tables.cells import markdown

PACKAGES = ("numpy", "scipy", "warp-lang", "cma", "torch", "rsl-rl-lib", "pyarrow", "dvc")


def policies(params, results: Results, looks: dict[str, Look]) -> str:
    low, high = params.policy.targets
    return f"""\
## Policies

PPO on the launches of each calibrated simulator, targets {low:g} – {high:g} m. Converged: the mean
error of the deterministic policy over 256 targets is at most 1 cm in its own simulator. Training
reads landings off a map of simulated launches; the map's own error, within the
range of targets, is in the last two columns.

{markdown(tables.policies(results, looks))}"""


def papers_numbers() -> str:
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


def budget(params) -> str:
    optimizer, policy, trials = params.optimizer, params.policy, params.trials
    versions = [f"python {platform.python_version()}", *(f"{n} {version(n)}" for n in PACKAGES)]
    explored = optimizer.population * (optimizer.generations + 1)
    return f"""\
## Budget and versions

- Search: {explored} rollouts of exploration ({optimizer.population} agents, moved
  {optimizer.generations} times), then {optimizer.cma_rollouts} of CMA-ES shared by the regions; a
  search of one phase spends both. Rollouts really spent are in the table of losses.
- Policy: {policy.map_size[0]} × {policy.map_size[1]} simulated launches, then {policy.iterations}
  iterations of PPO with {policy.envs} × {policy.steps} samples each.
- Trials: {len(trials.targets)} targets × {trials.repeats} launches, the draw off by
  {1e3 * trials.actuation_error:g} mm (standard deviation) on the virtual rig, with the same errors
  for every method.
- Seeds: search {optimizer.seed}, policy {policy.seed}, trials {trials.seed}.
- Versions: {", ".join(versions)}.
"""
