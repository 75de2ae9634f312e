"""index.html of a card: its text, and a replay of pull and launches. One file, no request."""

from __future__ import annotations

import base64
import json
from pathlib import Path

import numpy as np
import pandas as pd

from pipeline.base.files import write_text
from pipeline.base.template import filled
from pipeline.episode.episode import Episode
from pipeline.params.lab import SetupParams
from pipeline.report.card.camera_view import SIMULATED
from pipeline.report.card.inputs import Aims
from pipeline.report.card.simulated import Simulated, smooth
from pipeline.report.drawing.page import page
from pipeline.simulator.model import GRAVITY

HERE = Path(__file__).parent
NODES = 61  # of a line
NEAR, POINTS, FEW = 0.3, 240, 90  # s from the release within which a cloud has more points
RELEASE = (-0.03, 0.15)  # what is played at first, from the release [s]
MILLIMETRES = 1000


def write_page(
    folder: Path,
    text: str,
    title: str,
    episode: Episode,
    simulated: Simulated,
    setup: SetupParams,
    launches: list[dict],
) -> None:
    """Write index.html into `folder`, where the text's pictures lie. Raises UserError.

    Args:
        launches: As `flights_at` has them.
    """
    shown = content(episode, simulated, setup) | {"launches": launches}
    data = json.dumps(shown, separators=(",", ":"))
    section = filled(
        HERE / "replay.html.j2",
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
        "hand": packed(episode.position),
        "moved": _seconds(episode.time - release),
        "grasp": round(float(episode.grasp_time - release), 5),
        "fork": MILLIMETRES * setup.fork_width,
        "height": MILLIMETRES * setup.fork_height,
        "centre": np.round(MILLIMETRES * (low + high) / 2).tolist(),
        "size": round(0.75 * MILLIMETRES * float(np.linalg.norm(high - low))),
        "color": SIMULATED,
    }


def flights_at(trials: pd.DataFrame, aims: Aims) -> list[dict]:
    """Launches by target, for replay.js; places (y, z) in whole millimetres, frame O.

    A measured launch has no flight, and one that failed before it flew has no landing either.

    Args:
        trials: As the stage `trials` has them.
    """
    flights = []
    for target, draw, ends in zip(aims.target, aims.draw, aims.interval, strict=True):
        if not np.isfinite(draw).all():
            continue
        rows = trials.loc[np.isclose(trials.target, target)]
        flown = rows.loc[rows.flight_y.notna()]
        ways = [
            np.stack([y, z], axis=1) for y, z in zip(flown.flight_y, flown.flight_z, strict=True)
        ]
        landings = [way[-1, 0] for way in ways] or rows.landing_y.dropna().tolist()
        flights.append(
            {
                "target": _whole(target),
                "draw": _whole(draw),
                "interval": _whole(ends) if np.isfinite(ends).all() else None,
                "step": float(np.median([step(way) for way in ways])) if ways else 0.0,
                "flights": [_whole(way.ravel()) for way in ways],
                "landings": _whole(np.array(landings)),
                "kind": str(rows.kind.iloc[0]) if len(rows) else "predicted",
            }
        )
    return flights


def step(way: np.ndarray) -> float:
    """Time between the points of a flight (K, 2), which are even in time, by its fall [s]."""
    fall = -np.median(np.diff(way[:, 1], 2)) if len(way) > 2 else 0.0
    return round(float(np.sqrt(max(fall, 0.0) / GRAVITY)), 5)


def _whole(lengths: object) -> object:
    return np.round(MILLIMETRES * np.asarray(lengths, float)).astype(int).tolist()


def _seconds(times: np.ndarray) -> list[float]:
    return [round(float(time), 5) for time in times]


def thinned(cloud: np.ndarray, most: int) -> np.ndarray:
    """Thin a cloud to at most so many points, evenly from its order, shape (N, 3)."""
    if len(cloud) > most:
        cloud = cloud[np.linspace(0, len(cloud) - 1, most).round().astype(int)]
    return np.reshape(cloud, (-1, 3))


def packed(points: np.ndarray) -> str:
    """Points [m] as millimetres in base64; those beyond 32 m, which no band reaches, at 32 m."""
    whole = np.clip(np.round(MILLIMETRES * np.asarray(points, float)), -32767, 32767)
    return base64.b64encode(whole.astype("<i2").tobytes()).decode()
