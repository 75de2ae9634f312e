"""Sound recordings, changed in one thing, and what the checks find in them."""

from collections.abc import Iterable
from dataclasses import replace

from pipeline.params import Params
from sling2sim2real.recording import checks
from sling2sim2real.recording.build import Whole
from sling2sim2real.recording.checks import Finding
from sling2sim2real.recording.events import Part, Pull
from sling2sim2real.recording.signals import signals_of

BAND = "band1"


def with_recording(done: Whole, **changes) -> Part:
    """With other streams or words."""
    pull = done.pull
    return Part(replace(pull.recording, **changes), pull.geometry, pull.number, pull.count)


def with_facts(done: Whole, **facts) -> Whole:
    """With other `SignalFacts`."""
    signals = replace(done.signals, facts=replace(done.signals.facts, **facts))
    return replace(done, signals=signals)


def with_force(done: Whole, change, params: Params) -> Whole:
    """With `change(times, values)` of the raw force, from the events on. Raises UserError."""
    wrench = done.pull.recording.wrench
    values = change(done.pull.force_time, wrench.values)
    pull = Pull.of(with_recording(done, wrench=replace(wrench, values=values)))
    signals = signals_of(pull, params, done.delays.tool_inertia)
    return replace(done, pull=pull, signals=signals, scene=replace(done.scene, signals=signals))


def of_signals(done: Whole, params: Params) -> list[Finding]:
    band = params.bands[BAND]
    scene = replace(done.scene, signals=done.signals)
    return [
        *checks.of_signals(done.pull, done.delays, done.signals, scene, band, params, weighed=True)
    ]


def of_pictures(done: Whole, taut: float | None = 1.0) -> list[Finding]:
    return [*checks.of_pictures(done.scene, done.clouds, done.coverage, (taut, 0.0))]


def abouts(findings: Iterable[Finding]) -> set[str]:
    return {finding.about for finding in findings}
