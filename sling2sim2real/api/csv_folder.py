"""An episode of a folder of CSV files and point clouds, for a rig without ROS.

    my_pull/
      episode.yaml      camera: [x, y, z], grasp_time, release_time; maybe name, release_error,
                        camera_error, as `episode_from_arrays` has them
      pose.csv          time, x, y, z, and maybe opening: tool centre point
      force.csv         time, fx, fy, fz: of the band on the gripper, tared
      clouds/12.345.ply points of the band alone, named by their stamp; or .npy, shape (P, 3)

SI units, frame O, one clock. Further columns are not read.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
from pydantic import ValidationError

from sling2sim2real.api.band_folder import mapping_of
from sling2sim2real.api.episodes import episode_from_arrays
from sling2sim2real.base.errors import UserError, one_line
from sling2sim2real.base.schema import LIST, Section, explained
from sling2sim2real.episode.episode import Episode
from sling2sim2real.settings import Settings

POSE, FORCE = ("x", "y", "z"), ("fx", "fy", "fz")


class EpisodeFile(Section):
    """What episode.yaml holds [m, s]."""

    camera: Annotated[tuple[float, float, float], LIST]
    grasp_time: float
    release_time: float
    name: str = "band"
    release_error: float | None = None
    camera_error: float | None = None


def episode_from_csv(folder: str | Path, *, settings: Settings | None = None) -> Episode:
    """An episode of a folder with episode.yaml, pose.csv, force.csv and clouds/.

    >>> import tempfile
    >>> from pathlib import Path
    >>> from sling2sim2real import episode_from_csv
    >>> folder = Path(tempfile.mkdtemp())
    >>> _ = (folder / "episode.yaml").write_text("camera: [0.8, 0.3]")
    >>> episode_from_csv(folder)
    Traceback (most recent call last):
    ...
    sling2sim2real.base.errors.UserError: ...episode.yaml: camera...

    Args:
        folder: docs/api.md says what its files hold.
        settings: Filter, sample period and window; None: `Settings.default()`.

    Raises:
        UserError: A file is missing or damaged, or `episode_from_arrays` refuses what they hold;
            the line names the file, and the line or column in it.
    """
    folder = Path(folder)
    about = _about(folder / "episode.yaml")
    pose = _table(folder / "pose.csv", POSE)
    force = _table(folder / "force.csv", FORCE)
    stamps, clouds = _clouds(folder / "clouds")
    try:
        return episode_from_arrays(
            time=pose["time"].to_numpy(),
            position=pose[list(POSE)].to_numpy(),
            force_time=force["time"].to_numpy(),
            force=force[list(FORCE)].to_numpy(),
            cloud_time=stamps,
            clouds=clouds,
            opening=pose["opening"].to_numpy() if "opening" in pose else None,
            settings=settings,
            **about.model_dump(),
        )
    except UserError as error:
        raise UserError(f"{folder}: {error}") from error


def _about(path: Path) -> EpisodeFile:
    try:
        return EpisodeFile.model_validate(mapping_of(path))
    except ValidationError as error:
        raise UserError(f"{path}: {explained(error, EpisodeFile)}") from error


def _table(path: Path, columns: tuple[str, ...]) -> pd.DataFrame:
    """Columns time, `columns` and maybe opening, all finite, time increasing. Raises UserError."""
    try:
        table = pd.read_csv(
            path, dtype=str, skipinitialspace=True, skip_blank_lines=False, keep_default_na=False
        ).fillna("")
    except (OSError, ValueError) as error:  # pandas' own errors are ValueErrors
        message = getattr(error, "strerror", None) or error
        raise UserError(f"{path}: cannot be read ({one_line(message)[:120]})") from error
    table = table.rename(columns=lambda name: str(name).strip())
    wanted = ["time", *columns, *(["opening"] if "opening" in table else [])]
    missing = [name for name in wanted if list(table.columns).count(name) != 1]
    if missing:
        raise UserError(f"{path}: must have one column each of {', '.join(wanted)}; not {missing}")
    while len(table) and (table.iloc[-1] == "").all():  # empty lines at the end
        table = table.iloc[:-1]
    numbers = table[wanted].apply(pd.to_numeric, errors="coerce")
    wrong = ~np.isfinite(numbers.to_numpy(float))
    if wrong.any():
        line, column = np.argwhere(wrong)[0]
        text = table[wanted].iat[line, column]
        raise UserError(f"{path}, line {line + 2}: {wanted[column]} is no number: {text!r}")
    back = np.flatnonzero(np.diff(numbers["time"]) <= 0)
    if len(back):
        raise UserError(f"{path}, line {back[0] + 3}: time does not increase")
    return pd.DataFrame(numbers, dtype=float)


def _clouds(folder: Path) -> tuple[np.ndarray, list[np.ndarray]]:
    """Stamps [s] and clouds (P, 3) [m] in their order. Raises UserError."""
    files = [file for file in folder.glob("*") if file.suffix in READERS]
    if not files:
        raise UserError(f"{folder}: no .ply or .npy file; one a frame, such as 12.345.ply")
    stamped: dict[float, Path] = {}
    for file in files:
        try:
            stamp = float(file.stem)
        except ValueError:
            stamp = np.nan
        if not np.isfinite(stamp) or stamp in stamped:
            raise UserError(f"{file}: its name must be a stamp of its own in s, such as 12.345.ply")
        stamped[stamp] = file
    stamps = sorted(stamped)
    return np.array(stamps), [READERS[stamped[at].suffix](stamped[at]) for at in stamps]


def _ply(path: Path) -> np.ndarray:
    import open3d

    try:
        content = path.read_bytes()
        header = content.split(b"end_header")[0].split()
        count = int(header[header.index(b"vertex") + 1])
        if not 0 <= count < len(content):
            raise ValueError
    except (OSError, ValueError, IndexError) as error:
        raise UserError(f"{path}: is no PLY file with vertices") from error
    with open3d.utility.VerbosityContextManager(open3d.utility.VerbosityLevel.Error):
        points = np.asarray(open3d.io.read_point_cloud(path).points) if count else np.empty(0)
    return _expect_points(path, points.reshape(-1, 3), count)


def _npy(path: Path) -> np.ndarray:
    try:
        points = np.load(path, allow_pickle=False)
    except Exception as error:  # a damaged header raises whatever its text makes Python raise
        raise UserError(f"{path}: cannot be read ({one_line(error)[:120]})") from error
    return _expect_points(path, points, len(points) if np.ndim(points) else -1)


def _expect_points(path: Path, points: np.ndarray, count: int) -> np.ndarray:
    numbers = np.asarray(points).dtype.kind in "fiu"
    if not numbers or points.shape != (count, 3) or not np.isfinite(points).all():
        raise UserError(f"{path}: must hold finite points, shape (P, 3), got {np.shape(points)}")
    return points


READERS = {".ply": _ply, ".npy": _npy}
