"""A finished run of a band that was never there: every input of the report, small and synthetic."""

import json
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pipeline.params import load
from pipeline.report import report as reporting
from pipeline.report.data import Result, gather
from pipeline.report.figures import search, simulation
from sling2sim2real.base.launches_file import write_launches
from sling2sim2real.episode.episode import Episode
from sling2sim2real.identification.searches.regions import Region, save_regions
from sling2sim2real.simulator.parameters import THETA as NAMES
from tests.policy.stored import write_stored
from tests.project import DEFAULTS, write_params_of
from tests.report import toy_launches
from tests.report.toy_simulation import toy_landscape, toy_replay

BAND, METHOD = "toy", "paper"
PAIR = f"{BAND}-{METHOD}"
THETA = {
    "youngs_modulus": 3e5,
    "poissons_ratio": 0.45,
    "elasticity_damping": 3e-3,
    "dynamic_friction": 0.5,
    "damping_scale": 0.7,
}


def episode() -> Episode:
    time = np.linspace(0.015, 8.985, 300)
    stamps = np.arange(90) / 10
    line = np.stack([np.linspace(-0.14, 0.14, 25), np.full(25, -0.2), np.zeros(25)], 1)
    nothing = np.zeros((300, 3))
    force = np.stack([0 * time, np.where(time < 8, time, 0), np.sin(time)], 1)
    return Episode(
        BAND, time, nothing + [0, -0.4, 0], nothing, force, 0 * time, stamps,
        [line.astype(np.float32)] * 90, 1.0, 8.0, np.array([1.0, 0, 0]),
    )  # fmt: skip


def history(phase: str, totals: list[float], solver: int | None = None) -> pd.DataFrame:
    """Rows on the diagonal of the unit cube, one generation each; its box is params.yaml's."""
    boxes = load(DEFAULTS).parameters
    place = (np.arange(len(totals)) + 0.5) / len(totals)
    rows = pd.DataFrame({"method": METHOD, "phase": phase, "total": totals})
    rows["generation"], rows["solver"] = np.arange(len(totals)), solver
    rows["solver"] = rows.solver.astype("Int32")
    for name in NAMES:
        box = getattr(boxes, name)
        low, high = np.log([box.low, box.high]) if box.scale == "log" else (box.low, box.high)
        value = low + place * (high - low)
        rows[f"unit_{name}"], rows[name] = place, np.exp(value) if box.scale == "log" else value
    finite = np.where(np.isfinite(totals), totals, np.nan)
    for name, share in (("geom", 0.5), ("force", 0.25), ("work", 0.25)):
        rows[name] = share * finite
    rows["failure"] = np.where(np.isfinite(totals), None, "slipped")
    return rows


def launches() -> pd.DataFrame:
    """Of BAND by METHOD, measured: two inside the recorded stretch, two beyond; one is lost."""
    targets = np.array([1.725, 1.725, 1.925, 2.125])
    return toy_launches.launches(
        [[0.02], [-0.03], [0.04], [np.nan]], "measured", targets, band=BAND, method=METHOD,
        trial=[1, 2, 1, 1], failure=[None, None, None, "did not land"],
        stretch=[1.4, 1.4, 1.7, 1.8], recorded_stretch=1.63, predicted_y=targets,
        predicted_low=targets - 0.025, predicted_high=targets + 0.025,
    )  # fmt: skip


def confidence() -> dict:
    """What a θ file says of its confidence; friction cannot be identified."""
    parameters = {
        name: {"low": 0.9 * value, "high": 1.1 * value, "identifiable": name != "dynamic_friction"}
        for name, value in THETA.items()
    }
    matrix = np.eye(5)
    matrix[0, 1] = matrix[1, 0] = -0.9
    return {
        "level": 0.9,
        "parameters": parameters,
        "derived": {
            "damping_product": {"value": 2.1e-3, "low": 1.9e-3, "high": 2.3e-3, "unit": "s"},
            "turn_damping": {"value": 0.0, "low": 0.0, "high": 0.2, "unit": ""},
            "returned_share": {"value": 1.0, "low": 0.97, "high": 1.03, "unit": ""},
            "air_drag": {"value": 0.5, "low": 0.1, "high": 1.5, "unit": "1/s"},
        },
        "correlation": {"names": list(NAMES), "matrix": matrix.tolist()},
        "recordings": [
            {"force_rms": 0.041, "held_rms": 5e-4, "recoil_rms": 2.1e-3, "pictures": [0.0123]}
            | {"source": {"file": "one.mcap"}}
        ],
        "disagreement": 1.0,
        "launches": [],
        "steps": 5,
        "settled": True,
    }


def posterior() -> dict:
    """Samples within ± 10 % of θ."""
    spread = np.linspace(0.9, 1.1, 41)
    theta = np.array(list(THETA.values()))
    return {"names": list(NAMES), "samples": (theta * spread[:, None]).tolist()}


@pytest.fixture(scope="session")
def template(tmp_path_factory) -> Path:
    """A project folder with params.yaml and everything that the report reads."""
    root = tmp_path_factory.mktemp("report")
    write_params_of(root, BAND, METHOD, 0.04)
    data = root / "data"
    for name in ("evaluations", "clusters", "theta", "confidence", "trials", "launches"):
        (data / name).mkdir(parents=True)
    episode().save(data / "episodes" / BAND / "plain" / "1")
    phases = history("de", [3.0, np.inf, 2.0]), history("cma", [2.5, 1.25], solver=0)
    evaluations = pd.concat(phases, ignore_index=True)
    evaluations.to_parquet(data / "evaluations" / f"{PAIR}.parquet")
    write_launches(data / "launches" / f"{BAND}.csv", [])
    region = Region(np.full(5, 0.4), 0.01 * np.eye(5), 2.0, [2, 0])
    save_regions(data / "clusters" / f"{PAIR}.json", NAMES, [region])
    loss = {"geom": 0.5, "force": 0.25, "work": 0.5, "total": 1.25}
    theta = {"band": BAND, "method": METHOD, "theta": THETA, "loss": loss, "rollouts": 5}
    theta["confidence"] = confidence()
    (data / "theta" / f"{PAIR}.json").write_text(json.dumps(theta))
    (data / "confidence" / f"{PAIR}.json").write_text(json.dumps(posterior()))

    folder = data / "policies" / PAIR
    write_stored(folder)
    launches().to_parquet(data / "trials" / f"{PAIR}.parquet")
    return root


@pytest.fixture
def root(template: Path, tmp_path: Path) -> Path:
    """A copy of the template, to change."""
    return shutil.copytree(template, tmp_path, dirs_exist_ok=True)


@pytest.fixture
def no_simulation(monkeypatch) -> None:
    monkeypatch.setattr(simulation, "replayed", toy_replay)
    monkeypatch.setattr(search, "landscape", toy_landscape)


@pytest.fixture
def text_alone(monkeypatch) -> None:
    """Pictures and the page take seconds, and tell a test of the text nothing."""
    shown = lambda _, name, alt, *__: f"![{alt}](figures/{name}.png)\n"  # noqa: E731
    monkeypatch.setattr(reporting.Report, "_picture", shown)
    monkeypatch.setattr(reporting, "write_page", lambda *_: None)


@pytest.fixture
def params(root: Path):
    return load(root / "params.yaml")


@pytest.fixture
def result(root: Path, params) -> Result:
    return gather(params, root).results[BAND][METHOD]
