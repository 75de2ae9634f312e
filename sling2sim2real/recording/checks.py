"""What can be wrong with a recording: one table of checks, and what each finds.

A check says what it compares, how surely, from when on it warns and refuses, and what to do. They
are asked at three points of a recording's way (`build`): of its topics, its signals, its pictures.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from sling2sim2real.recording.calibration import MATTERS, Calibration
from sling2sim2real.recording.calibration import SURE as SHIFT_SURE
from sling2sim2real.recording.clouds import Clouds, PictureLine, by_phase
from sling2sim2real.recording.delays import SMALL, Delays
from sling2sim2real.recording.events import CALM, OPENING, SETTLE, Part, Pull
from sling2sim2real.recording.force import QUIET, flat_top
from sling2sim2real.recording.frames import Geometry
from sling2sim2real.recording.hold import Hold, hold_of
from sling2sim2real.recording.pace import HELD, MOST_CLOSE
from sling2sim2real.recording.release_pictures import EMPTY_AFTER, ReleasePictures
from sling2sim2real.recording.scene import Scene
from sling2sim2real.recording.signals import Signals
from sling2sim2real.recording.streams import Stream
from sling2sim2real.recording.transforms import Transform
from sling2sim2real.settings import Settings
from sling2sim2real.settings.lab import BandParams

SURE = 3.0  # standard errors from which a delay, a direction, a place is off
GAPS = {"wrench": 0.02, "pose": 0.05, "color": 0.2, "depth": 0.2}  # s
MISSING = 0.05  # share of the messages
FORCE_RATE, PICTURE_RATE = 900.0, 20.0  # Hz
AHEAD = 0.01  # s of stamps before the force's, by the times of receipt
BEHIND, SLOW = 0.02, {"color": 0.1, "depth": 0.1, "gripper": 0.1}  # s after; pictures take a while
DRIFTED, UNKNOWN_CLOCK = 0.003, 0.02  # s over the recording
OPEN = 0.002  # s
DRIFT = 0.02  # of the held force from grasp to release
RELEASE = 0.001  # s
ZERO_OFF, ZERO_UNSURE, ZERO_FAR, ZERO_SURE = 0.01, 0.02, 0.1, 2.0  # of the held force; errors
LATE = 0.02  # s: a filter that delays by more makes the whole force late
ASTRAY = np.deg2rad(7.0)  # beyond SURE: too far to be used
RUBBERS = (0.06e6, 12e6)  # Pa: Young's moduli of rubbers
NO_RUBBER = (0.01e6, 50e6)  # Pa: those of none
LIGHT = 0.25  # of the band's weight on the hand: too little
PAUSE, SETTLED, STILL = 1.0, 0.02, 0.005  # s, of the held force, m/s
COVERAGE = {"hanging": 0.7, "drawn": 0.9, "recoil": 0.6, "swing": 0.7}
SEEN_AS = {"hanging": "hangs", "drawn": "is drawn", "recoil": "recoils", "swing": "swings"}
EMPTY, FOREIGN = 0.05, 0.02  # share of the pictures, of a picture's points
HAND_OFF = 0.006  # m
ONE_CLOCK = "stamp all topics by one clock (chrony or PTP between computers), and record again"
LOOK = "look at --sheet; nearer camera, more light, another background, or cloud.mask folder"


@dataclass(frozen=True)
class Check:
    """A row of the table of checks.

    Attributes:
        name: By which programs know it.
        compares: What is compared with what.
        uncertainty: Of the comparison, and where it comes from.
        warns: From when on a finding costs accuracy; "" where it always refuses.
        refuses: From when on the recording cannot be used; "" where it always can.
        remedy: What to do about it.
    """

    name: str
    compares: str
    uncertainty: str
    warns: str
    refuses: str
    remedy: str


@dataclass(frozen=True)
class Finding:
    """What a check found.

    Attributes:
        about: The check's name.
        what: With the numbers of this recording.
        cure: What to do about it; "" where `what` says it.
        refused: The recording cannot be used.
    """

    about: str
    what: str
    cure: str
    refused: bool = False

    def __str__(self) -> str:
        return f"{self.what}: {self.cure}" if self.cure else self.what

    def content(self) -> dict[str, str]:
        """Return the finding's texts for an episode's metadata."""
        return {"about": self.about, "what": self.what, "cure": self.cure}


# fmt: off
TABLE = (
    Check("losses",
        "what the file holds with what can be read",
        "none: a message can be read or not",
        "anything was lost or mended",
        "no pull is left that can be used",
        "see whether it touches the pull; copy the file again, or record again"),
    Check("gripper",
        "the recording's topics with those that tell of the grasp",
        "without a gripper the grasp is known to some 0.1 s",
        "no topic tells of the fingers",
        "neither the fingers nor a lift tell when the band is grasped",
        "record its joint states"),
    Check("gap",
        "the longest time between two messages, and their number, with a constant rate",
        "none: stamps are exact",
        f"{1e3 * GAPS['wrench']:g} ms of force, {1e3 * GAPS['pose']:g} ms of the pose,"
        f" {1e3 * GAPS['depth']:g} ms of pictures, or {100 * MISSING:g} % are missing",
        "0.3 s of force or pose, a gap at the release, or nearly all are missing",
        "record with reliable QoS to a local disk"),
    Check("stamps",
        "how stamps and values of force, pose and gripper follow on one another with an even rate",
        "the even stamps' scatter, which is in the release's",
        f"{100 * MOST_CLOSE:g} % come at once, and are spread evenly; or each value is sent"
        f" {HELD:g} times or more, of which the first counts",
        "",
        "stamp a sample when it is measured, and send it once (FTDI: latency timer of 1 ms)"),
    Check("rate",
        "the rates of force and pictures with the length of the release and of the recoil",
        "the usual time between values",
        f"force below {FORCE_RATE:g} Hz, pictures below {PICTURE_RATE:g} Hz",
        "",
        "record the force at 1 kHz, 30 pictures a second or more"),
    Check("clock",
        "a topic's stamps with the force's, by the times of receipt, all through the recording",
        "some 10 ms, of pictures up to 0.1 s; the scatter of each second's least delay",
        f"{1e3 * AHEAD:g} ms ahead, or {1e3 * BEHIND:g} ms behind ({1e3 * SLOW['depth']:g} ms of"
        f" pictures and gripper); {1e3 * DRIFTED:g} ms and {SURE:g} standard errors of drift",
        f"0.5 s off, or {1e3 * UNKNOWN_CLOCK:g} ms of drift",
        ONE_CLOCK),
    Check("delay",
        "the stamps of pose and camera with the force's, by what the recording shows",
        "the estimates' standard errors; what nothing shows the fit leaves open",
        f"{1e3 * SMALL:g} ms and {SURE:g} standard errors, which are taken out; the pose's is not"
        f" known to {1e3 * OPEN:g} ms; or two estimates disagree",
        "only the hand that starts back shows the pose's, or its tool's inertia contradicts it",
        "record the force from the robot's own clock, or set episode.delays in params.yaml"),
    Check("release_pictures",
        "the last picture of the drawn band and the next one with the fall of the force, and each"
        " picture around it with the one before, pixel by pixel",
        f"a picture's time, and {1e3 * EMPTY_AFTER:g} ms in which the outer band leaves its place",
        "drawn after the force fell, or let go before it",
        "drawn for 0.4 s after the force fell, or one is sent again while the band must move",
        "stamp pictures when they are exposed, by the force's clock, or set episode.delays.camera"),
    Check("range",
        "the force's noise at its peak with the free hand's",
        "thousands of samples tell the scatter",
        "",
        f"below {100 * QUIET:g} % of it at an extreme value",
        "pull less far, or use a sensor of a larger range"),
    Check("filter",
        "how long the force falls at the release, and its noise, with an unfiltered sensor's",
        "the time between samples",
        f"{1e3 * OPENING:g} ms, or three samples where neighbouring ones have the same noise",
        f"{1e3 * LATE:g} ms",
        "record the sensor's own, unfiltered force"),
    Check("zero",
        "the free hand's force, before the grasp and after the release, with a steady drift",
        "the means' and slopes' standard errors, by blocks of 50 ms",
        f"it drifts by {100 * DRIFT:g} % of the held force during the pull, moves by"
        f" {100 * ZERO_OFF:g} % but not steadily, or is not known to {100 * ZERO_UNSURE:g} %",
        f"{100 * ZERO_FAR:g} %, as where the sensor is zeroed while recording",
        "let the sensor warm up, zero it before recording; keep the hand free and at rest at both"
        " ends"),
    Check("max_force",
        "the peak force with setup.max_force",
        "the sensor's own",
        "above it",
        "",
        "pull less far, or set in params.yaml what the arm may hold"),
    Check("release",
        "how surely the force's fall tells the time of the release, and sudden drops before it",
        "the fall's standard error; the force's noise",
        f"{1e3 * RELEASE:g} ms, or a drop before the release",
        "force is missing around the release, or never drops, or the gripper stays closed",
        "record the force at 1 kHz, unfiltered: 1 ms is 3 to 4 % of a landing"),
    Check("direction",
        "the held force with the plane of the band's two strands and their resultant, less half the"
        " band's weight",
        "about 1 degree: 5 mm of the hand's place, half a degree of the sensor's frame, the zero's",
        f"{SURE:g} standard errors",
        f"{np.degrees(ASTRAY):g} degrees more",
        "check the turn from the hand to the wrench's frame (/tf_static), then base_to_fork"),
    Check("units",
        "the held force with a rubber's modulus, and the slack band's weight with its mass",
        "a factor of 2 of the modulus, by the law; the zero's of the weight",
        f"Young's modulus below {RUBBERS[0] / 1e6:g} or above {RUBBERS[1] / 1e6:g} MPa, or less"
        f" than {LIGHT:g} of the weight",
        f"below {NO_RUBBER[0] / 1e6:g} or above {NO_RUBBER[1] / 1e6:g} MPa",
        "let the driver publish newtons, or check the band's diameter, rest length and mass"),
    Check("pause",
        "the hand's rest before the release with the time in which rubber settles, and the"
        f" pictures' beginning with the pull before: a band swings for {CALM:g} s",
        "of the release: below a millisecond",
        f"less than {PAUSE:g} s, the force still changes by {100 * SETTLED:g} % in half a second,"
        f" or less than {CALM:g} s after the pull before",
        "",
        "pause for 1 to 2 s, until the force has settled"),
    Check("coverage",
        "the band's points with where the band must be, and the pictures' times with the phases",
        "a band's thickness; the mean of many pictures",
        ", ".join(f"{100 * least:g} % while it {SEEN_AS[k]}" for k, least in COVERAGE.items())
        + f"; a phase is in no picture, or {100 * EMPTY:g} % of the pictures show no band",
        "no picture shows a band, or the drawn band",
        LOOK),
    Check("off_plane",
        "points of the hanging band with the plane that it hangs in",
        "16 mm at most on sound recordings; warned from 20 mm",
        f"{100 * FOREIGN:g} % of a picture's points are off it",
        "",
        LOOK),
    Check("damaged",
        "pictures with those that can be decoded, and depth with colour within half a period",
        "none: they are counted",
        f"{100 * EMPTY:g} % cannot be, or have no partner",
        "none can be, or none has one",
        "see whether the camera's driver sends empty ones; record both at one rate, reliably"),
    Check("frames",
        "the force's frame with those of /tf_static; setup.base_to_fork and setup.camera_to_fork"
        " with /tf_static, around the loop; poses that are published twice",
        "the touched tips' and the calibration's",
        "the frame is not there and taken as the hand's, the loop does not close, or a frame has"
        " two places",
        "base, camera and fork are not joined",
        "publish each frame once; touch the tips or calibrate the camera again"
        " (docs/recording.md, Calibration)"),
    Check("extrinsics",
        "where the drawn band says that the fork tips and the hand are with where they are",
        "standard errors of the fit to all pictures of the drawn band",
        f"components of the tips' of more than {SHIFT_SURE:g} standard errors add up to"
        f" {1e3 * MATTERS:g} mm; the hand's are {1e3 * HAND_OFF:g} mm and {SURE:g} standard errors;"
        " or too few pictures to tell",
        "",
        "calibrate the camera again: its pose, and its depth's scale"),
    Check("pull",
        "what was recorded with a pull: a lead-in, a grasp, a draw, a release, pictures of a band",
        "each step's own",
        "",
        "one of them is not there or cannot be determined",
        "as the reason says (docs/faq.md)"),
)
# fmt: on
CHECKS = {check.name: check for check in TABLE}


def found(name: str, what: str, cure: str = "", refused: bool = False) -> Finding:
    """What a check of the table found; the cure is its remedy where no other one is given."""
    return Finding(name, what, cure or CHECKS[name].remedy, refused)


def of_topics(part: Part) -> Iterator[Finding]:
    """What the streams of a pull tell by themselves: losses, rates, clocks, frames."""
    recording = part.recording
    if recording.losses:
        count = len(recording.losses)
        many = f"{count} things were lost or mended, first of all"
        yield found("losses", f"{many if count > 1 else 'lost or mended'}: {recording.losses[0]}")
    if not recording.gripper:
        yield found("gripper", "the gripper was not recorded, so the grasp is read from the lift")
    roles: dict[str, list[str]] = {}
    for role, stream in recording.streams.items():
        roles.setdefault(stream.topic, []).append(role)
    for _, played in sorted(roles.items()):
        stream = recording.streams[played[-1]]
        yield from _of_rates(stream, played)
        yield from _of_clock(stream, played, recording.wrench.receipt_delay)
    yield from _of_frames(recording.wrench.frame, part.geometry, recording.transforms)


def of_signals(
    pull: Pull,
    delays: Delays,
    signals: Signals,
    scene: Scene,
    band: BandParams,
    params: Settings,
    weighed: bool,
) -> Iterator[Finding]:
    """What force, hand and their clocks tell."""
    start = (signals.origin - pull.recording.origin) * 1e-9
    yield from _of_delays(delays)
    yield from _of_force(pull, signals, start, params.setup.max_force)
    yield from _of_hold(hold_of(signals, scene, band, weighed), weighed)
    still, change = pause(signals)
    if still < PAUSE or change > SETTLED:
        what = f"the hand rests for {still:.1f} s before the release"
        if change > SETTLED:
            what += f", and in its last half second the force changes by {100 * change:.1f} %"
        yield found("pause", what)
    since = start - pull.force_time[0] + SETTLE
    if pull.number > 1 and since < CALM:
        what = f"the pictures begin {since:.1f} s after the pull before, the band may still swing"
        yield found("pause", what, f"wait for {CALM - since:.1f} s longer between two pulls")


def of_pictures(
    scene: Scene,
    clouds: Clouds,
    rows: Sequence[PictureLine],
    taut: tuple[float | None, float | None],
) -> Iterator[Finding]:
    """What the pictures show of the band.

    Args:
        rows: A row a picture.
        taut: As `clouds.taut_coverage` has it.
    """
    if taut[0] is None:
        what = f"no picture shows the band drawn taut at a rest length of {scene.rest_length:g} m"
        yield found("coverage", what, "check the rest length, or record a longer pull", True)
        return
    phases = by_phase(rows)
    for row in phases:
        if row["coverage"] < COVERAGE.get(row["phase"], 0.0):
            what = f"{100 * row['coverage']:.0f} % of the band is covered while it"
            times = f"({row['start']:.2f} - {row['end']:.2f} s)"
            yield found("coverage", f"{what} {SEEN_AS[row['phase']]} {times}")
    for phase in SEEN_AS.keys() - {row["phase"] for row in phases}:
        cure = "record the camera from before the grasp until the band has swung"
        yield found("coverage", f"no picture shows how the band {SEEN_AS[phase]}", cure)
    measured = [(row.time, row.off_plane) for row in rows if row.off_plane is not None]
    foreign = [time for time, off_plane in measured if off_plane > FOREIGN]
    if foreign:
        times = f"{foreign[0]:.2f} - {foreign[-1]:.2f} s"
        yield found(
            "off_plane",
            f"{len(foreign)} of {len(measured)} pictures of the hanging band hold points off the"
            f" plane that it hangs in ({times}): the hand, the arm or the background",
        )
    colors, frames = clouds.damaged_colors, len(clouds.points)
    for name, count, what in (
        ("coverage", clouds.empty, f"of {frames} pictures show no band"),
        ("damaged", clouds.damaged - colors, "depth pictures cannot be decoded"),
        ("damaged", colors, "colour pictures cannot be decoded"),
        ("damaged", clouds.unpaired, "depth pictures have no colour picture"),
    ):
        if count > EMPTY * frames:
            yield found(name, f"{count} {what}")


def of_calibration(seen: Calibration | None, geometry: Geometry) -> Iterator[Finding]:
    """Where the camera puts fork tips and hand."""
    if seen is None:
        what = "too few pictures of the drawn band to tell how far the fork tips are off"
        cure = "pull slowly, and further; where the band is seen, check the camera's depth and pose"
        yield found("extrinsics", what, cure)
        return
    if seen.is_off:
        off, error = seen.camera_off
        what = f"the camera shows the fork tips {1e3 * off:.1f} ± {1e3 * error:.1f} mm off"
        pose = ", ".join(f"{number:g}" for number in camera_to_fork(seen, geometry))
        move = f"or set setup.camera_to_fork: [{pose}] in params.yaml"
        yield found("extrinsics", what, f"{CHECKS['extrinsics'].remedy}; {move}")
    off, error = seen.hand_off
    if off > max(HAND_OFF, SURE * error):
        what = f"the band ends {1e3 * off:.1f} ± {1e3 * error:.1f} mm from the tool centre point"
        cure = "check base_to_fork, the tool centre point, and where the pads hold the band"
        yield found("extrinsics", what, cure)


def camera_to_fork(seen: Calibration, geometry: Geometry) -> list[float]:
    """Pose, in the form of setup, that would put the camera's clouds in their place."""
    moved = Transform(Transform.identity().rotation, -seen.camera)
    pose = (moved @ geometry.camera @ geometry.color.inverse()).inverse()
    return [round(float(number), 6) for number in pose.pose()]


def _of_rates(stream: Stream, roles: list[str]) -> Iterator[Finding]:
    most = min([GAPS[role] for role in roles if role in GAPS], default=np.inf)
    if stream.longest_gap > most:
        yield found("gap", f"{stream.topic} has a gap of {stream.longest_gap:.3f} s")
    elif stream.missing > MISSING * (len(stream.stamp) + stream.lost):
        yield found("gap", f"{stream.missing} messages of {stream.topic} are missing")
    rate = 1 / stream.period
    if stream.bursts:
        many, every = stream.bursts.count, stream.bursts.interval * 1e-6
        what = f"{stream.topic} is stamped in bursts of {many} every {every:.3g} ms"
        yield found("stamps", f"{what}, spread evenly to ± {stream.bursts.error * 1e-6:.2g} ms")
    if stream.hold:
        what = f"{stream.topic} repeats each value for {1e3 * stream.hold:.3g} ms"
        yield found("stamps", f"{what}: it has {rate:.0f} new values a second")
    if "wrench" in roles and rate < FORCE_RATE:
        what = f"the force comes at {rate:.0f} Hz, so the release is known only that coarsely"
        yield found("rate", what, "record it at 1 kHz")
    if "depth" in roles and rate < PICTURE_RATE:
        what = f"pictures come at {rate:.0f} Hz, so few of them show the recoil"
        yield found("rate", what, "record 30 a second or more")


def _of_clock(stream: Stream, roles: list[str], force: float) -> Iterator[Finding]:
    """By the times of receipt; `force` is the force's delay of receipt [s]."""
    most, offset = max(SLOW.get(role, BEHIND) for role in roles), force - stream.receipt_delay
    if not -most <= offset <= AHEAD:
        what = f"the stamps of {stream.topic} are {offset:+.3f} s off the force's, judged"
        yield found("clock", f"{what} by the times of receipt")
    change, error = stream.drift
    if abs(change) > max(DRIFTED, SURE * error):
        what = f"the clock of {stream.topic} drifts or steps by {1e3 * change:+.1f} ±"
        what += f" {1e3 * error:.1f} ms against the force's, judged by the times of receipt"
        refused = abs(change) > max(UNKNOWN_CLOCK, SURE * error)
        yield found("clock", what, refused=refused)


def _of_frames(frame: str, geometry: Geometry, transforms) -> Iterator[Finding]:
    if frame not in transforms.frames and not geometry.sensor_is_fixed:
        what = f"/tf_static does not know the force's frame {frame!r}, so it is taken as the hand's"
        cure = "publish how the sensor is turned relative to the tool centre point"
        yield found("frames", what, cure)
    for name in sorted(transforms.doubled):
        what = f"/tf_static puts {name!r} at two places, of which the last counts"
        cure = "publish it once, or set setup.camera_to_fork or base_to_fork in params.yaml"
        yield found("frames", what, cure)
    if geometry.contradiction:
        given = [
            f"setup.{name}"
            for name in ("base_to_fork", "camera_to_fork")
            if geometry.sources[name].startswith("setup")
        ]
        cure = f"{' or '.join(given)} contradicts /tf_static: {CHECKS['frames'].remedy}"
        yield found("frames", geometry.contradiction, cure)


def _of_delays(delays: Delays) -> Iterator[Finding]:
    """Of pose and camera, beside what was given of them, and what the release's pictures show."""
    if delays.pose.alone:
        value = delays.pose.value
        what = delays.conflict or (
            f"the hand starts back {1e3 * value:+.1f} ms from when the force falls: the stamps of"
            " the pose are late or early by that, or the robot moves by itself"
        )
        cure = f"set episode.delays.pose in params.yaml: {value:.4f}, or 0 for its own motion"
        yield found("delay", what, cure, refused=True)
        return
    for role, delay in (("pose", delays.pose), ("camera", delays.camera)):
        error, late = delay.error or 0.0, delay.value - (delay.given or 0.0)
        if abs(late) <= max(SMALL, SURE * error):
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
        yield found("delay", what, cure)
    left = delays.pose.left or 0.0
    if left > OPEN:
        what = (
            f"the pose's clock against the force's is not known better than ± {1e3 * left:.1f} ms"
        )
        yield found("delay", f"{what}, and each ms is 0.4 % of the modulus")
    if delays.conflict:
        yield found("delay", delays.conflict, ONE_CLOCK)
    if delays.release is not None:
        yield from of_release(delays.release)


def of_release(seen: ReleasePictures) -> Iterator[Finding]:
    """Of the pictures around the release, with the camera's stamps as they were."""
    if seen.frozen:
        first, count = seen.frozen[0], len(seen.frozen)
        what = f"{count} pictures from {1e3 * first:+.0f} ms of the release on are old ones again"
        cure = "see whether the driver or the recorder sends old pictures again, and record again"
        yield found("release_pictures", what, cure, refused=True)
    elif seen.never:
        what = f"pictures show the band drawn until {seen.drawn:.2f} s after the force falls"
        cure = "set episode.delays.camera, or record again with one clock"
        yield found("release_pictures", what, cure, refused=True)
    elif seen.again:
        what = (
            f"the band is drawn once more {1e3 * seen.again[0]:.0f} ms after the release, when it"
            f" was gone at {1e3 * seen.gone:.0f} ms"
        )
        yield found("release_pictures", what, "record again: pictures are old or in disorder")
    elif seen.beyond > 0:
        what = (
            f"a picture of {1e3 * seen.drawn:+.0f} ms after the force falls shows the band drawn,"
            f" that of {1e3 * seen.gone:+.0f} ms shows it let go, so the camera's stamps are"
            f" {1e3 * seen.earliest:+.0f} to {1e3 * seen.latest:+.0f} ms late"
        )
        yield found("release_pictures", what)


def _of_force(pull: Pull, signals: Signals, start: float, most: float) -> Iterator[Finding]:
    facts, top = signals.facts, flat_top(pull)
    hold = float(np.linalg.norm(facts.hold_force))
    if top:
        times = f"{top.begin:.2f} - {top.end:.2f} s"
        axis = "xyz"[top.axis]
        what = f"the force stops at {top.value:.1f} N along {axis} of the sensor ({times}),"
        what += " without noise: its range ends there, or it froze"
        yield found("range", what, refused=True)
    if facts.filtered:
        what = f"the force takes {1e3 * facts.release_spread:.1f} ms to fall from 9 to 3 tenths:"
        what += " it is filtered, and comes about as late"
        yield found("filter", what, refused=facts.release_spread > LATE)
    drifted = float(np.linalg.norm(facts.drift)) * (signals.release_time - signals.grasp_time)
    if drifted > DRIFT * hold:
        cure = "let the sensor warm up for half an hour (a steady drift is taken out)"
        yield found("zero", f"the force drifts by {drifted:.2f} N from grasp to release", cure)
    change = 0.0 if facts.zero_change is None else float(np.linalg.norm(facts.zero_change))
    unsure = ZERO_SURE * facts.zero_error
    if not facts.zero_steady and change > ZERO_OFF * hold:
        what = f"the force's zero is {change:.2f} N off after the release, and the free hand"
        what += " shows no steady drift to there: the held force is unsure by up to"
        what += f" {100 * change / hold:.0f} %"
        yield found("zero", what, refused=change > ZERO_FAR * hold)
    elif unsure > ZERO_UNSURE * hold:
        what = f"the free hand's force is known to {unsure:.2f} N only, which is"
        what += f" {100 * unsure / hold:.0f} % of the hold"
        yield found("zero", what, refused=unsure > ZERO_FAR * hold)
    if facts.peak_force > most:
        what = f"the peak force of {facts.peak_force:.1f} N is above setup.max_force {most:g} N"
        yield found("max_force", what)
    if facts.release_error > RELEASE:
        what = f"the release is known to ± {1e3 * facts.release_error:.1f} ms"
        yield found("release", what)
    for time in facts.slips:
        what = f"the force drops suddenly at {start + time:.2f} s, before the release"
        cure = "the band slipped in the pads, or the sensor was zeroed: record again"
        yield found("release", what, cure)


def _of_hold(hold: Hold, weighed: bool) -> Iterator[Finding]:
    """Whether the held force is one that a drawn band makes."""
    modulus = hold.modulus
    # One that feels no weight at all tells of a sensor that estimates, not of units.
    weight = hold.weight if hold.weight and hold.weight > SURE * hold.weight_error else None
    light = weight is not None and weight + SURE * hold.weight_error < LIGHT
    if light or not RUBBERS[0] < modulus < RUBBERS[1]:
        shown = f"{modulus / 1e6:.3g} MPa" if modulus >= 1e5 else f"{modulus / 1e3:.3g} kPa"
        what = f"a band that holds {hold.size:.3g} N here would be of {shown}"
        what += f" and weigh {weight:.2g} times its mass on the hand" if weight else ""
        yield found("units", what, refused=not NO_RUBBER[0] < modulus < NO_RUBBER[1])
    if not weighed:  # its weight turns the force by degrees
        return
    ways = ("lifts", "presses down"), ("pulls to the right", "pulls to the left")
    directions = "out of its plane", "off the middle of its strands"
    for k, force in enumerate((hold.lift, hold.aside)):
        angle, error = float(abs(hold.angles[k])), float(hold.errors[k])
        if angle > SURE * error:
            what = f"the band {ways[k][int(force < 0)]} the hand by {abs(force):.1f} N,"
            what += f" {np.degrees(angle):.1f} ± {np.degrees(error):.1f} degrees {directions[k]}"
            yield found("direction", what, refused=angle > SURE * error + ASTRAY)


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
