"""index.html of a card: its text, and a replay to turn and to play. One file, no request."""

from __future__ import annotations

import base64
import json
from pathlib import Path
from string import Template

import numpy as np

from pipeline.base.files import write_text
from pipeline.episode.episode import Episode
from pipeline.params.lab import SetupParams
from pipeline.report.card.camera_view import SIMULATED
from pipeline.report.card.simulated import Simulated, smooth
from pipeline.report.drawing.page import page

HERE = Path(__file__).parent
NODES = 61  # of a line
NEAR, POINTS, FEW = 0.3, 240, 90  # s from the release within which a cloud has more points
RELEASE = (-0.03, 0.15)  # what is played at first, from the release [s]
MILLIMETRES = 1000


def write_page(
    folder: Path, text: str, title: str, episode: Episode, simulated: Simulated, setup: SetupParams
) -> None:
    """Write index.html into `folder`, where the text's pictures lie. Raises UserError."""
    data = json.dumps(content(episode, simulated, setup), separators=(",", ":"))
    section = Template((HERE / "replay.html").read_text("utf-8")).substitute(
        color=SIMULATED,
        data=data.replace("</", "<\\/"),
        script=(HERE / "replay.js").read_text("utf-8"),
    )
    links = (("replay", "Replay"),)
    write_text(folder / "index.html", page(text, folder, title, section=section, links=links))


def content(episode: Episode, simulated: Simulated, setup: SetupParams) -> dict:
    """What replay.js reads. Times [s] from the release; places in whole millimetres, frame O.

    Arrays are little-endian int16 in base64: `line` (states, nodes, 3) at `times`, `cloud` (points
    of all frames, 3) of which `counts` says how many each frame has, taken at `stamps`.
    """
    release = simulated.release
    stamps = episode.cloud_time + simulated.camera - release
    clouds = [
        thinned(cloud, POINTS if abs(since) < NEAR else FEW)
        for cloud, since in zip(episode.clouds, stamps, strict=True)
    ]
    nodes = np.moveaxis(simulated.nodes, 0, 1)  # all states at once
    lines = np.moveaxis(smooth(simulated.place, nodes, NODES), 1, 0)
    moving = lines[np.abs(simulated.time - release) < NEAR]
    low, high = moving.min(axis=(0, 1)), moving.max(axis=(0, 1))
    return {
        "release": list(RELEASE),
        "times": _seconds(simulated.time - release),
        "nodes": NODES,
        "line": packed(lines),
        "stamps": _seconds(stamps),
        "counts": [len(cloud) for cloud in clouds],
        "cloud": packed(np.concatenate(clouds)),
        "fork": MILLIMETRES * setup.fork_width,
        "height": MILLIMETRES * setup.fork_height,
        "centre": np.round(MILLIMETRES * (low + high) / 2).tolist(),
        "size": round(0.75 * MILLIMETRES * float(np.linalg.norm(high - low))),
        "color": SIMULATED,
    }


def _seconds(times: np.ndarray) -> list[float]:
    return [round(float(time), 5) for time in times]


def thinned(cloud: np.ndarray, most: int) -> np.ndarray:
    """At most so many points of a cloud, evenly from its order, shape (N, 3)."""
    if len(cloud) > most:
        cloud = cloud[np.linspace(0, len(cloud) - 1, most).round().astype(int)]
    return np.reshape(cloud, (-1, 3))


def packed(points: np.ndarray) -> str:
    """Points [m] as millimetres in base64; those beyond 32 m, which no band reaches, at 32 m."""
    whole = np.clip(np.round(MILLIMETRES * np.asarray(points, float)), -32767, 32767)
    return base64.b64encode(whole.astype("<i2").tobytes()).decode()
