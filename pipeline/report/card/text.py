"""A card's words."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pipeline.base.template import filled
from pipeline.report.card.findings import Findings
from pipeline.report.card.inputs import CardInputs
from pipeline.report.card.values import ShownValue
from pipeline.report.card.verdict import CARE, NO, TRUSTED, Reason, inside, launches_of
from pipeline.report.drawing.names import as_code

# From the card's folder; its page stands alone.
GLOSSARY = "../../../docs/glossary.md"
SAID = {TRUSTED: "can be trusted", CARE: "use with care", NO: "do not use it"}


def reasons_of(findings: Findings, reasons: list[Reason]) -> list[str]:
    """Sentences: what speaks against; of a trusted band, why it can be trusted."""
    if reasons:
        return [reason.text for reason in sorted(reasons, key=lambda reason: not reason.against)]
    notes = [
        f"The fit settled, and the simulation meets the recording: {_met(findings)}.",
        f"Launches stretch the band to {findings.stretch:.2f} times its length, within the recorded"
        f" {findings.recorded_stretch:.2f}.",
        f"Landings are known to ±{100 * findings.half_width:.0f} cm or better.",
    ]
    if findings.scores:
        notes.append(inside(findings))
    if not findings.unloaded:
        notes.append(
            "No recording lets the drawn band back, so that softening and flow keep their priors:"
            " launches tell what they leave."
        )
    if findings.observed == 1:
        notes.append("One launch is part of the evidence; one is not many.")
    return notes


def _met(findings: Findings) -> str:
    recoil = f", the recoil within {1000 * findings.recoil:.1f} mm" if findings.recoil_seen else ""
    return (
        f"the force within {findings.force:.2f} N, the band in the hand within"
        f" {1000 * findings.held:.1f} mm{recoil}"
    )


def card_text(
    inputs: CardInputs,
    findings: Findings,
    verdict: str,
    reasons: list[str],
    shown: list[ShownValue],
    steps: list[str],
    *,
    linked: bool = True,
) -> str:
    """README.md of a card; without links to other files where it is to stand alone."""
    aims, launches = inputs.aims, len(inputs.confidence.get("launches", []))
    draws = aims.target, aims.draw, aims.landing, aims.failure, aims.interval, aims.hold_force
    tried = sorted(inputs.launched.kind.value_counts().items())
    return filled(
        Path(__file__).with_name("card.md.j2"),
        band=inputs.band,
        method=inputs.method,
        title=SAID[verdict],
        reasons=reasons,
        rig=inputs.params.bands[inputs.band].source == "rig",
        linked=linked,
        glossary=GLOSSARY,
        shown=shown,
        draws=zip(*draws, strict=True),
        finite=np.isfinite,
        history=inputs.theta.get("history"),
        findings=findings,
        met=inputs.confidence.get("recordings"),
        peak=inputs.episode.metadata["preprocessing"]["peak_force"],
        steps=steps,
        pulls=len(inputs.episodes),
        files=", ".join(map(as_code, inputs.recordings)),
        observed=launches_of(launches) if launches else "no launch",
        tried=", ".join(f"{n} {kind}" for kind, n in tried) or "none",
    )
