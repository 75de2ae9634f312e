"""The band as a thin ridge of the depth image: no weights, no graphics card."""

from __future__ import annotations

from collections.abc import Iterable

import cv2
import numpy as np
from scipy.ndimage import binary_closing, binary_dilation, gaussian_filter

from sling2sim2real.recording.scene import BLIND, RgbdFrame, Scene, View, length

VOXEL, HALF = 0.008, 30  # m, and voxels from the middle to each side
REACH = VOXEL * HALF
OFTEN = 0.3  # share of the frames in which a part of the hand is seen
GAP = 4  # voxels, half the way of a finger
FEWEST = 4  # frames to learn from
BINS = 48  # of each axis of chromaticity
ENOUGH = 200  # pixels to learn from, of the band and of the hand
TOLD_APART = 0.97  # balanced accuracy from which colours count
DARK = 90  # sum of the channels below which they tell nothing
AGAINST = 0.1  # share of the band in a bin up to which a pixel is the hand's


class Shape:
    """Voxels around the tool centre point that the hand takes; it does not turn.

    Attributes:
        taken: Shape (2 HALF,) * 3, bool, axes of frame O.
    """

    def __init__(self, taken: np.ndarray):
        self.taken = taken

    @classmethod
    def learn(cls, clouds: Iterable[np.ndarray], often: float = OFTEN) -> Shape | None:
        """Shape in clouds (S, 3), relative to the tool centre point, that do not show the band."""
        counts, frames = np.zeros((2 * HALF,) * 3, np.int32), 0
        for cloud in clouds:
            inside, cells = _voxels(cloud)
            seen = np.zeros(counts.shape, bool)
            seen[tuple(cells[inside].T)] = True
            counts += seen
            frames += 1
        if frames < FEWEST or not counts.any():
            return None
        taken = counts >= max(2, often * frames)
        return cls(binary_dilation(taken, np.ones((3, 3, 3), bool)))

    @classmethod
    def swept(cls, first: Shape | None, last: Shape | None) -> Shape | None:
        """Shape of both and what is between them: fingers on their way."""
        if first is None or last is None:
            return None
        between = binary_closing(np.pad(first.taken | last.taken, GAP), iterations=GAP)
        return cls(between[(slice(GAP, -GAP),) * 3])

    def holds(self, points: np.ndarray) -> np.ndarray:
        """Which points (S, 3), relative to the tool centre point, lie in the hand: (S,)."""
        inside, cells = _voxels(points)
        within = np.zeros(len(points), bool)
        within[inside] = self.taken[tuple(cells[inside].T)]
        return within


def _voxels(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Whether each point (S, 3) lies in the grid, (S,), and its cell, (S, 3)."""
    cells = np.floor(points / VOXEL).astype(np.int64) + HALF
    return np.all((cells >= 0) & (cells < 2 * HALF), axis=1), cells


class Colors:
    """Which chromaticities are the hand's and not the band's.

    Attributes:
        share: Of the band in each bin, shape (BINS, BINS).
    """

    def __init__(self, share: np.ndarray):
        self.share = share

    @classmethod
    def learn(cls, band: np.ndarray, hand: np.ndarray) -> Colors | None:
        """Learn from BGR pixels (S, 3) of both; None where colours do not tell them apart."""
        samples = [pixels[_bright(pixels)] for pixels in (band, hand)]
        if min(map(len, samples)) < ENOUGH:
            return None
        counts = []
        for pixels in samples:
            histogram = np.zeros((BINS, BINS))
            np.add.at(histogram, _bins(pixels), 1.0)
            counts.append(gaussian_filter(histogram, 1.0, mode="nearest") / len(pixels) + 1e-6)
        share = counts[0] / (counts[0] + counts[1])
        right = [np.mean(share[_bins(pixels)] > 0.5) for pixels in samples]
        return cls(share) if (right[0] + 1 - right[1]) / 2 > TOLD_APART else None

    def against(self, pixels: np.ndarray) -> np.ndarray:
        """Which BGR pixels (S, 3) are the hand's rather than the band's: (S,)."""
        return _bright(pixels) & (self.share[_bins(pixels)] < AGAINST)


def _bright(pixels: np.ndarray) -> np.ndarray:
    return pixels.sum(axis=1, dtype=np.int32) > DARK


def _bins(pixels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Shares of blue and green in a pixel (S, 3), as bins."""
    whole = np.maximum(pixels.sum(axis=1, dtype=np.int32), 1)
    cells = pixels[:, :2].astype(np.int32) * (BINS - 1) // whole[:, None]
    return cells[:, 0], cells[:, 1]


LEARNING_FRAMES = 48
HAND_FRAMES = 10
BACKGROUND = 0.8  # share of the time that the band may not spend at one pixel
STILL = 0.02  # m by which the depth of a pixel varies that always shows the same
FAR = 100.0  # m, where the depth is unknown
THICKNESS = 1.9  # diameters: what is wider in the picture is no band
RIDGE = 0.5  # diameters by which the band stands out from what is around it
NOISE = 4.0  # standard deviations of the depth by which it stands out as well
OFF_LINES = 0.02  # m and a diameter: the taut band is straight, and calibrations are not perfect
HAND = 0.025  # m around the tool centre point that the closed fingers take
FINGER = 0.04  # m around the pads, where the hand was not seen without the band
PALM = (0.06, 0.30, 0.12)  # m: from and to where behind the fingers, and its radius
MOST_TURN = 0.1  # rad that the hand may turn for its shape to be carried along
SETTLED = 0.25  # s after the release from which the free band is short again
MOSTLY = 0.5  # share of the time before the grasp that the band hangs where it hangs
MOVING = 0.15  # s before the grasp and after the release in which the fingers move


class RidgeMask:
    """The band as what is thin, stands out, is not always there, and is not the hand.

    Its colour may be that of the arm, of the floor or of the fork: depth decides. A pixel is the
    band's if it
    - lies where a band of that length can be, above the floor (which rejects shadows); while the
      hand draws it taut, beside the straight lines from the tips to the hand,
    - is nearer than what is usually seen there (which rejects the fork),
    - stands out from its surroundings and is as thin as the band (which rejects the arm),
    - is no part of the hand, whose shape is seen while the band is elsewhere; and before the hand
      grasps it, where the band hangs,
    - has no colour that tells the hand from the band, where there is such a colour.
    """

    def __init__(self, view: View):
        self.scene = view.scene
        self.focal = float(view.recording.depth_camera.matrix[0, 0])
        every = range(0, len(view), max(1, len(view) // LEARNING_FRAMES))
        depths = [depth[view.window] for k in every if (depth := view.depth(k)) is not None]
        if not depths:
            raise view.undecoded("depth")
        self.background, self.noise = _background(np.stack(depths))
        scene = self.scene

        def some(of_time) -> list[int]:
            numbers = [k for k, time in enumerate(view.times) if of_time(time)]
            return numbers[:: max(1, len(numbers) // HAND_FRAMES)]

        taut = some(scene.taut)
        free = some(lambda time: time > scene.signals.release_time + SETTLED)
        hand = [self._around_hand(frame) for _, frame in view.frames(taut, whole=True)]
        if scene.signals.facts.turn > MOST_TURN:  # then it has no one shape in frame O
            self.closed = self.open = None
        else:
            self.closed = Shape.learn(points for points, _ in hand)
            self.open = Shape.learn(
                self._around_hand(frame)[0] for _, frame in view.frames(free, whole=True)
            )
        self.swept = Shape.swept(self.closed, self.open)
        still = some(self._hangs)
        self.hanging = Shape.learn(
            (self._from_middle(f.points[self._candidates(f)]) for _, f in view.frames(still)),
            often=MOSTLY,
        )
        band = [self._surely(frame) for _, frame in view.frames(taut)]
        self.colors = None
        if band:
            others = np.concatenate([pixels for _, pixels in hand])
            self.colors = Colors.learn(np.concatenate(band), others)

    def mask(self, frame: RgbdFrame) -> np.ndarray:
        candidates = self._candidates(frame)
        rows, columns = np.nonzero(candidates)
        points = frame.points[rows, columns]
        keep = ~self._in_hand(points, frame.time)
        if self.colors is not None:
            keep &= ~self.colors.against(frame.color[rows, columns])
        if self.scene.taut(frame.time):
            keep &= self._off_lines(points, frame.time) < 0
        candidates[rows[~keep], columns[~keep]] = False
        return _large_enough(candidates, self.focal * self.scene.diameter / frame.depth[candidates])

    def _candidates(self, frame: RgbdFrame) -> np.ndarray:
        """Thin, new and near pixels, shape (H, W)."""
        stands_out = np.maximum(RIDGE * self.scene.diameter, NOISE * self.noise * frame.depth**2)
        new = frame.near & (self.background - frame.depth > stands_out)
        if not new.any():
            return new
        width = THICKNESS * self.focal * self.scene.diameter / frame.depth[new]
        sizes = np.zeros(new.shape, np.int16)
        sizes[new] = 2 * np.round(width / 2).astype(np.int16) + 1
        most = int(sizes.max())  # a closing looks no further than its kernel is wide
        left, top, wide, high = cv2.boundingRect(new.view(np.uint8))
        rows = slice(max(0, top - most), top + high + most)
        part = rows, slice(max(0, left - most), left + wide + most)
        far = np.where(frame.depth[part] > BLIND, frame.depth[part], np.float32(FAR))
        thin = np.zeros_like(new)
        for size in np.unique(sizes[new]):
            # A closing of the depth fills whatever is nearer and narrower than its kernel.
            kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (int(size), int(size)))
            filled = cv2.morphologyEx(far, cv2.MORPH_CLOSE, kernel)
            thin[part] |= (sizes[part] == size) & (filled - far > stands_out[part])
        return thin

    def _off_lines(self, points: np.ndarray, time: float) -> np.ndarray:
        """Distance of points (S, 3) from where the taut band may be, shape (S,)."""
        return distance_to_lines(points, self.scene, time) - OFF_LINES - self.scene.diameter

    def _hangs(self, time: float) -> bool:
        return time < self.scene.signals.grasp_time

    def _from_middle(self, points: np.ndarray) -> np.ndarray:
        """Points relative to where the hanging band is grasped, shape (S, 3)."""
        return points - self.scene.signals.hand(self.scene.signals.grasp_time)

    def _around_hand(self, frame: RgbdFrame) -> tuple[np.ndarray, np.ndarray]:
        """Points (S, 3) from the tool centre point where the band cannot be; colours (S, 3)."""
        taut = self.scene.taut(frame.time)
        away = frame.points - self.scene.signals.hand(frame.time).astype(np.float32)
        other = (np.abs(away) < REACH).all(axis=-1) & (taut | ~frame.near)
        if taut:
            other[other] = self._off_lines(frame.points[other], frame.time) > 0
        return away[other], frame.color[other]

    def _surely(self, frame: RgbdFrame) -> np.ndarray:
        """Colours (S, 3) of the taut band where nothing else is near."""
        candidates = self._candidates(frame)
        points = frame.points[candidates]
        sure = distance_to_lines(points, self.scene, frame.time) < 1.5 * self.scene.diameter
        sure &= length(points - self.scene.signals.hand(frame.time)) > 2 * HAND
        return frame.color[candidates][sure]

    def _shapes(self, time: float) -> list[Shape | None]:
        """Shapes of the hand at that time; more than one while the fingers move."""
        signals = self.scene.signals
        if self.scene.taut(time):
            return []  # the lines to the hand leave room for little more than the fingers' tips
        if self.scene.holds(time):
            return [self.closed]
        if 0 <= time - signals.release_time < MOVING:
            return [self.swept]
        if 0 < signals.grasp_time - time < MOVING:
            return [self.open, self.closed]
        return [self.open]

    def _in_hand(self, points: np.ndarray, time: float) -> np.ndarray:
        scene = self.scene
        away = points - scene.signals.hand(time)
        shapes = self._shapes(time)
        room = HAND if scene.holds(time) else 0.0
        if None in shapes:  # no such hand was seen
            room = FINGER + scene.signals.opening_at(time) / 2
        near = (length(away) < room) | _in_palm(away, scene.signals.tool_axis, None in shapes)
        for shape in shapes:
            if shape is not None:
                near |= shape.holds(away)
        if self._hangs(time) and self.hanging is not None:
            near |= (length(away) < REACH) & ~self.hanging.holds(self._from_middle(points))
        return near


def _background(depths: np.ndarray) -> tuple[np.ndarray, float]:
    """What is seen behind all that moves, (H, W) from (F, H, W), inf if unknown, and its noise.

    The noise is a standard deviation at 1 m; it grows with the square of the distance.
    """
    ranks = [int(share * (len(depths) - 1)) for share in (BACKGROUND, 0.5)]
    depths[depths < BLIND] = np.inf
    depths.partition(sorted({*ranks}), axis=0)
    seen, middle = depths[ranks[0]], depths[ranks[1]]
    still = np.isfinite(seen)
    still[still] = seen[still] - middle[still] < STILL
    off = np.abs(depths[: len(depths) // 2 + 1, still] - middle[still]) / middle[still] ** 2
    noise = 1.48 * float(np.median(off)) if off.size else 0.0
    # Pixels at an edge see now this side of it, now that, now nothing: the nearer one counts.
    nearest = cv2.erode(seen.astype(np.float32), np.ones((3, 3)))
    return np.where(still, seen, nearest).astype(np.float32), noise


def distance_to_lines(points: np.ndarray, scene: Scene, time: float) -> np.ndarray:
    """Distance of points (S, 3) from the straight lines tip to hand, shape (S,)."""
    hand, distances = scene.signals.hand(time), []
    for tip in scene.tips:
        way = (hand - tip) / np.linalg.norm(hand - tip)
        along = np.clip((points - tip) @ way, 0, np.linalg.norm(hand - tip))
        distances.append(length(points - tip - along[:, None] * way))
    return np.minimum(*distances)


def _in_palm(away: np.ndarray, tool_axis: np.ndarray, fingers: bool) -> np.ndarray:
    """Behind the tool centre point along the tool's axis, with the fingers or without: (S,)."""
    behind = -(away @ tool_axis)
    aside = np.sqrt(np.maximum((away**2).sum(axis=-1) - behind**2, 0))
    first = HAND if fingers else PALM[0]
    return (behind > first) & (behind < PALM[1]) & (aside < PALM[2])


def _large_enough(mask: np.ndarray, diameters: np.ndarray) -> np.ndarray:
    """Without specks: parts smaller than a piece of band as long as it is thick.

    Parts count as one across gaps of two pixels, which depth cameras leave at edges.
    """
    if not mask.any():
        return mask
    joined = cv2.dilate(mask.astype(np.uint8), np.ones((3, 3), np.uint8))
    _, labels = cv2.connectedComponents(joined, connectivity=8)
    sizes = np.bincount(labels[mask], minlength=labels.max() + 1)
    return mask & (sizes >= 2 * np.median(diameters) ** 2)[labels]
