"""What costs accuracy in a recording that can be used, and what to do about it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from app.preflight.facts import CloudFacts, SignalSummary
from app.preflight.report import Caution, CheckReport, Chosen
from pipeline.params.lab import SetupParams
from pipeline.recording.build import Processed
from pipeline.recording.events import SETTLE
from pipeline.recording.pulls import CALM
from pipeline.recording.signals import Signals

GAPS = {"wrench": 0.02, "pose": 0.05, "color": 0.2, "depth": 0.2}  # s
MISSING = 0.05  # share of the messages
FORCE_RATE, PICTURE_RATE = 900.0, 20.0  # Hz
COVERAGE = {"hanging": 0.7, "drawn": 0.9, "recoil": 0.6, "swing": 0.7}
EMPTY = 0.05  # share of the pictures
FOREIGN = 0.02  # share of a picture's points
TIPS_OFF, HAND_OFF = 0.004, 0.006  # m
SURE = 3.0  # standard errors from which something is more than noise
NOISE = DRIFT = SETTLED = 0.02  # of the held force; drift from grasp to release
DELAY = 0.002  # s
AHEAD = 0.01  # s of stamps before the force's, by the times of receipt
BEHIND, SLOW = 0.02, {"color": 0.1, "depth": 0.1, "gripper": 0.1}  # s after; pictures take a while
LEAD_IN, PAUSE = 0.5, 1.0  # s
STILL = 0.005  # m/s
TURN = 2.0  # degrees
RELEASE = 0.001  # s
SEEN_AS = {"hanging": "hangs", "drawn": "is drawn", "recoil": "recoils", "swing": "swings"}


def cautions_of(report: CheckReport, done: Processed) -> list[Caution]:
    """In the order of a recording's way: file, topics, clocks, force, motion, pictures, frames.

    Args:
        report: With everything but its cautions.
        done: What it was told from.

    Raises:
        ValueError: about a report without signals or cloud.
    """
    setup, facts, cloud = done.params.setup, report.signals, report.cloud
    if facts is None or cloud is None:
        raise ValueError("a pull that is not understood has a problem, no cautions")
    return [
        *_of_file(report),
        *_of_topics(report, done),
        *_of_clocks(report),
        *_of_force(facts, setup),
        *_of_motion(facts, done.signals, setup),
        *_of_rest(facts, done),
        *_of_pictures(report, cloud),
        *_of_sensor(done),
        *_of_loop(done),
        *_of_frames(report),
    ]


def _of_file(report: CheckReport) -> Iterator[Caution]:
    for note in report.notes:
        if "no checksums" in note:
            yield Caution("checksums", note, "let the recorder write chunk CRCs, its default")
    if report.losses:
        count = len(report.losses)
        what = f"{count} {'things were' if count > 1 else 'thing was'} lost or mended, see below"
        cure = "see whether it touches the pull; copy the file again, or record again"
        yield Caution("losses", what, cure)


def _of_topics(report: CheckReport, done: Processed) -> Iterator[Caution]:
    reliable = "record with reliable QoS to a local disk"
    for row in _chosen(report):
        roles = row.role.split(", ")
        if row.longest_gap > min([GAPS[role] for role in roles if role in GAPS], default=np.inf):
            yield Caution("gap", f"{row.topic} has a gap of {row.longest_gap:.3f} s", reliable)
        elif row.missing > MISSING * row.messages:
            yield Caution("missing", f"{row.missing} messages of {row.topic} are missing", reliable)
        yield from _of_rate(row, roles)
    if not done.pull.recording.gripper:
        what = "the gripper was not recorded, so the grasp is read from the lift"
        yield Caution("gripper", what, "record its joint states")


def _chosen(report: CheckReport) -> list[Chosen]:
    return [row for row in report.topics if isinstance(row, Chosen)]


def _of_rate(row: Chosen, roles: list[str]) -> Iterator[Caution]:
    if "wrench" in roles and row.rate < FORCE_RATE:
        what = f"the force comes at {row.rate:.0f} Hz, so the release is known only that coarsely"
        yield Caution("force_rate", what, "record it at 1 kHz")
    if "depth" in roles and row.rate < PICTURE_RATE:
        what = f"pictures come at {row.rate:.0f} Hz, so few of them show the recoil"
        yield Caution("picture_rate", what, "record 30 a second or more")


def _of_clocks(report: CheckReport) -> Iterator[Caution]:
    for row in _chosen(report):
        most = max(SLOW.get(role, BEHIND) for role in row.role.split(", "))
        if not -most <= row.clock_offset <= AHEAD:
            yield Caution(
                "clock",
                f"the stamps of {row.topic} are {row.clock_offset:+.3f} s off the force's, judged"
                " by the times of receipt",
                "stamp all topics by one clock (chrony or PTP between computers), at the"
                " moment of measuring",
            )
    for role, delay in report.delays.items():
        value, error = delay.value_s or 0.0, delay.error_s or 0.0
        if delay.source != "setup" and abs(value) > max(DELAY, SURE * error):
            done = "taken out" if delay.applied else "not taken out"
            yield Caution(
                "delay",
                f"the stamps of the {role} are {1e3 * value:+.1f} ± {1e3 * error:.1f} ms late"
                f" against the force's, which is {done}",
                f"mend them at their driver, or set episode.delays.{role} in params.yaml",
            )


def _of_force(facts: SignalSummary, setup: SetupParams) -> Iterator[Caution]:
    hold = float(np.linalg.norm(facts.hold_force_n))
    share = facts.noise_n / hold
    if share > NOISE:
        what = f"the force's noise is {facts.noise_n:.2f} N, {100 * share:.0f} % of the hold"
        yield Caution("noise", what, "shield the sensor's cable, stop what shakes the arm")
    pull = facts.release_s - facts.grasp_s
    drifted = float(np.linalg.norm(facts.drift_n_s)) * pull
    if drifted > DRIFT * hold:
        what = f"the force drifts by {drifted:.2f} N from grasp to release"
        cure = "let the sensor warm up for half an hour (a steady drift is taken out)"
        yield Caution("drift", what, cure)
    if facts.peak_force_n > setup.max_force:
        yield Caution(
            "max_force",
            f"the peak force of {facts.peak_force_n:.1f} N is above setup.max_force"
            f" {setup.max_force:g} N",
            "pull less far, or set in params.yaml what the arm may hold",
        )
    if facts.release_error_s > RELEASE:
        what = f"the release is known to ± {1e3 * facts.release_error_s:.1f} ms"
        cure = "record the force at 1 kHz, unfiltered: 1 ms is 3 to 4 % of a landing"
        yield Caution("release", what, cure)
    for time in facts.slips_s:
        what = f"the force drops suddenly at {time:.2f} s, before the release"
        yield Caution("slip", what, "the band slipped in the pads: grip firmly and record again")


def _of_motion(facts: SignalSummary, signals: Signals, setup: SetupParams) -> Iterator[Caution]:
    if round(facts.grasp_s, 2) < LEAD_IN:
        what = f"only {facts.grasp_s:.2f} s of the empty hand come before the grasp"
        yield Caution("lead_in", what, f"record {LEAD_IN} s or more, the force is tared there")
    still, change = pause(signals)
    if still < PAUSE or change > SETTLED:
        what = f"the hand rests for {still:.1f} s before the release"
        if change > SETTLED:
            what += f", and in its last half second the force changes by {100 * change:.1f} %"
        yield Caution("pause", what, "pause for 1 to 2 s, until the force has settled")
    if facts.turn_deg > TURN and setup.tool is None:
        what = f"the hand turns by {facts.turn_deg:.1f} degrees, and its weight with it"
        yield Caution("turn", what, "keep its orientation, or give setup.tool in params.yaml")


def _of_rest(facts: SignalSummary, done: Processed) -> Iterator[Caution]:
    """Of the band before a pull that follows on another."""
    since = facts.window_start_s - done.pull.force_time[0] + SETTLE
    if done.pull.number > 1 and since < CALM:
        what = f"the pictures begin {since:.1f} s after the pull before, the band may still swing"
        yield Caution("rest", what, f"wait for {CALM - since:.1f} s longer between two pulls")


def pause(signals: Signals) -> tuple[float, float]:
    """How long the hand rests before the release [s], and the force's relative change in its end.

    The change is that of a straight line through the last half second that the filter leaves clear.
    """
    times, release = signals.time, signals.release_time
    moving = (np.linalg.norm(signals.velocity, axis=1) > STILL) & (times < release - 0.05)
    still = release - float(times[moving][-1]) if moving.any() else release
    late = (times > release - 0.55) & (times < release - 0.05)
    if late.sum() < 3:
        return still, 0.0
    force = np.linalg.norm(signals.force[late], axis=1)
    slope = np.polyfit(times[late], force, 1)[0]
    return still, float(abs(0.5 * slope) / max(force.mean(), 1e-9))


def _of_pictures(report: CheckReport, facts: CloudFacts) -> Iterator[Caution]:
    look = "look at --sheet; nearer camera, more light, another background, or cloud.mask folder"
    for row in report.phases:
        if row.coverage < COVERAGE.get(row.phase, 0.0):
            yield Caution(
                "coverage",
                f"{100 * row.coverage:.0f} % of the band is covered while it"
                f" {SEEN_AS[row.phase]} ({row.start:.2f} - {row.end:.2f} s)",
                look,
            )
    shown = {row.phase for row in report.phases}
    for phase in (phase for phase in SEEN_AS if phase not in shown):
        what = f"no picture shows how the band {SEEN_AS[phase]}"
        yield Caution("unseen", what, "record the camera from before the grasp until it has swung")
    told = [(row.time, row.off_plane) for row in report.coverage if row.off_plane is not None]
    foreign = [time for time, off_plane in told if off_plane > FOREIGN]
    if foreign:
        times = f"{foreign[0]:.2f} - {foreign[-1]:.2f} s"
        yield Caution(
            "off_plane",
            f"{len(foreign)} of {len(told)} pictures of the hanging band hold points off the plane"
            f" that it hangs in ({times}): the hand, the arm or the background",
            look,
        )
    if facts.empty > EMPTY * facts.frames:
        what = f"{facts.empty} of {facts.frames} pictures show no band"
        yield Caution("empty", what, look)
    driver, rates = "see whether the camera's driver sends empty ones", "record both at one rate"
    for name, count, what, cure in (
        ("damaged", facts.damaged, "cannot be decoded", driver),
        ("unpaired", facts.unpaired, "have no colour picture", f"{rates}, with reliable QoS"),
    ):
        if count > EMPTY * facts.frames:
            yield Caution(name, f"{count} depth pictures {what}", cure)


def _of_sensor(done: Processed) -> Iterator[Caution]:
    recording = done.pull.recording
    frame, known = recording.wrench.frame, recording.transforms.frames
    if frame not in known and not done.pull.geometry.sensor_is_fixed:
        yield Caution(
            "sensor",
            f"/tf_static does not know the force's frame {frame!r}, so it is taken as the hand's",
            "publish how the sensor is turned relative to the tool centre point",
        )


def _of_loop(done: Processed) -> Iterator[Caution]:
    loop = done.pull.geometry.loop
    if loop and not loop.closed:
        told = [name for name in ("base_to_fork", "camera_to_fork") if _given(done, name)]
        yield Caution(
            "loop",
            str(loop),
            f"setup.{' or setup.'.join(told)} contradicts /tf_static: touch the tips or calibrate"
            " the camera again (docs/recording.md, Calibration)",
        )


def _given(done: Processed, name: str) -> bool:
    return done.pull.geometry.sources[name].startswith("setup")


def _of_frames(report: CheckReport) -> Iterator[Caution]:
    facts = report.extrinsics
    if not facts:
        what = "too few pictures of the drawn band to tell how far the fork tips are off"
        yield Caution("extrinsics", what, "pull slowly, and further")
        return
    off, error = facts.off_m, facts.off_error_m
    if off > max(TIPS_OFF, SURE * error):
        pose = ", ".join(f"{number:g}" for number in facts.camera_to_fork)
        yield Caution(
            "extrinsics",
            f"the camera shows the fork tips {1e3 * off:.1f} ± {1e3 * error:.1f} mm off",
            f"calibrate it again, or set setup.camera_to_fork: [{pose}] in params.yaml",
        )
    off, error = facts.hand_off_m, facts.hand_off_error_m
    if off > max(HAND_OFF, SURE * error):
        yield Caution(
            "hand",
            f"the band ends {1e3 * off:.1f} ± {1e3 * error:.1f} mm from the tool centre point",
            "check base_to_fork, the tool centre point, and where the pads hold the band",
        )
