"""Episode: the one record that real and simulated interactions share, and its Parquet files.

An episode is a window of one interaction (grasp, lift, pull, pause, release, swing). Signals are
averages over equal samples; clouds keep the camera's own stamps and are never resampled.
Frame O: origin midway between the fork tips, y towards the target, z up, x along the fork.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from sling2sim2real.base.files import NotMade, column, made, read_table, replacing

SCHEMA_VERSION = 1


@dataclass(frozen=True)
class Episode:
    """One interaction, SI units, frame O, times in seconds since the window's start.

    Attributes:
        band: Name of the band.
        time: Middle of each sample, shape (T,).
        position: End effector (tool centre point), shape (T, 3).
        velocity: Its velocity, shape (T, 3).
        force: Force of the band on the gripper, low-passed and averaged, shape (T, 3).
        opening: Distance between the fingers, shape (T,); NaN where it was not recorded.
        cloud_time: Stamps of the camera frames, shape (K,).
        clouds: Sling points of each frame, K arrays of shape (<= points, 3), float32; may be empty.
        grasp_time: The fingers hold the band from here on.
        release_time: The hand lets go: the force begins to drop.
        camera: Position of the depth camera, shape (3,).
        metadata: Everything else worth keeping: frame, setup, preprocessing, hash of the input.
    """

    band: str
    time: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    force: np.ndarray
    opening: np.ndarray
    cloud_time: np.ndarray
    clouds: list[np.ndarray]
    grasp_time: float
    release_time: float
    camera: np.ndarray
    metadata: dict[str, Any] = field(default_factory=dict)

    @property
    def sample_period(self) -> float:
        return float(self.time[1] - self.time[0])

    @property
    def cautions(self) -> list[dict[str, str]]:
        """What of its recording costs accuracy: `about`, `what` and `cure` of each finding."""
        return self.metadata.get("cautions", [])

    def save(self, folder: Path) -> None:
        """Write `signals.parquet` and `clouds.parquet` into `folder`."""
        signals = {"t": pa.array(self.time, pa.float64())}
        for name in ("position", "velocity", "force"):
            for axis, values in zip("xyz", getattr(self, name).T, strict=True):
                signals[f"{name}_{axis}"] = pa.array(values, pa.float64())
        signals["opening"] = pa.array(self.opening, pa.float64())
        clouds = {"t": pa.array(self.cloud_time, pa.float64()), "points": _nested(self.clouds)}
        header = {
            "version": SCHEMA_VERSION,
            "band": self.band,
            "frame": "O",
            "sample_period": self.sample_period,
            "grasp_time": self.grasp_time,
            "release_time": self.release_time,
            "camera": list(map(float, self.camera)),
            **self.metadata,
        }
        schema_metadata = {"episode": json.dumps(header, sort_keys=True)}
        folder.mkdir(parents=True, exist_ok=True)
        for name, columns in (("clouds", clouds), ("signals", signals)):
            table = pa.table(columns).replace_schema_metadata(schema_metadata)
            with replacing(folder / f"{name}.parquet") as temporary:
                pq.write_table(table, temporary)

    @classmethod
    def load_all(cls, folder: Path) -> list[Episode]:
        """All pulls of a band, by the name of the recording, then by time. Raises as `load`."""
        episodes = [cls.load(folder / "1")]
        while (numbered := folder / str(len(episodes) + 1)).is_dir():
            episodes.append(cls.load(numbered))
        return episodes

    @classmethod
    def load(cls, folder: Path) -> Episode:
        """Read an episode that `save` wrote. Raises NotMade."""
        header = read_metadata(folder)
        signals, clouds = (
            read_table(made(folder / f"{name}.parquet")) for name in ("signals", "clouds")
        )

        def vectors(name: str) -> np.ndarray:
            return np.stack([column(signals, f"{name}_{axis}") for axis in "xyz"], axis=1)

        nested = clouds["points"].combine_chunks()
        flat = np.array(np.from_dlpack(nested.values.flatten())).reshape(-1, 3)
        points = np.split(flat, nested.offsets.to_pylist()[1:-1])
        for name in ("frame", "sample_period"):  # which are not for the metadata
            header.pop(name)
        return cls(
            band=header.pop("band"),
            time=column(signals, "t"),
            position=vectors("position"),
            velocity=vectors("velocity"),
            force=vectors("force"),
            opening=column(signals, "opening"),
            cloud_time=column(clouds, "t"),
            clouds=points,
            grasp_time=header.pop("grasp_time"),
            release_time=header.pop("release_time"),
            camera=np.array(header.pop("camera")),
            metadata=header,
        )


def _nested(clouds: list[np.ndarray]) -> pa.Array:
    """Clouds as a column of lists of points."""
    flat = np.concatenate([np.zeros((0, 3)), *clouds]).astype(np.float32)
    points = pa.FixedSizeListArray.from_arrays(pa.array(flat.ravel()), 3)
    ends = np.cumsum([0, *map(len, clouds)]).astype(np.int32)
    return pa.ListArray.from_arrays(ends, points)


def read_metadata(folder: Path) -> dict[str, Any]:
    """The header of an episode that `Episode.save` wrote: its events and metadata, no arrays.

    Raises NotMade: it is not there, or another version wrote it.
    """
    path = made(folder / "signals.parquet")
    header = json.loads((pq.read_schema(path).metadata or {}).get(b"episode", b"{}"))
    if header.pop("version", None) != SCHEMA_VERSION:
        raise NotMade(path, "written by another version")
    return header
