"""The band `orange`: recorded and launched by an engine that this project did not make."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from pipeline.params import Params
from validation.projects import changed

NAME = "orange"
ABOUT = {"source": "recording", "mass": 0.0408, "diameter": 0.010, "rest_length": 0.52}


def with_orange(params: Params) -> Params:
    """params.yaml with that band, whose hand was where its pose says."""
    recorded = {f"bands.{NAME}": ABOUT, f"rig.bands.{NAME}": None}
    return changed(params, {**recorded, "setup.arm_stiffness": None})


def landings(folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """Draws (N, 2) and measured landings (N,) [m] of orange_landings.csv."""
    table = pd.read_csv(folder / f"{NAME}_landings.csv").to_numpy(float)
    return table[:, :2], table[:, 2]
