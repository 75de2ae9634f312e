"""Topics to streams on header stamps: read, sorted, on one clock, and what was lost said.

A message has two times: its header's stamp, when it was measured, and log_time, when the recorder
received it, which is later by a delay that jitters and at times piles up. Everything comes sorted
by its stamp; log_time is good to some 10 ms and only shows what is wrong with a stamp's clock. What
it shows is refused or said, with the setting that mends it, and not mended by guesses: delays that
the recording itself shows are taken out later (`delays`).

A message is lost where it cannot be read, is not finite or absurdly large, has no stamp or one far
from its neighbours', names another frame than the rest, has the stamp of another, or, of force and
pose, is alone far off those around it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Generic, TypeVar

import numpy as np
from scipy.ndimage import median_filter

from sling2sim2real.base.errors import UserError, printable
from sling2sim2real.recording import images, pace
from sling2sim2real.recording.camera import Camera
from sling2sim2real.recording.files import Container, read_container, sha256
from sling2sim2real.recording.messages import Picture, Unreadable
from sling2sim2real.recording.topics import (
    CAMERAS,
    OPTIONAL,
    Choice,
    camera_of,
    choose,
    transforms_of,
)
from sling2sim2real.recording.transforms import TransformTree
from sling2sim2real.recording.words import shortened
from sling2sim2real.settings.lab import SetupParams
from sling2sim2real.settings.recording import DelayParams

STREAMS = ("wrench", "pose", "gripper", *CAMERAS)
DELAYED = {"pose": ["pose"], "camera": CAMERAS}  # roles of each of episode.delays
ABSURD = 1e6  # N, m, m/s, rad: nothing here is as large
# What a lone message may be off the four around it: a knock or a fall lasts for more than one.
LONE = {"wrench": 30.0, "pose": 0.05}  # N, m
MOST_LONE = 0.05  # share of the messages that may be alone: more are the sensor's noise, or units
FASTEST = 2.0  # m/s of the hand
SHOWN = 3  # losses named in an error
REASON, LOSS, LINE = 100, 300, 1000  # characters: why a message is damaged, a loss, an error
# Clocks
FAR = 1.0  # s from a stamp to those around it: it is damage
WINDOW = 9  # messages around one
SET_BACK = 0.01  # s by which both times of a message go back where a clock was set
LEAST = 5  # percentile of the delays of receipt: some log_times may be damage
TOLERANCE = 0.5  # s between the clocks of two topics: transport and drivers take less
PARTS = 5  # of the recording, in which the least delays of receipt of each second are compared

Values = TypeVar("Values", bound=Any)


@dataclass(frozen=True)
class Stream(Generic[Values]):
    """One topic, sorted by stamp.

    Attributes:
        topic: Its name.
        frame: frame_id of its messages.
        stamp: header.stamp, ns, shape (S,), strictly increasing.
        values: One column a quantity, shape (S, C), or an array of `Picture`s, shape (S,).
        receipt_delay: Median of log_time - stamp [s].
        lost: Messages that are not in it, for whatever reason.
        notes: What was lost or mended, in words.
        bursts: In which the stamps came; None where they were even.
        hold: For how long each value was repeated [s], 0 where it was not: repeats are left out.
        drift: How far its clock's lead on the wrench's moves, by the times of receipt, and the
            standard error [s].
    """

    topic: str
    frame: str
    stamp: np.ndarray
    values: Values
    receipt_delay: float
    lost: int
    notes: list[str] = field(default_factory=list)
    bursts: pace.Bursts | None = None
    hold: float = 0.0
    drift: tuple[float, float] = (0.0, np.inf)

    def seconds(self, origin: int) -> np.ndarray:
        return (self.stamp - origin) * 1e-9

    @property
    def period(self) -> float:
        """Usual time between messages [s]: the median, or where that is none, the mean."""
        return pace.period_of(np.diff(self.stamp)) * 1e-9

    @property
    def longest_gap(self) -> float:
        return float(np.max(np.diff(self.stamp))) * 1e-9

    @property
    def missing(self) -> int:
        """Messages that a constant rate would have had in the gaps."""
        gaps = np.diff(self.stamp) * 1e-9 / self.period
        return int(np.sum(np.maximum(np.round(gaps) - 1, 0)))

    def between(self, first: int, last: int) -> Stream[Values]:
        """Messages stamped from `first` to `last` [ns]; the nearest two where there are fewer."""
        begin = min(int(np.searchsorted(self.stamp, first)), len(self.stamp) - 2)
        end = max(int(np.searchsorted(self.stamp, last, side="right")), begin + 2)
        return replace(self, stamp=self.stamp[begin:end], values=self.values[begin:end])

    def shifted(self, seconds: float) -> Stream[Values]:
        """Copy with `seconds` subtracted from every stamp."""
        return replace(self, stamp=self.stamp - round(seconds * 1e9)) if seconds else self


@dataclass(frozen=True)
class Recording:
    """What was read of one file, or the part of it that one of its pulls takes.

    Attributes:
        wrench: Force [N] in `wrench.frame`, values (S, 3).
        pose: Position [m] and quaternion xyzw in `pose.frame`, values (S, 7).
        gripper: Sum of the finger positions, as they are reported [m], values (S, 1); None where
            not recorded.
        color, depth: Their `Picture`s, decoded by `images`.
        color_camera, depth_camera: Their intrinsics.
        transforms: The static tree.
        losses: What was lost of the file or mended in it, in words.
        notes: What else to know of it, which cost nothing.
        choices: Why each role has its topic.
        sha256: Hash of the file.
        start: From which seconds count [ns]: the file's first force, also in a part of it; None
            for that of `wrench`.
        late: By what the stamps of a role were given to be late [s], and are not any more.
    """

    path: Path
    wrench: Stream[np.ndarray]
    pose: Stream[np.ndarray]
    gripper: Stream[np.ndarray] | None
    color: Stream[Sequence[Picture]]
    depth: Stream[Sequence[Picture]]
    color_camera: Camera
    depth_camera: Camera
    transforms: TransformTree
    losses: list[str] = field(default_factory=list)
    sha256: str = ""
    notes: list[str] = field(default_factory=list)
    choices: dict[str, str] = field(default_factory=dict)
    start: int | None = None
    late: dict[str, float] = field(default_factory=dict)

    @property
    def origin(self) -> int:
        """Stamp from which seconds count [ns]."""
        return int(self.wrench.stamp[0]) if self.start is None else self.start

    @property
    def streams(self) -> dict[str, Stream[Any]]:
        by_role = {role: getattr(self, role) for role in STREAMS}
        return {role: stream for role, stream in by_role.items() if stream}

    def depth_picture(self, number: int) -> np.ndarray | None:
        """Depth [m], 0 where unknown, of the camera's size (H, W); None where it is damaged."""
        try:
            depth = images.depth(self.depth.values[number])
        except images.Undecodable:
            return None
        return depth if depth.shape == (self.depth_camera.height, self.depth_camera.width) else None

    def part(self, begin: float, end: float) -> Recording:
        """What was recorded from `begin` to `end` [s]."""
        first, last = (self.origin + round(time * 1e9) for time in (begin, end))
        cut = {role: stream.between(first, last) for role, stream in self.streams.items()}
        return replace(self, **cut, start=self.origin)

    def shifted(self, pose: float = 0.0, camera: float = 0.0) -> Recording:
        """Copy with stamps that are late by so many seconds put right."""
        return replace(
            self,
            pose=self.pose.shifted(pose),
            color=self.color.shifted(camera),
            depth=self.depth.shifted(camera),
        )


def read_recording(path: Path, setup: SetupParams, delays: DelayParams | None = None) -> Recording:
    """Read and check a recording. Raises UserError with one line about what is missing or wrong.

    Args:
        delays: By what stamps are known to be late [s]: taken off before clocks are compared.
    """
    return recording_of(read_container(Path(path)), setup, delays)


def recording_of(
    container: Container, setup: SetupParams, delays: DelayParams | None = None
) -> Recording:
    """Do what `read_recording` does, from a file that was read already."""
    try:
        transforms = transforms_of(container)
        chosen = choose(container, setup, transforms)
        color_camera, depth_camera = (camera_of(chosen, role) for role in CAMERAS)
        by_role = {role: chosen[role] for role in STREAMS if role in chosen}
        late = late_by(delays)
        streams, remarks = streams_of(by_role, late)
    except UserError as error:
        raise explained(error, container.path, container.losses) from None
    lost = [f"{stream.topic}: {note}" for stream in streams.values() for note in stream.notes]
    return Recording(
        path=container.path,
        wrench=streams["wrench"],
        pose=streams["pose"],
        gripper=streams.get("gripper"),
        color=streams["color"],
        depth=streams["depth"],
        color_camera=color_camera,
        depth_camera=depth_camera,
        transforms=transforms,
        losses=[*container.losses, *lost],
        notes=[*container.notes, *remarks],
        choices={role: choice.why for role, choice in chosen.items()},
        sha256=sha256(container.path),
        late={role: seconds for role, seconds in late.items() if role in streams},
    )


def late_by(delays: DelayParams | None) -> dict[str, float]:
    """Seconds by which the stamps of each role are given to be late; none where nothing is."""
    given = {name: getattr(delays, name, None) for name in DELAYED}
    return {role: late for name, late in given.items() if late for role in DELAYED[name]}


def explained(error: UserError, path: Path, losses: list[str], pull: str = "") -> UserError:
    """The error with the file's name, the pull, and with what was lost, which may be its cause."""
    text = str(error).removeprefix(f"{path}: ")
    text = shortened(f"{pull}: {text}" if pull else text, LINE)
    text = text if str(path) in text else f"{path}: {text}"
    shown = [shortened(loss, LOSS) for loss in losses[:SHOWN]]
    shown += ["and more"] * (len(losses) > SHOWN)
    return UserError(printable(f"{text} ({'; '.join(shown)})" if losses else text))


def streams_of(
    chosen: dict[str, Choice], late: Mapping[str, float] | None = None
) -> tuple[dict[str, Stream[Any]], list[str]]:
    """All topics on the wrench's clock, and remarks on what costs nothing.

    Args:
        chosen: Choices of wrench, pose, color, depth, and of gripper if there is one.
        late: By what the stamps of a role are known to be late [s], which is taken off.

    Raises:
        UserError: for a topic that cannot be used, in one line.
    """
    late, remarks = late or {}, []
    made: dict[str, tuple[Stream[Any], np.ndarray]] = {}
    for role, choice in chosen.items():
        try:
            made[role] = _stream_of(role, choice, late.get(role, 0.0))
        except UserError as error:
            if role not in OPTIONAL:
                raise
            remarks.append(f"{error}: done without it")
    remarks += _expect_one_clock(made, late)
    return {
        role: stream
        if role == "wrench"
        else replace(stream, drift=drift_of(stream, log, *made["wrench"]))
        for role, (stream, log) in made.items()
    }, remarks


@dataclass
class _Raw:
    """Messages of a topic, of which some are dropped.

    Attributes:
        values: Shape (S, C), or of pictures (S,).
        lost: How many were dropped, by why.
    """

    topic: str
    stamp: np.ndarray
    log: np.ndarray
    values: np.ndarray
    lost: Counter[str]

    def keep(self, which: np.ndarray) -> None:
        """Only these: a mask or an order."""
        self.stamp, self.log, self.values = self.stamp[which], self.log[which], self.values[which]

    def drop(self, which: np.ndarray, why: str) -> None:
        """Not these. Raises UserError where fewer than two are left."""
        if which.any():
            self.lost[why] += int(which.sum())
            self.keep(~which)
        if len(self.stamp) < 2:
            lost = f" ({self.words()})" if self.lost else ""
            raise UserError(f"topic {self.topic} has fewer than two readable messages{lost}")

    def words(self) -> str:
        return ", ".join(f"{count} {why}" for why, count in sorted(self.lost.items()))


def _read(role: str, choice: Choice) -> tuple[_Raw, str]:
    """What can be read of a topic's messages, in the order of the file, and their frame."""
    lost, damage, rows = Counter(), "damaged", []
    for log, reading in choice.messages:
        if isinstance(reading, Unreadable):
            if damage == "damaged":
                damage += f" (the first: {shortened(printable(reading), REASON)})"
            lost[damage] += 1
        elif role not in CAMERAS and not all(abs(x) < ABSURD for x in reading.value):
            lost["not finite"] += 1
        else:
            rows.append((reading.stamp or 0, log, reading.frame, reading.value))
    stamps, logs, frames, values = zip(*rows, strict=True) if rows else ((), (), (), ())
    name, stamp = choice.topic.name, np.array(stamps, np.int64)
    if len(stamp) and not stamp.any():
        raise UserError(f"topic {name} has no header stamps, record with time stamps")
    log = np.array(logs, np.uint64).astype(np.int64)
    array = np.array(values, dtype=object if role in CAMERAS else float)
    raw = _Raw(name, stamp, log, array, lost)
    frame = Counter(frames).most_common(1)[0][0] if frames else ""
    raw.drop(np.array([other != frame for other in frames], bool), "in another frame")
    raw.drop(raw.stamp == 0, "without a stamp")
    return raw, frame


def _stream_of(role: str, choice: Choice, late: float) -> tuple[Stream[Any], np.ndarray]:
    """One topic, sorted, and its times of receipt [ns]. Raises UserError where it is of no use."""
    (raw, frame), even, hold = _read(role, choice), None, None
    _expect_forward(raw)
    raw.drop(_outliers(raw.stamp), "far off in time")
    if role not in CAMERAS:
        even = pace.without_bursts(raw.topic, raw.stamp, raw.log, raw.values)
    raw.stamp = (even[0] if even else raw.stamp) - round(late * 1e9)
    raw.keep(np.argsort(raw.stamp, kind="stable"))
    raw.drop(np.diff(raw.stamp, prepend=raw.stamp[0] - 1) == 0, "with the stamp of another")
    if role in LONE and choice.convert is None:
        raw.drop(_lone(raw, role), "far off those around")
    if choice.convert is not None:
        raw.values = choice.convert(raw.values)
    if role in LONE and (hold := pace.hold_of(raw.stamp, raw.values)):
        raw.keep(pace.first_of_each(raw.stamp, raw.values, hold))
    stream = Stream(
        topic=raw.topic,
        frame=frame,
        stamp=raw.stamp,
        values=raw.values,
        receipt_delay=float(np.median(raw.log - raw.stamp) * 1e-9),
        lost=sum(raw.lost.values()),
        notes=[f"lost {raw.words()}"] if raw.lost else [],
        bursts=even and even[1],
        hold=1e-9 * (hold or 0.0),
    )
    return stream, raw.log


def _expect_forward(raw: _Raw) -> None:
    """Raises UserError where both times go back."""
    ways = np.maximum(np.diff(raw.stamp), np.diff(raw.log))
    if ways.min() < -SET_BACK * 1e9:
        i = int(np.argmin(ways))
        raise UserError(
            f"{raw.topic}: its messages go back by {-ways[i] * 1e-9:.3f} s after"
            f" {(raw.stamp[i] - raw.stamp[0]) * 1e-9:.2f} s: record again without setting the"
            " machine's clock; if the file is only out of order, `mcap sort` it"
        )


def _outliers(stamp: np.ndarray) -> np.ndarray:
    """Which stamps [ns], in the order of arrival, are far from all around them; shape (S,).

    By a running median, as Hampel's filter, with a fixed limit; also the first two and last two.
    """
    if len(stamp) < WINDOW:
        return np.zeros(len(stamp), bool)
    middle = np.median(stamp.astype(float))
    usual = median_filter(stamp - middle, WINDOW, mode="mirror") + middle
    ways = np.diff(stamp)
    limit = max(FAR * 1e9, 10 * float(np.median(ways[ways > 0])) if (ways > 0).any() else 0.0)
    return np.abs(stamp - usual) > limit


def _lone(raw: _Raw, role: str) -> np.ndarray:
    """Single values of force or place far from those around them, shape (S,).

    By a running median of five, as Hampel's filter, with a fixed limit.
    """
    values, limit = raw.values[:, :3], LONE[role]
    if role == "pose":
        limit = max(limit, FASTEST * 1e-9 * float(np.median(np.diff(raw.stamp))))
    around = median_filter(values, (5, 1), mode="nearest")
    lone = np.abs(values - around).max(axis=1) > limit
    return lone if lone.mean() <= MOST_LONE else np.zeros(len(lone), bool)


def _expect_one_clock(
    made: dict[str, tuple[Stream[Any], np.ndarray]], late: Mapping[str, float]
) -> list[str]:
    """Leave out the optional topics that are on another clock; say which, in words.

    By the least delays of receipt. Raises UserError about the other topic that is furthest off.
    """
    least = {role: np.percentile(log - stream.stamp, LEAST) for role, (stream, log) in made.items()}
    ahead = {role: 1e-9 * (least["wrench"] - least[role]) for role in made}
    middle, remarks = float(np.median(list(ahead.values()))), []
    for role in {*OPTIONAL} & {*made}:
        if abs(ahead.pop(role) - middle) > TOLERANCE:
            stream, _ = made.pop(role)
            remarks.append(f"{stream.topic}: on another clock: done without it")
    if np.ptp(list(ahead.values())) <= TOLERANCE:
        return remarks
    worst = max(ahead, key=lambda role: abs(ahead[role] - middle))
    off = {name: late.get(roles[-1], 0.0) + ahead[roles[-1]] for name, roles in DELAYED.items()}
    given = [f"{name}: {by:.3f}" for name, by in off.items() if abs(by) > TOLERANCE / 2]
    cure = "record all topics with one clock"
    if given:
        cure += f"; or set episode.delays.{' and episode.delays.'.join(given)} in params.yaml, by"
        cure += " the times of receipt, which are good to some hundredths of a second alone"
    raise UserError(
        f"the stamps of {made[worst][0].topic} are {ahead[worst] - middle:+.3f} s off the other"
        f" topics' clock, {cure}"
    )


def drift_of(
    stream: Stream[Any], log: np.ndarray, wrench: Stream[Any], wrench_log: np.ndarray
) -> tuple[float, float]:
    """How far a clock's lead on the wrench's moves, drifting or by a step, and its error [s].

    Of parts of the recording the mean leads are compared: the least and the largest.

    Args:
        log, wrench_log: Times of receipt [ns], shapes (S,).
    """
    start = int(min(log.min(), wrench_log.min()))
    mine, others = (
        _least(log - start, log - stream.stamp),
        _least(wrench_log - start, wrench_log - wrench.stamp),
    )
    lead = np.array([others[second] - mine[second] for second in sorted({*mine} & {*others})])
    if len(lead) <= PARTS:
        return 0.0, np.inf
    means = np.array([part.mean() for part in np.array_split(1e-9 * lead, PARTS)])
    first, last = sorted([int(means.argmin()), int(means.argmax())])
    # Neither a drift nor a step changes the median deviation of first differences much.
    steps = np.diff(1e-9 * lead)
    scatter = 1.4826 * np.median(np.abs(steps - np.median(steps))) / np.sqrt(2)
    return float(means[last] - means[first]), float(scatter * np.sqrt(2 * PARTS / len(lead)))


def _least(log: np.ndarray, delay: np.ndarray) -> dict[int, int]:
    """Least delay of receipt in each second [ns]."""
    second = log // 10**9
    order = np.lexsort([delay, second])
    keys, first = np.unique(second[order], return_index=True)
    return dict(zip(keys.tolist(), delay[order][first].tolist(), strict=True))
