"""What a method makes of recordings of the virtual rig: landings without noise, and intervals.

Recordings are made once and kept as episodes; the rig is launched after a method has ended.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from ruamel.yaml import YAML

from pipeline.params import Params
from rig.oracle.aim import hit, least_sensitive_draw
from rig.oracle.world import World
from sling2sim2real.base.files import replacing, write_json
from sling2sim2real.base.schema import read_json
from sling2sim2real.episode.episode import Episode
from sling2sim2real.identification.clamps import calibrate_clamps
from sling2sim2real.identification.results.theta import Mounting
from sling2sim2real.launching.surface.landing_map import LandingMap
from sling2sim2real.launching.trials.spread import landing_intervals
from sling2sim2real.simulator.model import ClampedBand
from validation.density import Calibrated

TARGETS = np.linspace(1.525, 2.325, 9)  # m
MAP = 17, 13  # simulated launches that tell where to seek


def recorded(params: Params, band: str, folder: Path) -> Episode:
    """The episode of a recording that the rig makes, clamps beside it; kept in `folder`."""
    from rig.recorder.record import record  # needs Open3D, scores do not

    if not (folder / "mounting.json").exists():
        raw = folder / f"{band}.mcap"
        raw.parent.mkdir(parents=True, exist_ok=True)
        record(params, band, raw)
        built(params, band, raw, folder)
        raw.unlink()
    return Episode.load(folder / "episode")


def built(params: Params, band: str, raw: Path, folder: Path) -> Episode:
    """The episode of a recording that is there, clamps beside it; kept in `folder`."""
    from sling2sim2real.recording.build import build_episodes  # needs Open3D

    if not (folder / "mounting.json").exists():
        calibrated_clamps(params, band, build_episodes(raw, band, params)[0][0], folder)
    return Episode.load(folder / "episode")


def calibrated_clamps(params: Params, band: str, episode: Episode, folder: Path) -> None:
    """Keep an episode in `folder`, with its clamps beside it."""
    episode.save(folder / "episode")
    sling = ClampedBand.of(params.bands[band], params.setup, params.sling)
    clamps = calibrate_clamps(params, sling, episode, workers=1)
    write_json(folder / "mounting.json", vars(clamps))


def sling_of(params: Params, band: str, method: str, folder: Path) -> ClampedBand:
    """The band as a method takes it, with or without the clamps of its first recording."""
    method_params = params.methods[method]
    mounting = read_json(folder / "mounting.json", Mounting) if method_params.mounting else None
    lab = params.setup, params.sling
    return ClampedBand.of(params.bands[band], *lab, mounting, law=method_params.law)


def aimed(outcome: Calibrated, params: Params, targets: Sequence[float] = TARGETS) -> np.ndarray:
    """Draws (T, 2) that a perfect policy would choose for targets; NaN where it finds none."""
    setup = params.setup
    box = {"draw_y": setup.draw_y, "draw_z": setup.draw_z, "max_force": setup.max_force}
    landing_map = LandingMap.simulate(outcome, **box, size=MAP)

    def land(draw: np.ndarray) -> float:
        done = outcome(draw[None])
        return float(done.landing_y[0]) if done.failure[0] is None else float("nan")

    starts = [least_sensitive_draw(landing_map, target) for target in targets]
    draws = [
        hit(land, target, start) if np.isfinite(start).all() else start
        for target, start in zip(targets, starts, strict=True)
    ]
    return np.array(draws)


def scored(outcome: Calibrated, params: Params, world: World, seed: int = 0) -> dict:
    """Launches at TARGETS in the world: errors without noise, and one launch each with noise.

    Every landing counts, also one beyond the target area.

    Returns:
        "draws" (T, 2); "error" of the landing as a share of the target, without noise; "miss" [m]
        with it; "low", "high" of the 90 % interval and "inside"; NaN where there is none.
    """
    draws = aimed(outcome, params)
    good = np.isfinite(draws).all(axis=1)
    landing, noisy = np.full(len(draws), np.nan), np.full(len(draws), np.nan)
    intervals = np.full((len(draws), 2), np.nan)
    landing[good] = world.exact(draws[good]).landing_y
    numbers = 1000 * (seed + 1) + np.flatnonzero(good)
    noisy[good] = [trial.landing_y for trial in world.trials(draws[good], numbers.tolist())]
    if outcome.samples is not None and good.any():
        error = params.trials.actuation_error
        intervals[good] = landing_intervals(outcome, draws[good], outcome.samples, error)
    low, high = intervals.T
    return {
        "draws": draws,
        "error": landing / TARGETS - 1,
        "miss": noisy - TARGETS,
        "low": low,
        "high": high,
        "inside": (noisy >= low) & (noisy <= high),
    }


def saved(params: Params, path: Path) -> Path:
    """params.yaml as the rig's processes read it."""
    content = params.model_dump(mode="json", exclude_unset=True)
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as temporary:
        YAML().dump(content, temporary)
    return path


def summary(results: list[dict]) -> dict:
    """Summarise a band's recordings, each scored at TARGETS.

    Returns:
        "bias" of each recording, the mean error of its launches; its mean over recordings and that
        of its size, as shares of the distance; "mean_miss_m"; of the launches with an interval
        "launches", "coverage", and that of each recording; "median_width"; "failed": launches that
        had no draw or did not land. Without intervals coverage and width are NaN.
    """
    error, miss, low, high = (
        np.array([result[name] for result in results], float)
        for name in ("error", "miss", "low", "high")
    )
    finite = np.isfinite(low) & np.isfinite(miss)
    inside = finite & (TARGETS + miss >= low) & (TARGETS + miss <= high)
    bias, count = np.nanmean(error, axis=1), finite.sum(axis=1)
    covered = np.full(len(results), np.nan)
    np.divide(inside.sum(axis=1), count, out=covered, where=count > 0)
    width = ((high - low) / TARGETS)[finite]
    return {
        "bias": bias,
        "mean_bias": np.nanmean(bias),
        "mean_size_of_bias": np.nanmean(np.abs(bias)),
        "mean_miss_m": np.nanmean(np.abs(miss)),
        "failed": int((np.isnan(error) | np.isnan(miss)).sum()),
        "coverage": inside.sum() / finite.sum() if finite.any() else np.nan,
        "coverage_of_each": covered,
        "launches": int(finite.sum()),
        "median_width": np.median(width) if finite.any() else np.nan,
    }


def summaries(lines: list[dict]) -> dict[str, dict]:
    """Summarise lines of results with "scores" by band."""
    return {
        band: summary([line["scores"] for line in lines if line["band"] == band])
        for band in dict.fromkeys(line["band"] for line in lines)
    }
