"""The best topic for a role beside those that were chosen already: a set, of one device."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import replace
from functools import cached_property
from os.path import commonprefix

from pipeline.recording.input import sets
from pipeline.recording.input.roles import Candidate, Choice

DEVICE = ("wrench", "pose", "twist", "gripper")  # of one arm
LEAST_FOLLOWS = 0.1  # share of the force's steps below which they show no hand
MOST_TOPICS = 60  # for a role, whose names are compared


class Company:
    """What is known of all candidates together.

    Args:
        fitting: The candidates for a role.
        frames: Those that /tf_static knows.
    """

    def __init__(self, fitting: Callable[[str], list[Candidate]], frames: Collection[str]) -> None:
        self.fitting, self.frames = fitting, frames
        self.tracks: dict[str, sets.Track | None] = {}

    def best(
        self, role: str, candidates: list[Candidate], chosen: dict[str, Choice]
    ) -> tuple[Candidate | None, str]:
        """The candidate, and in words what speaks against it; None where nothing fits `chosen`."""
        if role not in DEVICE:
            return self._camera(role, candidates, chosen)
        if not candidates:
            return None, ""
        meant = [topic for topic in candidates if not any(self._strangers(topic, chosen))]
        if not meant:
            other, of = next(self._strangers(candidates[0], chosen))
            what = f"{candidates[0].topic} is of another device than the {other}'s topic {of}"
            return None, what
        if len(meant) > 1:
            meant = _some(self._alive, meant)
        meant = _some(lambda topic: not topic.commanded, meant)
        if role == "wrench" and len(meant) > 1:
            meant = _some(self._falls, meant)
        elif role == "pose" and len(meant) > 1:
            meant = self._followed(meant, chosen["wrench"])
        elif role == "gripper" and len(meant) > 1:
            meant = _some(lambda topic: self._opens(topic, chosen["wrench"]), meant)
        best = max(meant, key=Candidate.merit)
        return best, self._tie(best, chosen) if role == "pose" else ""

    def opened(self, gripper: Choice, wrench: Choice) -> Choice:
        """The gripper's topic as one opening: that of the fingers whose release the force shows."""

        def fall() -> int | None:
            track = sets.track_of(wrench.channel, wrench.read)
            k = track and sets.fall_of(track)
            return int(track.stamp[k]) or None if track and k else None

        return replace(
            gripper, convert=lambda stamps, values: sets.opening_of(values, stamps, fall)
        )

    # Names

    @cached_property
    def sides(self) -> list[set[str]]:
        topics = [
            (candidate.topic, candidate.kind)
            for role in DEVICE
            for candidate in self.fitting(role)[:MOST_TOPICS]
        ]
        return sets.sides_of(dict.fromkeys(topics))

    def _strangers(
        self, candidate: Candidate, chosen: dict[str, Choice]
    ) -> Iterator[tuple[str, str]]:
        """Roles and topics that were chosen of another device."""
        mine = candidate.topic, candidate.typical.frame
        for role, other in chosen.items():
            topic = other.channel.topic
            if sets.apart(mine, (topic, other.typical().frame), self.sides):
                yield role, topic

    # What they say

    def _track(self, candidate: Candidate | Choice) -> sets.Track | None:
        choice = candidate.choice if isinstance(candidate, Candidate) else candidate
        topic = choice.channel.topic
        if topic not in self.tracks:
            self.tracks[topic] = sets.track_of(choice.channel, choice.read)
        return self.tracks[topic]

    def _alive(self, candidate: Candidate) -> bool:
        return sets.alive(candidate.choice.channel, candidate.choice.read)

    def _falls(self, candidate: Candidate) -> bool:
        track = self._track(candidate)
        return track is not None and sets.fall_of(track) is not None

    def _followed(self, hands: list[Candidate], wrench: Choice) -> list[Candidate]:
        """Select the hands whose steps the force follows about as well as any's."""
        force = self._track(wrench)
        if force is None:
            return hands
        shares = {}  # of hands whose poses were recorded: others are not compared
        for hand in hands:
            choice = hand.choice
            track = None if choice.convert else sets.track_of(choice.channel, choice.read)
            if track:
                shares[id(hand)] = sets.follows(force, track)
        most = max(shares.values(), default=0.0)
        if most < LEAST_FOLLOWS:
            return hands
        return [hand for hand in hands if shares.get(id(hand), most) >= sets.FOLLOWS * most]

    def _opens(self, candidate: Candidate, wrench: Choice) -> bool:
        """Whether its fingers move when the force falls."""
        force, fingers = self._track(wrench), self._track(candidate)
        if force is None or fingers is None:
            return False
        k = sets.fall_of(force)
        return k is not None and sets.moves_at(fingers, float(force.time[k]))

    def _tie(self, pose: Candidate, chosen: dict[str, Choice]) -> str:
        """Describe another force and hand that would do as well; "" where there is none."""
        wrench = chosen["wrench"]
        mine = (wrench.channel.topic, pose.topic, pose.typical.frame, wrench.typical().frame)
        for force in self.fitting("wrench"):
            its = force.topic, force.typical.frame
            if not sets.apart(its, mine, self.sides) or force.commanded or not self._falls(force):
                continue
            for hand in self.fitting("pose"):
                names = hand.topic, hand.typical.frame
                if not sets.apart(names, mine, self.sides) or not self._alive(hand):
                    continue
                if not sets.apart(names, its, self.sides):
                    return f"{force.topic} with {hand.topic} shows a release too"
        return ""

    # Cameras

    def _camera(
        self, role: str, candidates: list[Candidate], chosen: dict[str, Choice]
    ) -> tuple[Candidate | None, str]:
        if len(candidates) < 2:
            return (candidates[0] if candidates else None), ""
        live = _some(self._alive, candidates)
        placed = _some(lambda topic: topic.typical.frame in self.frames, live)
        if role == "depth":
            color = chosen["color"]
            topic, frame = color.channel.topic, color.typical().frame
            near = {id(candidate): self._near(candidate, topic, frame) for candidate in placed}
            most = max(near.values())
            return max((o for o in placed if near[id(o)] == most), key=Candidate.merit), ""
        depths = self.fitting("depth")
        paired = [topic for topic in placed if self._partner(topic, depths)]
        best = max(paired or placed, key=Candidate.merit)
        return best, self._other_camera(best, paired, depths)

    def _near(self, depth: Candidate, topic: str, frame: str) -> int:
        """How many folders a depth's topic shares with a colour's; all where they share a frame."""
        return 99 if frame and depth.typical.frame == frame else _shared(depth.topic, topic)

    def _partner(self, color: Candidate, depths: list[Candidate]) -> bool:
        nearest = [self._near(d, color.topic, color.typical.frame) for d in depths]
        return max(nearest, default=0) > 0 or all(len(_folders(d.topic)) < 2 for d in depths)

    def _other_camera(self, best: Candidate, colors: list[Candidate], depths: list[Candidate]):
        """Describe another camera, with its own colour and depth, that would do as well; or ""."""
        for color in colors:
            if len(color.doubts) > len(best.doubts) or color.topic == best.topic:
                continue
            for depth in depths:
                near = self._near(depth, color.topic, color.typical.frame)
                nearer = near > self._near(depth, best.topic, best.typical.frame)
                if nearer and self._alive(depth):
                    return f"{color.topic} with {depth.topic} is a camera too"
        return ""


def _some(suits: Callable[[Candidate], bool], candidates: list[Candidate]) -> list[Candidate]:
    """The candidates that suit, or all where none does."""
    return [candidate for candidate in candidates if suits(candidate)] or candidates


def _folders(topic: str) -> list[str]:
    return topic.strip("/").split("/")[:-1]


def _shared(topic: str, other: str) -> int:
    """How many folders two topics have in common from the first on."""
    return len(commonprefix([_folders(topic), _folders(other)]))
