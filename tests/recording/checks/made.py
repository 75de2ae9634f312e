"""Sound recordings, changed in one thing."""

from collections.abc import Iterable
from dataclasses import replace

from sling2sim2real.recording.build import Checked
from sling2sim2real.recording.checks.finding import Finding


def with_recording(done: Checked, **changes) -> Checked:
    """With other streams or words; everything is worked out anew."""
    recording = replace(done.pull.recording, **changes)
    return replace(done, pull=replace(done.pull, recording=recording))


def with_results(done: Checked, **results) -> Checked:
    """With other results of steps (`signals`, `clouds`, `tips` ...); the rest is as it was."""
    changed = replace(done)
    vars(changed).update({**vars(done), **results})
    vars(changed).pop("findings", None)
    return changed


def with_facts(done: Checked, **facts) -> Checked:
    """With other `SignalFacts`."""
    signals = replace(done.signals, facts=replace(done.signals.facts, **facts))
    return with_results(done, signals=signals)


def abouts(findings: Iterable[Finding]) -> set[str]:
    return {finding.about for finding in findings}
