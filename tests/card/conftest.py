"""A band with everything that its card reads: a recording whose truth is a formula, and a θ."""

import json
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pipeline.band_folder import card_inputs
from pipeline.layout import Layout
from pipeline.params import Params, load
from pipeline.params.run import Pair
from sling2sim2real.card.inputs import CardInputs
from sling2sim2real.recording.build import build_episodes
from sling2sim2real.simulator.parameters import EXTRA
from tests import once
from tests.policy.stored import write_stored
from tests.project import write_params_of
from validation.projects import ROUGH
from validation.recordings.bag import Truth, write_bag

BAND, METHOD = "toy", "posterior"
PAIR = Pair(band=BAND, recording="plain", method=METHOD)
TRUTH = Truth()
THETA = {
    "youngs_modulus": 3e5,
    "poissons_ratio": 0.47,
    "elasticity_damping": 3e-3,
    "dynamic_friction": 0.7,
    "damping_scale": 0.6,
    "mooney_share": 0.2,
    "upturn": 0.05,
    "softening": 0.0,
    "relaxation": 0.04,
    "flow": 0.05,
    "log_flow_rate": 2.0,
}
POINT = {**THETA, "air_drag": 0.3, "turn_damping": 0.2, "returned_share": 1.0}
SPREAD = {"youngs_modulus": 0.02, "elasticity_damping": 0.3, "returned_share": 0.015}


def samples() -> np.ndarray:
    """Of θ: some of it known to so many per cent, shape (40, 14)."""
    rng = np.random.default_rng(1)
    columns = [
        value * np.exp(SPREAD.get(name, 0.0) * rng.standard_normal(40))
        for name, value in POINT.items()
    ]
    return np.stack(columns, axis=1)


def confidence() -> dict:
    parameters = {
        name: {"low": 0.95 * value, "high": 1.05 * value, "identifiable": True}
        for name, value in THETA.items()
    }
    derived = {
        name: {"value": POINT[name], "low": 0.9 * POINT[name], "high": 1.1 * POINT[name]}
        for name in EXTRA
    }
    release = {"value": TRUTH.release, "low": 2.9999, "high": 3.0009}
    derived |= {"release_time": release, "camera_delay": {"value": 0.0, "low": -1e-3, "high": 1e-3}}
    recording = {"force_rms": 0.05, "held_rms": 8e-4, "recoil_rms": 2e-3, "pictures": [0.0236]}
    return {
        "level": 0.9,
        "parameters": parameters,
        "derived": derived,
        "recordings": [recording | {"source": {"file": "seen.mcap"}}],
        "disagreement": 1.0,
        "launches": [],
        "settled": True,
    }


def theta_file(band: str) -> dict:
    theta = {"band": band, "method": METHOD, "law": "rubber", "theta": THETA}
    theta |= {"history": {"pull_time": 1.4, "pause": 0.6}, "nuisances": {"air_drag": 0.3}}
    return theta | {"turn_damping": 0.2, "returned_share": 1.0, "confidence": confidence()}


def trials() -> pd.DataFrame:
    """Two measured launches, both inside their intervals."""
    return pd.DataFrame(
        {"kind": "measured", "landing_y": [1.9, 2.1], "predicted_y": [1.92, 2.08]}
        | {"target": np.nan, "flight_y": None, "flight_z": None}
        | {"predicted_low": [1.8, 2.0], "predicted_high": [2.0, 2.2], "stretch": 1.4}
    )


def make(root: Path) -> None:
    episode = {"duration": 3.6, "samples": 120, "tail": 0.5}
    write_params_of(root, BAND, METHOD, 0.03, episode=episode, sling=ROUGH)
    params, layout = load(root / "params.yaml"), Layout(root)
    layout.raw(PAIR).mkdir(parents=True)
    recording = layout.raw(PAIR) / "seen.mcap"
    write_bag(recording, TRUTH)
    episode = build_episodes(recording, BAND, params)[0][0]
    episode.save(layout.episode(PAIR))
    theta = theta_file(BAND)
    posterior = {"names": [*POINT], "samples": samples().tolist()}
    for path, summary in (
        (layout.theta(PAIR), theta),
        (layout.confidence(PAIR), posterior),
    ):
        path.parent.mkdir(parents=True)
        path.write_text(json.dumps(summary))
    layout.trials(PAIR).parent.mkdir(parents=True)
    trials().to_parquet(layout.trials(PAIR))
    write_stored(layout.policy(PAIR))


@pytest.fixture(scope="session")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """To be read only."""
    return once.folder(tmp_path_factory, "card", make)


@pytest.fixture
def copied(project: Path, tmp_path: Path) -> Path:
    """A copy, to change."""
    return shutil.copytree(project, tmp_path / "project")


@pytest.fixture(scope="session")
def card_params(project: Path) -> Params:
    return load(project / "params.yaml")


@pytest.fixture(scope="session")
def summary(project: Path) -> CardInputs:
    return card_inputs(PAIR, project)
