"""Messages of the topics that play a role: gaps, what is missing, how often they come."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sling2sim2real.recording.checks.finding import Check, Finding
from sling2sim2real.recording.input.pace import HELD as SENT
from sling2sim2real.recording.input.pace import MOST_CLOSE
from sling2sim2real.recording.input.stream import Stream
from sling2sim2real.recording.processed import Processed

GAPS = {"wrench": 0.02, "pose": 0.05, "color": 0.2, "depth": 0.2}  # s
MISSING = 0.05  # share of the messages
FORCE_RATE, PICTURE_RATE = 900.0, 20.0  # Hz
RELIABLE = "record with reliable QoS to a local disk"

GAP = Check(
    "gap",
    "the longest time between two messages of a topic with what the episode needs",
    "none: stamps are exact",
    f"{1e3 * GAPS['wrench']:g} ms of force, {1e3 * GAPS['pose']:g} ms of the pose,"
    f" {1e3 * GAPS['depth']:g} ms of pictures",
    "0.3 s of force or pose, or a gap at the release",
    RELIABLE,
)
MISSED = Check(
    "missing",
    "messages with as many as a constant rate has",
    "none: they are counted",
    f"{100 * MISSING:g} % are missing",
    "nearly all are missing",
    RELIABLE,
)
FORCE = Check(
    "force_rate",
    "the force's rate with that at which the release is known to a millisecond",
    "the usual time between values",
    f"below {FORCE_RATE:g} Hz",
    "",
    "record it at 1 kHz",
)
PICTURES = Check(
    "picture_rate",
    "the pictures' rate with the length of a recoil",
    "the usual time between pictures",
    f"below {PICTURE_RATE:g} Hz",
    "",
    "record 30 a second or more",
)
BURSTS = Check(
    "bursts",
    "how the stamps of force, pose and gripper follow on one another with an even rate",
    "the even stamps' scatter, which is in the release's",
    f"{100 * MOST_CLOSE:g} % of them come at once, and are spread evenly",
    "",
    "stamp each sample when it is measured (of an FTDI adapter: set its latency timer to 1 ms)",
)
HELD = Check(
    "held",
    "how often the values of force and pose change with how often they are sent",
    "none: they are counted",
    f"each is sent {SENT:g} times or more: only its first message counts",
    "",
    "record the topic of what measures it, or send each value once",
)
CHECKS = (GAP, MISSED, BURSTS, HELD, FORCE, PICTURES)


def findings(done: Processed) -> Iterator[Finding]:
    for stream, roles in topics(done):
        most = min([GAPS[role] for role in roles if role in GAPS], default=np.inf)
        if stream.longest_gap > most:
            yield GAP.found(f"{stream.topic} has a gap of {stream.longest_gap:.3f} s")
        elif stream.missing > MISSING * (len(stream.stamp) + stream.lost):
            yield MISSED.found(f"{stream.missing} messages of {stream.topic} are missing")
        rate = 1 / stream.period
        if stream.bursts:
            many, every = stream.bursts.count, stream.bursts.interval * 1e-6
            error = stream.bursts.error * 1e-6
            what = f"{stream.topic} is stamped in bursts of {many} every {every:.3g} ms"
            what += f", spread evenly to ± {error:.2g} ms"
            yield BURSTS.found(what)
        if stream.hold:
            what = f"{stream.topic} repeats each value for {1e3 * stream.hold:.3g} ms"
            what += f": it has {rate:.0f} new values a second"
            yield HELD.found(what)
        if "wrench" in roles and rate < FORCE_RATE:
            what = f"the force comes at {rate:.0f} Hz, so the release is known only that coarsely"
            yield FORCE.found(what)
        if "depth" in roles and rate < PICTURE_RATE:
            yield PICTURES.found(f"pictures come at {rate:.0f} Hz, so few of them show the recoil")


def topics(done: Processed) -> list[tuple[Stream, list[str]]]:
    """The topics that play a role, by name, each with its roles."""
    streams = done.pull.recording.streams
    roles: dict[str, list[str]] = {}
    for role, stream in streams.items():
        roles.setdefault(stream.topic, []).append(role)
    return [(streams[played[-1]], played) for _, played in sorted(roles.items())]
