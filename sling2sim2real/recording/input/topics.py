"""Which topic plays which role: by params, else by type, rate, and words in the name.

Where two topics would do as well, params must say which is meant: what moves together, and which of
two arms pulled the band, is not guessed.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from os.path import commonprefix

import numpy as np

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.input import images
from sling2sim2real.recording.input import readings as of
from sling2sim2real.recording.input.camera import Camera, camera_from
from sling2sim2real.recording.input.container import Container
from sling2sim2real.recording.input.contents import Channel
from sling2sim2real.recording.input.decode import Unreadable, decoder, message_reader
from sling2sim2real.recording.input.roles import (
    CAMERAS,
    OPTIONAL,
    ROLES,
    TRIES,
    Candidate,
    Choice,
    readable,
    source_of,
)
from sling2sim2real.recording.input.words import few
from sling2sim2real.settings.lab import SetupParams

SHOWN = 12  # topics named in a message
COLOUR = {"color": "colour", "depth": "depth"}
VIDEO = ("FFMPEGPacket", "CompressedVideo")


def choose(container: Container, setup: SetupParams) -> dict[str, Choice]:
    """Role to channel, for every role of ROLES that the file has.

    Args:
        container: What was read.
        setup: params.setup: topics (a topic's name for a role, or None), urdf, tip_link.

    Raises:
        UserError: for a role that nothing can play, with what the file has and how to mend it; or
            for those that several topics could play, with the settings that decide.
    """
    chooser = _Chooser(container, setup)
    chosen: dict[str, Choice] = {}
    for role in ROLES:
        choice = chooser.choice(role, chosen)
        if choice is not None:
            chosen[role] = choice
        elif role not in OPTIONAL:
            raise chooser.lacking(role)
    if chooser.ambiguous:
        raise UserError(
            f"several topics would do: {'; '.join(chooser.ambiguous)}: name those that are meant in"
            " params.yaml"
        )
    return chosen


def camera_of(chosen: dict[str, Choice], role: str) -> Camera:
    """The camera of the images of `role`, color or depth. Raises UserError."""
    info, image = chosen[f"{role}_info"], chosen[role]
    calibration, topic = info.typical().value, image.channel.topic
    return camera_from(info.channel.topic, calibration, topic, _size(image))


class _Chooser:
    """Goes through the channels of one file, role by role."""

    def __init__(self, container: Container, setup: SetupParams) -> None:
        self.container, self.setup = container, setup
        self.problems: list[str] = []  # why channels of the right type could not be used
        self.ambiguous: list[str] = []  # settings of roles that several topics could play

    def choice(self, role: str, chosen: dict[str, Choice]) -> Choice | None:
        self.problems = []
        name = getattr(self.setup.topics, role)
        if name is not None:
            return self._named(role, name)
        fitting = [self._candidate(role, channel) for channel in self.container.channels]
        candidates = [topic for topic in fitting if topic is not None and self._suits(role, topic)]
        if role.endswith("_info"):
            return self._info(candidates, role.removesuffix("_info"), chosen)
        if not candidates:
            return None
        if role == "depth":
            candidates = _nearest(candidates, chosen["color"])
        best = max(candidates, key=Candidate.merit)
        alike = {_source(c.topic) for c in candidates if c.standing() == best.standing()}
        if len(alike) > 1:
            self.ambiguous.append(f"setup.topics.{role} {few(sorted(alike), SHOWN)}")
        return replace(best.choice, why=_why(best, candidates))

    def lacking(self, role: str) -> UserError:
        what = ROLES[role].what
        if role in CAMERAS:
            self.problems += [
                f"{c.topic} is video ({of.kind_of(_type(c))}): record images"
                for c in self.container.channels
                if of.kind_of(_type(c)) in VIDEO
            ]
        if self.problems:
            return UserError(f"no {what}; {'; or '.join(self.problems[:2])}")
        if not self.container.channels:
            return UserError(f"no {what}; the file has no messages at all: record it again")
        has = sorted({f"{c.topic} ({of.kind_of(_type(c))})" for c in self.container.channels})
        return UserError(
            f"no {what}; the file has {few(has, SHOWN)}: record it, or name its topic in"
            f" setup.topics.{role}"
        )

    def _named(self, role: str, name: str) -> Choice:
        channels = [c for c in self.container.channels if c.topic == name]
        where = f"setup.topics.{role}"
        if not channels:
            has = ", ".join(sorted({c.topic for c in self.container.channels})[:SHOWN])
            raise UserError(f"{where}: no topic {name}, the file has {has or 'none'}")
        readers = ROLES[role].readers
        fitting = [c for c in channels if of.kind_of(c.schema.name) in readers]
        if not fitting:
            types = " or ".join(readers)
            raise UserError(f"{where}: {name} is a {_type(channels[0])}, not {types}")
        candidate = self._candidate(role, max(fitting, key=lambda c: len(c.payloads)), named=True)
        if candidate is None:
            problem = (self.problems or [f"{name} has no messages, or fingers only"])[0]
            raise UserError(f"{where}: {problem}")
        if role in CAMERAS and (problem := undecodable(role, candidate.choice)):
            raise UserError(f"{where}: {name}: {problem}")
        return replace(candidate.choice, why=f"setup.topics.{role}")

    def _candidate(self, role: str, channel: Channel, named: bool = False) -> Candidate | None:
        """None, with a word in `problems`, for a channel of the right type that is of no use."""
        if of.kind_of(channel.schema.name) not in ROLES[role].readers or not channel.payloads:
            return None
        try:
            decode = decoder(channel)
            source = source_of(role, channel, decode, self.setup, named)
            if source is None:
                return None
            read, convert = source
            choice = Choice(channel, message_reader(decode, read), "", convert)
            return Candidate(ROLES[role], choice, choice.typical())
        except UserError as error:
            self.problems.append(str(error))
            return None

    def _suits(self, role: str, candidate: Candidate) -> bool:
        """Pictures: whether they are colour or depth, and of a kind that can be decoded."""
        if role not in CAMERAS:
            return True
        picture, named = candidate.typical.value, "depth" in candidate.topic.lower()
        deep = images.is_depth(picture) or (picture.encoding == "mono16" and named)
        if deep != (role == "depth"):
            if named and role == "depth" and picture.encoding:
                what = f"encoding {picture.encoding!r} is no depth, {images.USE}"
                self.problems.append(f"{candidate.topic}: {what}")
            return False
        problem = undecodable(role, candidate.choice)
        if problem:
            self.problems.append(f"{candidate.topic}: {problem}")
        return problem is None

    def _info(
        self, candidates: Sequence[Candidate], role: str, chosen: dict[str, Choice]
    ) -> Choice | None:
        """A camera info belongs to the images in whose folder it is, or with their frame and size.

        Depth may take the colour camera's where it is registered to colour: in its frame and size.
        """
        image, color = chosen[role], chosen["color"]
        topic, frame, size = image.channel.topic, image.typical().frame, _size(image)
        ranked = []
        for candidate in candidates:
            camera = candidate.typical.value.camera
            beside = _beside(candidate.topic, topic)
            of_color = _beside(candidate.topic, color.channel.topic)
            beside_it = beside and (role == "color" or not of_color)
            info_frame = camera.frame or (color.typical().frame if of_color else "")
            fits = size is None or size == (camera.width, camera.height)
            if beside_it or (info_frame == frame and (fits or beside)):
                why = f"beside {topic}" if beside else f"of the frame and size of {topic}"
                count = len(candidate.choice.channel.payloads)
                merit = beside_it, info_frame == frame, fits, beside, count
                ranked.append((merit, [-ord(c) for c in candidate.topic], why, candidate.choice))
            else:
                pixels = f", {size[0]} x {size[1]}" if size else ""
                self.problems.append(
                    f"{candidate.topic} is of frame {info_frame!r}, {camera.width} x"
                    f" {camera.height} pixels, {topic} of {frame!r}{pixels}: record the camera info"
                    f" of those images, or name it in setup.topics.{role}_info"
                )
        if not ranked:
            return None
        *_, why, choice = max(ranked, key=lambda entry: entry[:2])
        return replace(choice, why=why)


def _type(channel: Channel) -> str:
    return channel.schema.name or f"{channel.encoding} topic without a schema"


def _size(image: Choice) -> tuple[int, int] | None:
    """Width and height that most of the first pictures tell."""
    sizes, _ = readable(
        lambda payload: images.size_of(image.read(payload).value), image.channel.payloads
    )
    counted = Counter(size for size in sizes if size is not None)
    return counted.most_common(1)[0][0] if counted else None


def undecodable(role: str, choice: Choice) -> str | None:
    """Why none of some pictures of a topic can be decoded; None where one can."""
    payloads, reasons = choice.channel.payloads, Counter()
    for k in np.unique(np.linspace(0, len(payloads) - 1, min(TRIES, len(payloads))).astype(int)):
        try:
            getattr(images, role)(choice.read(payloads[k]).value)
        except images.Unsupported as error:
            reasons[str(error)] += 1
        except (images.Undecodable, Unreadable) as error:
            reasons[f"its {COLOUR[role]} pictures cannot be decoded: {error}"] += 1
        else:
            return None
    return reasons.most_common(1)[0][0]


def _source(topic: str) -> str:
    """A topic's name without that of the transport, by which one picture is sent several times."""
    return topic.removesuffix("/compressed").removesuffix("/compressedDepth")


def _nearest(depths: list[Candidate], color: Choice) -> list[Candidate]:
    """Those in the colour's frame, or else those that share the most folders with its topic."""
    frame, topic = color.typical().frame, color.channel.topic

    def near(depth: Candidate) -> tuple[bool, int]:
        folders = (name.split("/")[:-1] for name in (depth.topic, topic))
        return bool(frame) and depth.typical.frame == frame, len(commonprefix([*folders]))

    most = max(map(near, depths))
    return [depth for depth in depths if near(depth) == most]


def _beside(info: str, image: str) -> bool:
    """Whether the two are in one folder, the name of the image's transport left out."""
    folder, parts = info.split("/")[:-1], image.split("/")
    return any(folder) and folder in (parts[:-1], parts[:-2])


def _why(best: Candidate, candidates: list[Candidate]) -> str:
    if len(candidates) == 1:
        return f"the only {best.kind} for {best.role.what.partition(' (')[0]}"
    named = f"named {' '.join(best.hints)}, " if best.hints else ""
    others = sorted({candidate.topic for candidate in candidates} - {best.topic})[:2]
    rest = f"; not {', '.join(others)}" if others else ""
    return f"of {len(candidates)} topics: {named}{best.rate:.0f} Hz{rest}"
