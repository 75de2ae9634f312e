"""A card's words."""

from __future__ import annotations

import numpy as np

from pipeline.report.card.findings import Findings
from pipeline.report.card.inputs import CardInputs
from pipeline.report.card.values import ShownValue
from pipeline.report.card.verdict import CARE, NO, TRUSTED, Reason, inside, launches_of
from pipeline.report.drawing.names import as_code

# From the card's folder; its page stands alone.
GLOSSARY = "../../../docs/glossary.md"
SAID = {TRUSTED: "can be trusted", CARE: "use with care", NO: "do not use it"}


def reasons_of(found: Findings, reasons: list[Reason]) -> list[str]:
    """Sentences: what speaks against; of a trusted band, why it can be trusted."""
    if reasons:
        return [one.text for one in sorted(reasons, key=lambda one: not one.against)]
    notes = [
        f"The fit settled, and the simulation meets the recording: {_met(found)}.",
        f"Launches stretch the band to {found.stretch:.2f} times its length, within the recorded"
        f" {found.recorded_stretch:.2f}.",
        f"Landings are known to ±{100 * found.half_width:.0f} cm or better.",
    ]
    if found.scores:
        notes.append(inside(found))
    if not found.unloaded:
        notes.append(
            "No recording lets the drawn band back, so that softening keeps its prior: launches"
            " tell what it leaves."
        )
    if found.observed == 1:
        notes.append("One launch is part of the evidence; one is not many.")
    return notes


def _met(found: Findings) -> str:
    recoil = f", the recoil within {1000 * found.recoil:.1f} mm" if found.recoil_seen else ""
    return (
        f"the force within {found.force:.2f} N, the band in the hand within"
        f" {1000 * found.held:.1f} mm{recoil}"
    )


def residuals(inputs: CardInputs, found: Findings) -> str:
    """How near the simulation comes, in plain words."""
    peak = inputs.episode.metadata["preprocessing"]["peak_force"]
    if not inputs.confidence:
        return "This method does not tell how near it comes; the report has its loss.\n"
    pictures = inputs.confidence["recordings"][0]["pictures"]
    seen = " and ".join(f"{1000 * time:.0f} ms" for time in pictures)
    recoil = (
        f"- The **recoil** is met within {1000 * found.recoil:.1f} mm. It is seen {seen} after the"
        " release;\n  later pictures show the slack band, which no launch depends on.\n"
    )
    if not pictures:
        recoil = "- The **recoil** is in no picture that tells.\n"
    return f"""\
What is left, as a root mean square; the sensor's bias and what the camera's calibration leaves
open are taken out:

- The **force** of the pull is met within {found.force:.2f} N of {peak:.1f} N.
- The **band in the hand** lies within {1000 * found.held:.1f} mm of the camera's points.
{recoil}"""


def card_text(
    inputs: CardInputs,
    found: Findings,
    verdict: str,
    reasons: list[str],
    shown: list[ShownValue],
    steps: list[str],
    *,
    animated: bool = True,
) -> str:
    """README.md of a card; without the animation where a replay takes its place."""
    rig = inputs.params.bands[inputs.band].source == "rig"
    note = "A band of the **virtual rig**: its recording and its landings are virtual.\n\n"
    animation = (
        "![The release, recorded and simulated, 50 times slower](animation.webp)\n\n"
        "*The release, 50 times slower: the simulated band in the camera's pictures (left) and"
        " its points (right).*\n"
    )
    meanings = f"\n[What each of them is]({GLOSSARY}).\n"
    return f"""\
# {inputs.band}: {SAID[verdict]}

{_listed(reasons, "-")}
{note if rig else ""}{animation if animated else ""}
## Values

{_values(shown)}{meanings if animated else ""}
![Values with their intervals](values.png)

## Where to draw

{_draws(inputs)}
![Predicted landings](landings.png)

## How near the simulation comes

{residuals(inputs, found)}
![The simulated band in the camera's pictures](camera.webp)

![Force, measured and simulated](force.png)

## What would help next

{_listed(steps, "1.")}
## What it rests on

{_rests(inputs)}"""


def _listed(sentences: list[str], bullet: str) -> str:
    return "".join(f"{bullet} {one}\n" for one in sentences)


def _values(shown: list[ShownValue]) -> str:
    lines = ["| | value | 90 % interval | prior |", "| --- | --- | --- | --- |"]
    for one in (one for one in shown if not one.fixed):
        interval = "not known" if one.low is None else f"{one.low:g}–{one.high:g}"
        prior = f"{one.prior[0]:g}–{one.prior[1]:g}" if one.prior else "–"
        prior += "" if one.identified else " (**not identified**)"
        value = f"{one.value:g} {one.unit}".strip()
        lines.append(f"| {one.label} | {value} | {interval} | {prior} |")
    fixed = ", ".join(f"{one.label} {one.value:g}" for one in shown if one.fixed)
    notes = f"\nFixed, for no pull shows them: {fixed}.\n" if fixed else ""
    return "\n".join(lines) + "\n" + notes


def _draws(inputs: CardInputs) -> str:
    lines = [
        "| target | draw y, z | lands at | 90 % interval | force to hold |",
        "| --- | --- | --- | --- | --- |",
    ]
    aims = inputs.aims
    for row, target in enumerate(aims.target):
        y, z = aims.draw[row]
        low, high = aims.interval[row]
        interval = f"{low:.2f} to {high:.2f} m" if np.isfinite(low + high) else "not known"
        landing = aims.failure[row] or f"{aims.landing[row]:.3f} m"
        force = f"{aims.hold_force[row]:.1f} N" if np.isfinite(aims.hold_force[row]) else "–"
        lines.append(f"| {target:g} m | {y:.4f}, {z:.4f} m | {landing} | {interval} | {force} |")
    history = inputs.theta.get("history")
    requested = ""
    if history:
        requested = (
            f"\nDraw and wait as in the recording: about {history['pull_time']:.1f} s for the way,"
            f" then {history['pause']:.1f} s. The band remembers.\n"
        )
    return "\n".join(lines) + "\n" + requested


def _rests(inputs: CardInputs) -> str:
    count, launches = len(inputs.episodes), len(inputs.confidence.get("launches", []))
    files = ", ".join(map(as_code, inputs.recordings))
    pulls = f"{count} pull{'s' * (count != 1)} in {files}"
    observed = launches_of(launches) if launches else "no launch"
    launched = inputs.launched.kind.value_counts()
    tried = ", ".join(f"{n} {kind}" for kind, n in sorted(launched.items())) or "none"
    return f"""\
- Evidence: {pulls}; {observed}.
- Method: `{inputs.method}`; values in `data/theta/{inputs.band}/{inputs.method}.json`.
- Landings held against predictions: {tried}.
"""
