"""The policies and the budget."""

from __future__ import annotations

from pipeline.report.report import Report
from pipeline.report.tables import policies as tables
from pipeline.report.tables.cells import markdown


def policies(report: Report) -> str:
    low, high = report.params.policy.targets
    return f"""\
## Policies

PPO on the launches of each calibrated simulator, targets {low:g} – {high:g} m. Converged: the mean
error of the deterministic policy over 256 targets, launched in its own simulator, is at most 1 cm;
of a robust policy, that it is not expected to miss by more than the plain one (`card.json` has the
criterion in full). Training reads landings off maps of simulated launches; their own error, within
the range of targets, comes next. *Expected*: the mean error over samples of the posterior and
errors of the draw, of a robust policy and of the plain one beside it.

{markdown(tables.policies(report.results, report.styles))}"""


def budget(report: Report) -> str:
    params = report.params
    optimizer, policy, trials = params.optimizer, params.policy, params.trials
    explored = optimizer.population * (optimizer.generations + 1)
    return f"""\
## Budget

- Search: {explored} rollouts of exploration ({optimizer.population} agents, moved
  {optimizer.generations} times), then {optimizer.cma_rollouts} of CMA-ES shared by the regions; a
  search of one phase spends both. Rollouts really spent are in the table of losses.
- Policy: {policy.map_size[0]} × {policy.map_size[1]} simulated launches, then {policy.iterations}
  iterations of PPO with {policy.envs} × {policy.steps} samples each.
- Trials: {len(trials.targets)} targets × {trials.repeats} launches, the draw off by
  {1e3 * trials.actuation_error:g} mm (standard deviation) on the virtual rig, with the same errors
  for every method.
- Seeds: search {optimizer.seed}, policy {policy.seed}, trials {trials.seed}.
"""
