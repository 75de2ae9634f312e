"""The colour pictures of a recorded pull, and where points of frame O are seen in them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np

from sling2sim2real.base.files import NotMade, replacing_folder, write_json
from sling2sim2real.base.schema import JsonRecord, read_json
from sling2sim2real.episode.episode import Episode
from sling2sim2real.recording import images
from sling2sim2real.recording.camera import Camera
from sling2sim2real.recording.frames import EpisodeGeometry
from sling2sim2real.recording.messages import Picture
from sling2sim2real.recording.streams import read_recording
from sling2sim2real.recording.transforms import Transform
from sling2sim2real.settings.lab import SetupParams
from sling2sim2real.settings.recording import DelayParams

CLOSEST = 0.05  # m before the camera
BEFORE, AFTER = 0.3, 0.4  # s of the release: more than a card shows, by any delay of the camera
FAST = [cv2.IMWRITE_PNG_COMPRESSION, 1]


class _Times(JsonRecord):
    time: list[float]
    files: list[str | None]


@dataclass(frozen=True)
class Pictures:
    """N colour pictures on an episode's clock.

    Attributes:
        time: Of each [s], as the episode has the camera's stamps, shape (N,).
        camera, pose: The colour camera, and frame O to its frame.
    """

    time: np.ndarray
    camera: Camera
    pose: Transform
    _taken: Sequence[Picture | np.ndarray | None]

    @classmethod
    def of(cls, path: Path, episode: Episode, setup: SetupParams) -> Pictures:
        """Read the pictures of the recording that an episode was made from.

        Raises:
            NotMade: It is not there.
            UserError: It cannot be read, or an older version made the episode.
        """
        if not path.exists():
            raise NotMade(path)
        geometry = EpisodeGeometry.of_episode(episode.metadata, episode.band)
        late = _applied(episode, "camera")
        delays = DelayParams(pose=_applied(episode, "pose"), camera=late)
        color = read_recording(path, setup, delays).color
        time = color.seconds(episode.metadata["input"]["start_ns"])
        return cls(time, geometry.camera, geometry.camera_to_fork, color.values)

    def around(self, episode: Episode) -> Pictures:
        """Those alone that a card shows: of the hanging band, and around the release."""
        hanging = self.latest(max(episode.grasp_time - 0.1, 0.0))
        first = self.latest(episode.release_time - BEFORE)
        last = int(np.searchsorted(self.time, episode.release_time + AFTER)) + 1
        chosen = sorted({0, hanging, *range(first, min(last, len(self.time)))})
        return replace(self, time=self.time[chosen], _taken=[self[number] for number in chosen])

    def save(self, folder: Path) -> None:
        """Write them as PNG, losslessly, and their times."""
        with replacing_folder(folder) as temporary:
            files = []
            for number in range(len(self.time)):
                image, name = self[number], f"{number:03d}.png"
                files.append(None if image is None else name)
                if image is not None:
                    cv2.imwrite(str(temporary / name), image, FAST)
            write_json(temporary / "times.json", {"time": self.time.tolist(), "files": files})

    @classmethod
    def load(cls, folder: Path, episode: Episode) -> Pictures:
        """Read what `save` wrote, of this episode. Raises NotMade."""
        file = read_json(folder / "times.json", _Times)
        geometry = EpisodeGeometry.of_episode(episode.metadata, episode.band)
        images = [None if name is None else cv2.imread(str(folder / name)) for name in file.files]
        return cls(np.array(file.time), geometry.camera, geometry.camera_to_fork, images)

    def __getitem__(self, number: int) -> np.ndarray | None:
        """A picture, BGR, shape (H, W, 3); None where it is damaged."""
        taken = self._taken[number]
        if taken is None or isinstance(taken, np.ndarray):
            return taken
        try:
            return images.color(taken)
        except images.Undecodable:
            return None

    def latest(self, time: float) -> int:
        """Number of the last picture at or before a moment, or else of the first."""
        return max(int(np.searchsorted(self.time, time, side="right")) - 1, 0)

    def project(self, points: np.ndarray) -> np.ndarray:
        """Pixels (u, v) of points (N, 3), shape (N, 2); NaN of those behind the camera."""
        seen = self.pose.apply(points)
        pixels = np.full((len(points), 2), np.nan)
        ahead = seen[:, 2] > CLOSEST
        pixels[ahead] = self.camera.project(seen[ahead])
        return pixels


def _applied(episode: Episode, name: str) -> float:
    """Delay of the stamps of pose or camera that was taken off for the episode [s]."""
    delay = (episode.metadata["preprocessing"].get("delays") or {}).get(name) or {}
    return delay["value"] if delay.get("applied") else 0.0
