"""What the replay shows, small: whole millimetres in two bytes, base64, clouds thinned out."""

from __future__ import annotations

import base64

import numpy as np

from pipeline.report.report import Report
from pipeline.report.styles import SIDE_BY_SIDE, drawn

POINTS = 350  # of a cloud


def content(report: Report) -> dict:
    """The fork, and of each band its frames; what replay.js reads.

    Arrays are little-endian int16 in millimetres: `cloud` (points of all frames, 3), of which
    `counts` says how many each frame has, and of a method `line` (frames, nodes, 3). `distance`
    is of each frame [mm], null without points.
    """
    setup = report.params.setup
    return {
        "fork": {"width": setup.fork_width, "height": setup.fork_height},
        "bands": [_band(report, band) for band, methods in report.replays.items() if methods],
    }


def _band(report: Report, band: str) -> dict:
    episode, replays, named = report.results.episodes[band], report.replays[band], report.styles
    clouds = [thinned(cloud) for cloud in episode.clouds]
    chosen = {method: replays[method] for method in drawn(replays, SIDE_BY_SIDE)}
    lines = [replay.center_line.reshape(-1, 3) for replay in chosen.values()]
    everything, shown = np.concatenate([*clouds, *lines]), drawn(replays)
    return {
        "name": band,
        "times": [round(float(time), 4) for time in episode.cloud_time],
        "release": round(float(episode.release_time), 4),
        "low": [round(float(value) - 0.02, 3) for value in everything.min(0)],
        "high": [round(float(value) + 0.02, 3) for value in everything.max(0)],
        "counts": [len(cloud) for cloud in clouds],
        "cloud": millimetres(np.concatenate(clouds)),
        "methods": [
            {
                "name": named[method].name,
                "color": named[method].color,
                "shown": method in shown,
                "nodes": replay.center_line.shape[1],
                "line": millimetres(replay.center_line),
                "distance": [
                    round(1000 * float(value), 1) if np.isfinite(value) else None
                    for value in replay.distance
                ],
            }
            for method, replay in chosen.items()
        ],
    }


def thinned(cloud: np.ndarray) -> np.ndarray:
    """At most `POINTS` points of a cloud, evenly from its order, shape (N, 3)."""
    if len(cloud) <= POINTS:
        return cloud.reshape(-1, 3)
    return cloud[np.linspace(0, len(cloud) - 1, POINTS).round().astype(int)]


def millimetres(points: np.ndarray) -> str:
    """Points [m] in base64; those beyond 32 m, which no band reaches, at 32 m."""
    whole = np.clip(np.round(1000 * np.asarray(points, float)), -32767, 32767)
    return base64.b64encode(whole.astype("<i2").tobytes()).decode()
