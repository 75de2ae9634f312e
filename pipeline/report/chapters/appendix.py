"""The methods, what the data can see, what the losses are made of, the policies and the budget."""

from __future__ import annotations

from pipeline.drawing.styles import Styles
from pipeline.report.report import Report
from pipeline.report.results import Results
from pipeline.report.tables import identified
from pipeline.report.tables import policies as tables
from pipeline.report.tables.cells import markdown


def identification(report: Report) -> str:
    params, results, styles = report.params, report.results, report.styles
    return f"""\
## Methods and losses

All methods spend the same number of rollouts. Names are the paper's where the method is; −c leaves
out the covariance, −m the several starts, −L_work the term of work.

{markdown(identified.methods(results, params, styles))}
{_trust(results, styles)}
### Loss

Terms of the loss at θ: mean distance of the point clouds (geom), mean force error (force), and
error of the mechanical work (work). Per cent: what a term weighs in the total of its method. Totals
of methods with different weights are not comparable; the *printed loss*, geom + force + work as in
the paper, is one measure for all, though not all minimise it.

{markdown(identified.losses(results, params, styles))}"""


def _trust(results: Results, styles: Styles) -> str:
    """What the posteriors say beside table 2; nothing where there are none."""
    derived = identified.derived(results, styles)
    if derived is None:
        return ""
    words = "### What the data can see\n\nThe density's mode and 90 % interval:\n"
    text = [words, markdown(derived)]
    left = identified.recordings(results, styles)
    words = (
        "Root mean square of what each recording shows and the simulation does not; and, of"
        " several, how much worse the mode of the others alone meets it, and which coordinate it"
        " moves by how many standard deviations:\n"
    )
    text += [words, markdown(left)]
    known = identified.observed(results, styles)
    words = "Launches that were evidence (`sling observe`); none of them is scored anywhere:\n"
    text += [words, markdown(known)] if known else []
    return "\n".join(text)


def policies(report: Report) -> str:
    low, high = report.params.policy.targets
    return f"""\
## Policies

PPO on the launches of each calibrated simulator, targets {low:g} – {high:g} m. Converged: the mean
error of the deterministic policy over 256 targets, launched in its own simulator, is at most 1 cm.
Training reads landings off maps of simulated launches; their own error, within the range of
targets, comes next.

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
