"""Where a law is not the rubber's: how many landings do the intervals hold, and how wide are they?

One recording that this project did not make, and the virtual rig's bands, each identified with the
budget of params.yaml. Landings are for scoring alone: no interval has seen one.
"""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from app.preflight.add_band import add_band
from pipeline.landing.simulator import simulator
from pipeline.launches.spread import landing_intervals
from pipeline.params import load
from pipeline.rig.physics.launch import launch
from pipeline.sling.theta import law_discrepancy, load_samples, load_theta
from validation.campaigns.test_orange import (
    BAND,
    LANDINGS,
    MASS,
    RECORDING,
    copy_of_the_project,
    run,
)

pytestmark = pytest.mark.validation

METHODS = ("sling2sim2real", "sling2sim2real_taut")
DRAWS = np.array(  # of the rig [m], inside the recorded stretch
    [[-0.27, -0.17], [-0.29, -0.15], [-0.31, -0.13], [-0.33, -0.12], [-0.30, -0.18]]
)
STAGES = ("history", "theta")


def launched(params, band: str) -> tuple[np.ndarray, np.ndarray]:
    """Draws (N, 2) and landings (N,) [m]: of the CSV, or on the rig with errors of actuation."""
    if band == BAND:
        rows = list(csv.DictReader(LANDINGS.open(encoding="utf-8")))
        table = [
            [float(row[f"{key}_m"]) for key in ("draw_y", "draw_z", "landing_y")] for row in rows
        ]
        return np.array(table)[:, :2], np.array(table)[:, 2]
    trials = [launch(band, params, draw, number) for number, draw in enumerate(DRAWS)]
    return DRAWS, np.array([trial.landing_y for trial in trials])


def scored(params, root: Path, band: str, method: str, draws, landing) -> dict:
    """Coverage, width and errors of one method's intervals, as shares of the measured distance."""
    content = load_theta(root / "data/theta" / band / f"{method}.json", band)
    kept = root / "data/confidence" / band / f"{method}.json"
    samples = load_samples(kept)
    launcher, share = simulator(params, band, content, root=root), law_discrepancy(content)
    error = params.trials.actuation_error
    predicted = launcher(draws).landing_y
    entry = {"theta": content["theta"], "nuisances": content["nuisances"]}
    entry |= {key: content["confidence"][key] for key in ("discrepancy", "derived", "moved")}
    for name, part in (("intervals", share), ("without_discrepancy", 0.0)):
        low, high = landing_intervals(launcher, draws, samples, error, part).T
        entry[name] = {
            "covered": int(((low <= landing) & (landing <= high)).sum()),
            "launches": len(landing),
            "mean_width": float(np.mean((high - low) / landing)),
        }
    entry["mean_error"] = float(np.mean(np.abs(predicted / landing - 1)))
    entry["worst_error"] = float(np.max(np.abs(predicted / landing - 1)))
    return entry


@pytest.mark.skipif(not RECORDING.exists(), reason="the recording of the orange band is not there")
def test_intervals_hold_landings_of_a_rubber_with_another_law(
    tmp_path, monkeypatch, progress, record
) -> None:
    project = copy_of_the_project(tmp_path / "project")
    add_band(BAND, RECORDING, MASS, params_path=project / "params.yaml", root=project)
    params = load(project / "params.yaml")
    rig = [band for band, about in params.bands.items() if about.source == "rig"]
    figures = {}
    for band in (BAND, *rig):
        if band in rig:
            run(project, "python", "-m", "stages.record", band)
        for stage in ("episode", "mounting"):
            run(project, "python", "-m", f"stages.{stage}", band)
        monkeypatch.chdir(project)
        draws, landing = launched(params, band)
        figures[band] = {}
        for method in METHODS:
            for stage in STAGES:
                run(project, "python", "-m", f"stages.{stage}", band, method)
            entry = scored(params, project, band, method, draws, landing)
            figures[band][method] = entry
            said = entry["intervals"]
            progress(
                f"  {band} {method}: {said['covered']} of {said['launches']} held, width"
                f" {100 * said['mean_width']:.1f} %, error {100 * entry['mean_error']:.1f} %, worst"
                f" {100 * entry['worst_error']:.1f} %; {json.dumps(entry['discrepancy'])}"
            )
    total = {
        method: {
            name: {
                key: sum(figures[band][method][name][key] for band in figures)
                for key in ("covered", "launches")
            }
            for name in ("intervals", "without_discrepancy")
        }
        for method in METHODS
    }
    share = {
        who: one["intervals"]["covered"] / one["intervals"]["launches"]
        for who, one in total.items()
    }
    record(
        "landings",
        asked="Reported, no limit: how many landings of a recording that this project did not make"
        " and of the virtual rig lie in the 90 % intervals, and how wide those are.",
        met=True,
        settings={
            "methods": METHODS,
            "rig_draws": DRAWS,
            "actuation_error": params.trials.actuation_error,
            "optimizer": params.optimizer.model_dump(),
        },
        figures={"held": share, "total": total, "bands": figures},
    )
