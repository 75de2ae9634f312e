"""What a card concludes of a band: the verdict with its reasons, its values, what would help."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sling2sim2real.card.findings import findings
from sling2sim2real.card.inputs import CardInputs
from sling2sim2real.card.next_steps import next_steps
from sling2sim2real.card.values import ShownValue, values
from sling2sim2real.card.verdict import Findings, judge, question, reasons_of
from sling2sim2real.identification.posterior.gain import LandingModel


@dataclass(frozen=True)
class Conclusion:
    """Of one band by one method; `reasons` and `steps` are sentences."""

    findings: Findings
    verdict: str
    reasons: list[str]
    values: list[ShownValue]
    steps: list[str]

    @classmethod
    def of(cls, inputs: CardInputs, force: np.ndarray) -> Conclusion:
        """Judge what was read and launched.

        Args:
            force: Of the first pull, simulated, at its samples [N], shape (T, 3).
        """
        known, aims, samples = findings(inputs, force), inputs.aims, inputs.found.sampled
        verdict, against = judge(known)
        model, spread = None, aims.spread
        if samples is not None and spread.chosen is not None:
            landings = spread.chosen, spread.centres, spread.slope, aims.half_width
            model = LandingModel.of(samples.names, samples.values, *landings)
        steps = next_steps(
            against,
            model,
            aims.target,
            inputs.episodes,
            inputs.launches,
            question(known),
            unloaded=known.unloaded,
        )
        fixed = inputs.params.methods[inputs.method].fixed
        reasons = reasons_of(known, against)
        return cls(known, verdict, reasons, values(inputs.theta, fixed), steps)
