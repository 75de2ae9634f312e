"""Episodes of recordings: from an MCAP file, or from arrays of your own rig."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.signal import savgol_filter

from sling2sim2real.api.model import Band, with_band
from sling2sim2real.base.errors import UserError
from sling2sim2real.episode import signal
from sling2sim2real.episode.episode import Episode
from sling2sim2real.episode.window import window_of
from sling2sim2real.settings import Settings

VELOCITY_WINDOW = 0.05  # s of the local cubic fits that are differentiated
LEAST_PULL = 0.5  # N


def read_mcap(path: str | Path, band: Band, *, settings: Settings | None = None) -> list[Episode]:
    """The episodes of a recording, one for each pull that can be used, in time order.

    A pull that cannot be used is left out, with a line on stderr that says why. `Episode.save` and
    `Episode.load` keep an episode in a folder of its own.

    >>> from sling2sim2real import Band, read_mcap
    >>> read_mcap("nowhere.mcap", Band(mass=0.023, diameter=0.010, rest_length=0.52))
    Traceback (most recent call last):
    ...
    sling2sim2real.base.errors.UserError: nowhere.mcap: ...

    Args:
        path: A ROS 2 or Foxglove MCAP, or a bag's folder; docs/recording.md says what it must hold.
        band: That was recorded.
        settings: The lab, its topics, the episode's length; None: `Settings.default()`.

    Raises:
        UserError: It cannot be read, or no pull in it can be used; the line says what is missing.
    """
    from sling2sim2real.recording.build import build_episodes  # Open3D takes seconds to import

    settings = with_band(settings or Settings.default(), band)
    episodes, refused = build_episodes(Path(path), band.name, settings)
    for reason in refused:
        print(f"warning: left out: {reason}", file=sys.stderr)
    return episodes


def episode_from_arrays(
    *,
    time: np.ndarray,
    position: np.ndarray,
    force: np.ndarray,
    cloud_time: np.ndarray,
    clouds: Sequence[np.ndarray],
    camera: np.ndarray,
    grasp_time: float,
    release_time: float,
    force_time: np.ndarray | None = None,
    opening: np.ndarray | None = None,
    release_error: float | None = None,
    camera_error: float | None = None,
    name: str = "band",
    settings: Settings | None = None,
) -> Episode:
    """An episode of arrays, for a rig that records no MCAP. One clock [s], frame O, SI units.

    Frame O: origin midway between the fork's tips, x along the fork, y towards the target, z up.
    The arrays are filtered and averaged as a recording's are; give them raw.

    >>> from sling2sim2real import Band, Model, Settings, Theta, episode_from_arrays, rehearse
    >>> band = Band(mass=0.023, diameter=0.010, rest_length=0.52)
    >>> model = Model(band, Theta(2.0e5, 0.47, 2.4e-3, 0.7, 0.6), settings=Settings.coarse())
    >>> arrays = rehearse(model)
    >>> sorted(arrays)  # doctest: +NORMALIZE_WHITESPACE
    ['camera', 'cloud_time', 'clouds', 'force', 'grasp_time', 'position', 'release_time', 'time']
    >>> episode = episode_from_arrays(**arrays)
    >>> print(f"{episode.sample_period:.2f} s, {len(episode.clouds)} clouds")
    0.03 s, 147 clouds

    Args:
        time: Of the hand's samples, increasing, at 100 Hz or more, shape (S,).
        position: Tool centre point, shape (S, 3).
        force: Of the band on the gripper, tared, without the tool's weight: towards + y while the
            hand holds the band at - y. Shape (S, 3), or (R, 3) with `force_time`; 1 kHz is best.
        cloud_time: Stamps of the camera's frames, increasing, shape (K,).
        clouds: Points of the band alone in each frame, K arrays of shape (P, 3), P may be 0.
        camera: Position of the camera, shape (3,).
        grasp_time: The fingers hold the band from here on.
        release_time: The force begins to drop.
        force_time: Of the force's samples, where that is another clock rate, shape (R,).
        opening: Distance between the fingers [m], shape (S,).
        release_error, camera_error: Standard deviation of the release and of the camera's clock
            against the force's; None: 0.3 and 1 ms. About a period of a slow sensor.
        name: Of the band.
        settings: Filter, sample period and window; None: `Settings.default()`.

    Raises:
        UserError: A shape is wrong, a time does not increase, the force points away from the fork,
            or the arrays end too soon after the release.
    """
    settings = settings or Settings.default()
    episode_params, path_time = settings.episode, _times("time", time)
    path = _vectors("position", position, len(path_time))
    force_time = path_time if force_time is None else _times("force_time", force_time)
    force = _vectors("force", force, len(force_time))
    stamps, clouds = _times("cloud_time", cloud_time), _clouds(clouds)
    if len(clouds) != len(stamps):
        raise UserError(f"clouds: {len(clouds)}, but cloud_time has {len(stamps)}; one for each")
    if not grasp_time < release_time:
        raise UserError(
            f"release_time: must be after grasp_time, {grasp_time:g} s, got {release_time:g} s"
        )

    first, last = max(path_time[0], force_time[0]), min(path_time[-1], force_time[-1])
    if last < release_time + episode_params.tail:
        raise UserError(
            f"time: the arrays end at {last:.2f} s; record until {episode_params.tail:g} s"
            f" (episode.tail) after the release at {release_time:.2f} s"
        )
    window = window_of(episode_params, first, grasp_time, release_time)
    start, period = window.start, window.period
    count = min(window.samples, int((last - start) / period + 1e-6))

    def means(times: np.ndarray, values: np.ndarray) -> np.ndarray:
        return signal.average(times, values, start, period, count)

    rate = 1 / float(np.median(np.diff(force_time)))
    grid, even = signal.uniform(force_time, force, rate)
    cutoff = signal.cutoff_hz(settings.force.cutoff, settings.force.cutoff_unit)
    smooth = means(grid, signal.lowpass(even, rate, cutoff))
    middles = (np.arange(count) + 0.5) * period
    places = means(path_time, path)
    _expect_pull(smooth, places, middles + start, release_time)
    seen = (stamps >= start) & (stamps <= start + count * period)
    camera = _vectors("camera", np.atleast_2d(camera), 1)[0]
    delays = None if camera_error is None else {"camera": {"error": camera_error}}
    return Episode(
        band=name,
        time=middles,
        position=places,
        velocity=means(*_velocity(path_time, path)),
        force=smooth,
        opening=np.full(count, np.nan) if opening is None else means(path_time, opening),
        cloud_time=stamps[seen] - start,
        clouds=[_thinned(clouds[i], settings.cloud.points) for i in np.flatnonzero(seen)],
        grasp_time=grasp_time - start,
        release_time=release_time - start,
        camera=camera,
        metadata={
            "input": {"file": "arrays"},
            "preprocessing": {"release_error": release_error, "delays": delays},
        },
    )


def _times(name: str, values: np.ndarray) -> np.ndarray:
    times = np.asarray(values, float)
    if times.ndim != 1 or len(times) < 10 or not (np.diff(times) > 0).all():
        raise UserError(f"{name}: must be at least ten increasing times, shape (S,)")
    return times


def _vectors(name: str, values: np.ndarray, count: int) -> np.ndarray:
    vectors = np.asarray(values, float)
    if vectors.shape != (count, 3):
        raise UserError(f"{name}: must have shape ({count}, 3), got {vectors.shape}")
    if not np.isfinite(vectors).all():
        raise UserError(f"{name}: holds NaN or infinity; leave such samples out")
    return vectors


def _clouds(clouds: Sequence[np.ndarray]) -> list[np.ndarray]:
    arrays = [np.asarray(cloud, np.float32).reshape(-1, 3) for cloud in clouds]
    if not any(map(len, arrays)):
        raise UserError("clouds: no frame has a point")
    if not all(np.isfinite(array).all() for array in arrays):
        raise UserError("clouds: hold NaN or infinity; leave such points out")
    return arrays


def _thinned(cloud: np.ndarray, most: int) -> np.ndarray:
    return cloud[:: -(-len(cloud) // most)] if len(cloud) else cloud


def _velocity(time: np.ndarray, path: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Even times (M,) and the velocity there (M, 3), by local cubic fits."""
    period = float(np.median(np.diff(time)))
    grid, even = signal.uniform(time, path, 1 / period)
    size = max(5, 2 * round(VELOCITY_WINDOW / period / 2) + 1)
    return grid, np.asarray(savgol_filter(even, size, 3, deriv=1, delta=period, axis=0))


def _expect_pull(force: np.ndarray, position: np.ndarray, time: np.ndarray, release: float) -> None:
    """Raises UserError where the band does not pull the hand back to the fork at the end."""
    late = (time < release - 0.05) & (time > release - 0.35)
    place, pulls = position[late].mean(axis=0), force[late].mean(axis=0)
    back = -place @ pulls / max(float(np.linalg.norm(place)), 1e-9)
    if back < LEAST_PULL:
        hint = "; turn its sign" if back < -LEAST_PULL else ""
        raise UserError(
            f"force: before the release the band pulls the hand by {back:.1f} N towards the fork,"
            f" {LEAST_PULL:g} N or more are expected{hint}"
        )
