"""The methods, what the data can see, and what the losses are made of."""

from __future__ import annotations

from pipeline.report.report import Report
from pipeline.report.results import Results
from pipeline.report.styles import Styles
from pipeline.report.tables import identified
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

Terms of the loss at θ: mean distance of the point clouds (geom), mean force error (force), error of
the mechanical work (work), and the distance of the clouds in the few taut frames of the recoil
(taut). Per cent: what a term weighs in the total of its method, to which a nuisance may add its
cost. Totals of methods with different weights are not comparable; the *printed loss*, geom + force
+ work as in the paper, is one measure for all, though not all minimise it.

{markdown(identified.losses(results, params, styles))}"""


def _trust(results: Results, styles: Styles) -> str:
    """What the posteriors say beside table 2; nothing where there are none."""
    derived = identified.derived(results, styles)
    if derived is None:
        return ""
    words = "### What the data can see\n\nThe posterior's median and 90 % interval:\n"
    text = [words, markdown(derived)]
    by_phase = identified.phases(results, styles)
    if by_phase:
        words = "Root mean square of what the posterior's best leaves, by part of the recording:\n"
        text += [words, markdown(by_phase)]
    return "\n".join(text)
