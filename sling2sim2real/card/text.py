"""A card's words."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sling2sim2real.base.template import filled
from sling2sim2real.card.conclusion import Conclusion
from sling2sim2real.card.inputs import CardInputs, sides
from sling2sim2real.card.verdict import CARE, NO, TRUSTED, launches_of
from sling2sim2real.drawing.names import as_code

GLOSSARY = "../../../../docs/glossary.md"  # from the card of a run's band; a page stands alone
SAID = {TRUSTED: "can be trusted", CARE: "use with care", NO: "do not use it"}


def card_text(inputs: CardInputs, concluded: Conclusion, *, linked: bool = True) -> str:
    """README.md of a card; without links to other files where it is to stand alone."""
    aims, launches = inputs.aims, inputs.launches
    expected = aims.landing, aims.failure, aims.interval, aims.median
    draws = aims.target, aims.draw, *expected, aims.hold_force
    tried = sorted(inputs.launched.kind.value_counts().items())
    return filled(
        Path(__file__).with_name("card.md.j2"),
        band=inputs.band,
        method=inputs.method,
        title=SAID[concluded.verdict],
        reasons=concluded.reasons,
        rig=inputs.virtual,
        linked=linked and inputs.virtual,
        sizes=inputs.found.band,
        assumed=inputs.assumed,
        glossary=GLOSSARY,
        shown=concluded.values,
        draws=zip(*draws, strict=True),
        finite=np.isfinite,
        sides=sides,
        history=inputs.theta.get("history"),
        findings=concluded.findings,
        met=inputs.confidence.get("recordings"),
        peak=inputs.episode.metadata["preprocessing"]["peak_force"],
        steps=concluded.steps,
        pulls=len(inputs.episodes),
        files=", ".join(map(as_code, inputs.recordings)),
        observed=launches_of(launches) if launches else "no launch",
        tried=", ".join(f"{n} {kind}" for kind, n in tried) or "none",
    )
