"""The table of all checks, in the order of a recording's way, and what they find."""

from __future__ import annotations

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.checks import (
    camera,
    container,
    force,
    frames,
    hold,
    motion,
    pictures,
    rates,
    roles,
    times,
)
from sling2sim2real.recording.checks.finding import Check, Finding
from sling2sim2real.recording.processed import Processed

CONCERNS = (container, roles, rates, times, force, hold, motion, pictures, frames, camera)
UNDERSTOOD = Check(
    "pull",
    "what was recorded with a pull: a lead-in, a grasp, a draw, a release, pictures of a band",
    "each step's own",
    "",
    "one of them is not there or cannot be determined",
    "as the reason says (docs/faq.md)",
)
CHECKS: tuple[Check, ...] = (
    *(check for concern in CONCERNS for check in concern.CHECKS),
    UNDERSTOOD,
)


def findings_of(done: Processed) -> list[Finding]:
    """Findings of one pull, in the order of the table, up to the concern that refuses it.

    More may follow from what refuses it.
    """
    findings: list[Finding] = []
    for concern in CONCERNS:
        try:
            findings += concern.findings(done)
        except UserError as error:
            findings.append(Finding(UNDERSTOOD.name, str(error), "", refused=True))
        if any(finding.refused for finding in findings):
            break
    return findings
