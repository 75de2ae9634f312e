"""A finished run of several bands and methods, of exact inputs, in which much is odd."""

import json
import shutil
from pathlib import Path

import numpy as np
import pandas as pd

from pipeline.layout import Layout
from pipeline.params import Params, load
from pipeline.params.run import RunParams
from sling2sim2real.base.launches_file import AIMED, COLUMNS
from sling2sim2real.identification.searches.regions import Region, save_regions
from sling2sim2real.settings.identification import LAWS
from sling2sim2real.simulator.parameters import THETA as NAMES
from tests.project import with_
from tests.report.conftest import BAND, METHOD, PAIR, THETA, confidence
from tests.report.conftest import launches as mixed
from tests.report.toy_launches import floor, launches
from validation.projects import run_of as all_of

OURS = "posterior"
METHODS = OURS, METHOD, "real2sim2real", "package_si"
ABLATIONS = "de", "no_work"
RIG = "band1", "band2"
DIPS = "band1-dips"

NEAR = [[0.01, 0.03], [-0.02, 0.02], [0.04, -0.04]]
FAR = [[0.1, 0.1], [0.15, 0.15], [0.28, 0.28]]
LOST = [[0.9, 0.9]] * 3  # never within the target area
NOTHING = launches([[np.nan]] * 3, "predicted", predicted_y=2.0)
FLOWN = [[0.0, 0.9, 1.8]] * 6, [[-0.1, 0.3, -0.5]] * 6
UNPREDICTED = [2.0, np.nan, 2.0, 2.0, 2.0, 2.0]
LAUNCHES = {
    "band1": {
        OURS: launches(NEAR, flight_y=FLOWN[0], flight_z=FLOWN[1]),
        METHOD: launches(FAR, failed=1),
        "real2sim2real": launches(LOST),
        "package_si": launches(FAR, failed=6),
        "de": launches(FAR),
        "no_work": launches([[0.05, 0.07]] * 3),
    },
    "band2": {
        OURS: launches(
            [[0.05, 0.05]] * 3, failed=2, predicted_y=UNPREDICTED,
            predicted_failure=[None, "the simulation did not converge", *[None] * 4],
        ),
        METHOD: launches(NEAR, stretch=[1.4, 1.4, 1.4, 1.4, 1.7, 1.7]),
        "real2sim2real": launches(FAR),
        "package_si": pd.concat([launches(NEAR), launches([[0.05], [0.04], [0.06]], "measured")]),
    },
    BAND: {
        OURS: pd.concat(
            [
                mixed(),
                launches(
                    [[0.01, 0.03]], "measured", targets=[1.6], predicted_y=[1.58, np.nan],
                    predicted_failure=[None, "the simulation did not converge"],
                    hold_force=[9.0, np.nan],
                ),
            ]
        ),
        METHOD: NOTHING,
        "real2sim2real": NOTHING,
        "package_si": launches([[0.1]], "measured", targets=[2.0], target=np.nan),
    },
}  # fmt: skip
RUBBER = dict(zip(LAWS["rubber"], (-0.25, 0.0, 0.2, 0.05, 0.1, 2.0), strict=True))


def run_of(params: Params) -> Params:
    """Parameters of the run, made of those of BAND and METHOD alone."""
    bands = dict.fromkeys(RIG, with_(params.bands[BAND], "", source="rig"))
    methods = {"band1": [*METHODS, *ABLATIONS], "band2": METHODS, BAND: METHODS, DIPS: [OURS]}
    run = all_of(methods)["run"] | {"floors": [*RIG]}
    run["rig"] = {key: run["recordings"][key] for key in (*RIG, DIPS)}
    run = RunParams.model_validate(run)
    return with_(params, "", bands={**bands, BAND: params.bands[BAND]}, run=run)


def write_run(root: Path) -> None:
    """Write the run's files beside those of BAND and METHOD, which are there."""
    layout = Layout(root)
    pairs = run_of(load(root / "params.yaml")).run.pairs
    for band, methods in LAUNCHES.items():
        if band != BAND:
            shutil.copytree(root / "data/episodes" / BAND, root / "data/episodes" / band)
            shutil.copy(layout.launches(BAND), layout.launches(band))
        for method, trials in methods.items():
            pair = pairs[f"{band}-{method}"]
            if pair.key != PAIR:
                _copy(root, pair.key)
            trials.assign(band=band, method=method).to_parquet(layout.trials(pair))
            layout.theta(pair).write_text(json.dumps(theta(band, method)))
    regions = [Region(np.full(5, 0.4), 0.01 * np.eye(5), total, [2, 0]) for total in (2.0, 2.5)]
    save_regions(layout.clusters(pairs[f"band2-{METHOD}"]), NAMES, regions)
    file = layout.policy(pairs[f"band2-{OURS}"]) / "card.json"
    card = json.loads(file.read_text())
    card["training"] |= {"converged": False, "failed_targets": 2}
    file.write_text(json.dumps(card))
    text = f"{','.join((*COLUMNS, *AIMED))}\n-0.3,-0.2,,1.9,check,1.9,bo\n"
    layout.launches(BAND).write_text(text)
    launches([[0.01, -0.01]] * 3).to_parquet(layout.trials(pairs[f"{DIPS}-{OURS}"]))
    layout.floor("band1").parent.mkdir()
    for band, mean in (("band1", 0.01), ("band2", None)):
        layout.floor(band).write_text(json.dumps({"band": band} | floor(mean)))


def _copy(root: Path, key: str) -> None:
    """Everything of the pair that is there, as of another one."""
    for file in (root / "data").glob(f"*/{PAIR}*"):
        copy = file.with_name(file.name.replace(PAIR, key))
        (shutil.copytree if file.is_dir() else shutil.copy)(file, copy)


def theta(band: str, method: str) -> dict:
    """What a θ file says: ours with confidence, and others with the loss that they minimise."""
    content = {"band": band, "method": method, "theta": THETA, "rollouts": 246}
    if method == OURS:
        content |= {"law": "rubber", "theta": THETA | RUBBER, "confidence": _confidence(band)}
        return content | {"history": {"pull_time": 1.5, "pause": 0.5}}
    loss = {"geom": 0.5, "force": 0.25, "work": 0.5, "total": 1.25, "glow": 0.7}
    loss |= {"work": 0.125, "total": 0.875} if method == "de" else {}
    return content | {"loss": loss, "theta": THETA | {"damping_scale": 0.999}}


def _launch(draw: list[float], landing: float, left: float | None, z: float | None) -> dict:
    values = {"measured": landing, "left": left, "z_without_it": z}
    return {"draw": draw} | {name: {"landing": value} for name, value in values.items()}


def _confidence(band: str) -> dict:
    """Of band1 with all that there is, of band2 in doubt, of BAND as simple as can be."""
    known = confidence()
    known["parameters"] |= {
        "youngs_modulus": {"low": 3.0011e5, "high": 3.0014e5, "identifiable": True},
        "mooney_share": {"low": -0.3, "high": -0.2, "identifiable": True, "prior": [-0.24, 0.84]},
        "relaxation": {"low": 0.02, "high": 0.08, "identifiable": False, "prior": [0.01, 0.19]},
    }
    if band == "band2":
        known["recordings"][0] |= {"pictures": []}
        return known | {"settled": False, "steps": 30}
    if band == BAND:
        return confidence()
    second = known["recordings"][0] | {"source": {"file": "a|b`c*.mcap", "pull": 2}}
    second |= {"pictures": [0.0123, 0.0456], "misfit_without": 3.21}
    evidence = [
        _launch([-0.3, -0.15], 1.9, 0.021, 0.5),
        _launch([-0.3, -0.16], 2.0, None, None),
    ]
    return known | {"recordings": [*known["recordings"], second], "launches": evidence}
