"""The topics' clocks against each other."""

from __future__ import annotations

from collections.abc import Iterator

from sling2sim2real.recording.checks.finding import Check, Finding
from sling2sim2real.recording.checks.rates import topics
from sling2sim2real.recording.input.clocks import LIMITS
from sling2sim2real.recording.processed import Processed
from sling2sim2real.recording.release_pictures import EMPTY_AFTER, ReleasePictures

SURE = LIMITS.sure  # standard errors
DELAY = OPEN = 0.002  # s
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
    "standard error of the estimate, some 0.1 ms",
    f"{SURE:g} standard errors and {1e3 * DELAY:g} ms",
    "",
    "mend them at their driver, or set episode.delays in params.yaml",
)
UNKNOWN = Check(
    "clock_unknown",
    "the stamps of pose and camera with the force's, where nothing shows their delay",
    "what pictures of the release and the fit leave open",
    f"the pose's clock is not known to {1e3 * OPEN:g} ms",
    "",
    "record the force from the robot's own clock, or set episode.delays in params.yaml",
)
RELEASED = Check(
    "release_pictures",
    "the last picture of the drawn band and the next one with the fall of the force",
    f"a picture's time, and {1e3 * EMPTY_AFTER:g} ms in which the outer band leaves its place",
    "drawn after the force fell, or let go before it",
    "drawn for 0.4 s after the force fell",
    "stamp pictures when they are exposed, by the force's clock, or set episode.delays.camera",
)
CONFLICT = Check(
    "clocks_disagree",
    "two estimates of one delay",
    "their standard errors",
    f"{SURE:g} standard errors",
    "",
    "see which clock steps or drifts (chrony or PTP between computers), and record again",
)
FROZEN = Check(
    "frozen_pictures",
    "each depth picture around the release with the one before, pixel by pixel",
    "none: a camera's noise never repeats",
    "",
    "one is sent again while the band must move",
    "see whether the driver or the recorder sends old pictures again, and record again",
)
SMEARED = Check(
    "smeared_pictures",
    "the pictures after the release with the place of the drawn band",
    "under a hundredth of it on sound recordings",
    "a sixth of the drawn band is still there a picture later",
    "",
    "switch temporal filters off, and shorten the exposure",
)
DRIFT = Check(
    "clock_drift",
    "the growth of log_time less stamp with the force's, over the recording",
    "scatter of each second's least delay; messages that pile up all along look like a slow clock",
    f"{1e3 * LIMITS.drifted:g} ms over the recording, and {SURE:g} standard errors",
    "",
    "stamp all topics by one clock (chrony or PTP between computers), and record again",
)
CHECKS = (CLOCK, DRIFT, DELAYED, UNKNOWN, RELEASED, CONFLICT, FROZEN, SMEARED)


def findings(done: Processed) -> Iterator[Finding]:
    force = done.pull.recording.wrench.receipt_delay
    for stream, roles in topics(done):
        most, offset = max(SLOW.get(role, BEHIND) for role in roles), force - stream.receipt_delay
        if not -most <= offset <= AHEAD:
            what = f"the stamps of {stream.topic} are {offset:+.3f} s off the force's, judged"
            yield CLOCK.found(f"{what} by the times of receipt")
    yield from of_drift(done)
    yield from of_delays(done)
    left = done.delays.pose.left or 0.0
    if left > OPEN:
        yield UNKNOWN.found(
            f"the pose's clock against the force's is not known better than"
            f" ± {1e3 * left:.1f} ms, and each ms is 0.4 % of the modulus"
        )
    if done.delays.conflict:
        yield CONFLICT.found(done.delays.conflict)
    if done.delays.release is not None:
        yield from of_release(done.delays.release)


def of_delays(done: Processed) -> Iterator[Finding]:
    """Findings on the delays of pose and camera, beside what was given of them."""
    for role, delay in (("pose", done.delays.pose), ("camera", done.delays.camera)):
        error, late = delay.error or 0.0, delay.value - (delay.given or 0.0)
        if abs(late) <= max(DELAY, SURE * error):
            continue
        what = (
            f"the stamps of the {role} are {1e3 * late:+.1f} ± {1e3 * error:.1f} ms late against"
            " the force's"
        )
        cure = f"mend them at their driver, or set episode.delays.{role} in params.yaml"
        if delay.given is not None:
            what += f" beside the {delay.given:g} s that episode.delays.{role} says"
            cure = f"set it to {delay.value:.4f}, or to null"
        what += f", which is {'taken out' if delay.applied else 'not taken out'}"
        if delay.alone:
            what += "; only the hand that starts back shows it, as a robot's own motion would"
            cure = f"set episode.delays.{role} to what it is (0 where it is the robot's own motion)"
        yield DELAYED.found(what, cure)


def of_drift(done: Processed) -> Iterator[Finding]:
    """Findings on the clocks' rates, by the times of receipt."""
    for stream, _ in topics(done):
        drift = stream.drift
        if drift.matters:
            taken = "taken out" if drift.taken_out else "not steady enough to be taken out"
            rate = f"{1e6 * drift.rate:+.0f} ± {1e6 * drift.error:.0f} ppm"
            what = (
                f"the clock of {stream.topic} runs {rate} against the force's,"
                f" {1e3 * drift.rate * drift.span:+.1f} ms over the recording, which is {taken}"
            )
            yield DRIFT.found(what)


def of_release(seen: ReleasePictures) -> Iterator[Finding]:
    """Findings on the pictures around the release, with the camera's stamps as they were."""
    if seen.frozen:
        first, count = seen.frozen[0], len(seen.frozen)
        what = f"{count} pictures from {1e3 * first:+.0f} ms of the release on are old ones again"
        yield FROZEN.found(what, refused=True)
    elif seen.never:
        what = f"pictures show the band drawn until {seen.drawn:.2f} s after the force falls"
        cure = "set episode.delays.camera, or record again with one clock"
        yield RELEASED.found(what, cure, refused=True)
    elif seen.again:
        what = (
            f"the band is drawn once more {1e3 * seen.again[0]:.0f} ms after the release, when it"
            f" was gone at {1e3 * seen.gone:.0f} ms"
        )
        yield RELEASED.found(what, "record again: pictures are old or in disorder")
    elif seen.beyond > 0:
        what = (
            f"a picture of {1e3 * seen.drawn:+.0f} ms after the force falls shows the band drawn,"
            f" that of {1e3 * seen.gone:+.0f} ms shows it let go, so the camera's stamps are"
            f" {1e3 * seen.earliest:+.0f} to {1e3 * seen.latest:+.0f} ms late"
        )
        yield RELEASED.found(what)
    if seen.smeared:
        share = 100 * max(seen.faded[1:3])
        what = f"{share:.0f} % of the drawn band is still seen a picture after it was let go"
        yield SMEARED.found(what)
