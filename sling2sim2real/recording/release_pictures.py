"""The camera's delay against the force, by the pictures of the release: within a picture or so.

The outer fifth of the drawn band is empty within some milliseconds after the force falls. The last
picture that shows it there was taken before, the next one after that.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sling2sim2real.recording.events import Pull

AROUND = 0.4  # s before and after the release
THERE = 0.01  # m: while the hand is further from where it lets go, it dips or draws
HELD = 12  # pictures before that, of which it is learned how the drawn band is seen
NEAR = 0.025  # m around the straight lines from the tips to the hand
OUTER, HAND = 0.78, 0.05  # share of them from which on, m before the hand until which, is looked
FEWEST = 30  # points of the drawn band
SEEN = 0.5  # share of them from which a picture shows it drawn
MOVES = 0.002  # s after the fall of the force from which no picture is the one before
SURELY = 0.1  # s after which every band is gone
EMPTY_AFTER = 0.015  # s after the fall of the force in which the outer fifth is empty


@dataclass(frozen=True)
class ReleasePictures:
    """What the pictures around the release show.

    Attributes:
        earliest, latest: The camera's stamps are late against the force's by between both [s].
        drawn, gone: Stamps of the last picture of the drawn band and of the next one, from the
            release [s].
        again: Stamps of pictures after it that show the drawn band once more.
        repeated: Stamps of pictures around the release that are those before them, pixel by pixel.
        never: No picture shows the band let go; what is said of the next picture is void.
    """

    earliest: float
    latest: float
    drawn: float
    gone: float
    again: tuple[float, ...]
    repeated: tuple[float, ...]
    never: bool = False

    @property
    def middle(self) -> float:
        return (self.earliest + self.latest) / 2

    @property
    def error(self) -> float:
        """Standard deviation of a delay that is anywhere between both [s]."""
        return (self.latest - self.earliest) / np.sqrt(12)

    @property
    def beyond(self) -> float:
        """Least amount by which the stamps are off for sure [s]; 0 where they may be right.

        Pictures in which the band comes and goes tell nothing of a clock.
        """
        return 0.0 if self.never or self.again else self.off(0.0)

    def off(self, late: float) -> float:
        """How far a delay is outside of what the pictures allow [s]; 0 within."""
        return max(self.earliest - late, late - self.latest, 0.0)

    def confirms(self, late: float, allowed: float) -> bool:
        """Whether these pictures are possible only where the camera is `late` [s], within limits.

        Args:
            allowed: By which a delay may be outside of them [s].
        """
        return not self.never and self.off(late) <= allowed < self.off(0.0)

    @property
    def frozen(self) -> tuple[float, ...]:
        """Stamps of pictures that are sent again while the band must move [s]."""
        return tuple(time for time in self.repeated if time > MOVES)


def release_pictures(pull: Pull, fork_width: float) -> ReleasePictures | None:
    """None where the pictures do not show the drawn band, or not until it is gone."""
    recording, release = pull.recording, pull.release.time
    stamps = recording.depth.seconds(recording.origin)
    since, hand = stamps - release, pull.motion.position(release - 0.02)
    there = np.linalg.norm(pull.motion.position(stamps) - hand, axis=1) < THERE
    there |= since > 0
    around = np.flatnonzero((np.abs(since) < AROUND) & there)
    before = np.flatnonzero((since < -AROUND) & (since > pull.grasp - release) & there)[-HELD:]
    if len(before) < 3 or len(around) < 3:
        return None
    tips = np.array([[-0.5, 0, 0], [0.5, 0, 0]]) * fork_width
    rays, last = recording.depth_camera.rays().astype(np.float32), None
    counts, times, repeated = [], [], []
    for k in (*before, *around):
        depth = recording.depth_picture(int(k))
        if depth is None or not depth.any():  # an emitter that is off, say
            continue
        if last is not None and np.array_equal(depth, last):
            repeated.append(float(since[k]))
        last = depth
        counts.append(_points(pull, rays, depth, tips, hand))
        times.append(float(since[k]))
    times, counts = np.array(times), np.array(counts, float)
    full = np.median(counts[times < -AROUND]) if (times < -AROUND).any() else 0.0
    if full < FEWEST:
        return None
    share = counts / full
    gone = np.flatnonzero((share < SEEN) & (times > -AROUND))
    if not len(gone) and np.sum(times > SURELY) > 2:
        last = float(times[-1])
        return ReleasePictures(last, last, last, last, (), tuple(repeated), never=True)
    if not len(gone) or gone[0] == 0 or gone[0] == len(times) - 1:
        return None
    first = int(gone[0])
    drawn, empty = float(times[first - 1]), float(times[first])
    return ReleasePictures(
        earliest=drawn - EMPTY_AFTER,
        latest=empty,
        drawn=drawn,
        gone=empty,
        again=tuple(times[first:][share[first:] > SEEN].tolist()),
        repeated=tuple(repeated),
    )


def points_near(
    pull: Pull, rays: np.ndarray, depth: np.ndarray, places: np.ndarray, margin: float
) -> np.ndarray:
    """Points (P, 3) of what a depth picture (H, W) shows around some places (N, 3), frame O.

    Args:
        rays: Of the depth camera, shape (H, W, 3).
        margin: Around the places [m]; none are seen where one is nearer to the camera than twice
            of it.
    """
    camera, pose = pull.recording.depth_camera, pull.geometry.camera
    seen = pose.inverse().apply(places)
    nearest = float(seen[:, 2].min())
    if nearest < 2 * margin:
        return np.zeros((0, 3))
    pixels, half = camera.project(seen), margin * np.diag(camera.matrix)[:2] / nearest
    window = camera.window(pixels.min(axis=0) - half, pixels.max(axis=0) + half)
    depth = depth[window]
    return pose.apply((rays[window] * depth[..., None])[depth > 0]).astype(float)


def _points(
    pull: Pull, rays: np.ndarray, depth: np.ndarray, tips: np.ndarray, hand: np.ndarray
) -> int:
    """How many points of a depth picture (H, W) lie where the drawn band's outer fifth is."""
    ends = [tip + share * (hand - tip) for tip in tips for share in (OUTER, 1.0)]
    points = points_near(pull, rays, depth, np.array(ends), NEAR)
    chosen = np.zeros(len(points), bool)
    for tip in tips:
        length = np.linalg.norm(hand - tip)
        way, from_tip = (hand - tip) / length, points - tip
        along = from_tip @ way
        off = np.linalg.norm(from_tip - along[:, None] * way, axis=1)
        chosen |= (off < NEAR) & (along > OUTER * length) & (along < length - HAND)
    return int(chosen.sum())
