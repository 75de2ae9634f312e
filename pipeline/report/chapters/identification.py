"""What was identified, by which method, and how far to trust it."""

from __future__ import annotations

from pipeline.report.looks import Look
from pipeline.report.results import Results
from pipeline.report.tables import identified
from pipeline.report.tables.cells import markdown

EDGE = "\n⚠ the search ended at a side of its box: the optimum may lie outside.\n"
NO_CONFIDENCE = "No θ of this run comes with a confidence.\n"
SETTLED = 1.0  # deviations that a posterior's mean may move in its last round
DOUBT = """\
In brackets: 90 % intervals of the posterior; *not identifiable* where it says hardly more than the
box; *fixed* where the method does not search; † where θ*, the least loss, lies outside: the loss is
no likelihood, and the two may disagree. [docs/identification.md](../docs/identification.md) says
what such an interval is and is not.
"""


def identification(params, results: Results, looks: dict[str, Look]) -> str:
    edges = any(
        identified.at_edge(value, getattr(params.parameters, name))
        for result in results
        for name, value in result.theta["theta"].items()
        if name not in params.methods[result.method].fixed
    )
    trusted = any(result.confidence for result in results)
    return f"""\
## Methods

All spend the same number of rollouts. Names are the paper's where the method is; −c leaves out the
covariance, −m the several starts, −L_work the term of work.

{markdown(identified.methods(params, looks))}
## What was identified

θ = Young's modulus E, Poisson's ratio ν, elasticity damping d (viscous stress = d × rate of the
elastic stress), friction of the finger pads, and damping scale s (share of d that acts on shape).
E and ν are nearly interchangeable in the force, and mostly the product of s and d can be seen, so
single values are less certain than the behaviour that they give together.

{markdown(identified.parameters(results, params, looks))}{EDGE if edges else ""}
{_trust(results, looks) if trusted else NO_CONFIDENCE}
### Loss

Terms of the loss at θ: mean distance of the point clouds (geom), mean force error (force), error of
the mechanical work (work), and the distance of the clouds in the few taut frames of the recoil
(taut). Per cent: what a term weighs in the total of its method. Totals of methods with different
weights are not comparable; the *printed loss*, geom + force + work as in the paper, is one measure
for all, though not all minimise it.

{markdown(identified.losses(results, params, looks))}"""


def _trust(results: Results, looks: dict[str, Look]) -> str:
    text = [
        DOUBT,
        "What the data can see, as the posterior's median and 90 % interval:\n",
        markdown(identified.derived(results, looks)),
    ]
    text += [
        f"⚠ The posterior of {one.band}, {looks[one.method].name} had **not settled**: its mean"
        f" moved by {one.confidence['moved']:.1f} of its own deviations in the last round. Its"
        " intervals are not to be relied on.\n"
        for one in results
        if one.confidence.get("moved", 0.0) > SETTLED
    ]
    by_phase = identified.phases(results, looks)
    if by_phase:
        words = "Root mean square of what the posterior's best leaves, by part of the recording:\n"
        text += [words, markdown(by_phase)]
    return "\n".join(text)
