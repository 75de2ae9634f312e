"""The topics' clocks against each other."""

from __future__ import annotations

from collections.abc import Iterator

from pipeline.recording.checks.finding import Check, Finding
from pipeline.recording.checks.rates import topics
from pipeline.recording.processed import Processed

SURE = 3.0  # standard errors from which something is more than noise
DELAY = 0.002  # s
AHEAD = 0.01  # s of stamps before the force's, by the times of receipt
BEHIND, SLOW = 0.02, {"color": 0.1, "depth": 0.1, "gripper": 0.1}  # s after; pictures take a while

CLOCK = Check(
    "clock",
    "a topic's stamps with the force's, by the times of receipt",
    "transport and driver: some 10 ms, of pictures up to 0.1 s",
    f"{1e3 * AHEAD:g} ms ahead, or {1e3 * BEHIND:g} ms behind"
    f" ({1e3 * SLOW['depth']:g} ms of pictures and gripper)",
    "0.5 s off",
    "stamp all topics by one clock (chrony or PTP between computers), at the moment of measuring",
)
DELAYED = Check(
    "delay",
    "the stamps of pose and camera with the force's, by what the recording shows",
    "standard error of the estimate, 0.5 ms or more",
    f"{SURE:g} standard errors and {1e3 * DELAY:g} ms",
    "",
    "mend them at their driver, or set episode.delays in params.yaml",
)
CHECKS = (CLOCK, DELAYED)


def findings(done: Processed) -> Iterator[Finding]:
    force = done.pull.recording.wrench.delay
    for stream, roles in topics(done):
        most, offset = max(SLOW.get(role, BEHIND) for role in roles), force - stream.delay
        if not -most <= offset <= AHEAD:
            what = f"the stamps of {stream.topic} are {offset:+.3f} s off the force's, judged"
            yield Finding(CLOCK.name, f"{what} by the times of receipt", CLOCK.remedy)
    for role, delay in (("pose", done.delays.pose), ("camera", done.delays.camera)):
        error = delay.error or 0.0
        value = delay.value if delay.error is not None else 0.0
        if delay.source != "setup" and abs(value) > max(DELAY, SURE * error):
            taken = "taken out" if delay.applied else "not taken out"
            yield Finding(
                DELAYED.name,
                f"the stamps of the {role} are {1e3 * value:+.1f} ± {1e3 * error:.1f} ms late"
                f" against the force's, which is {taken}",
                f"mend them at their driver, or set episode.delays.{role} in params.yaml",
            )
