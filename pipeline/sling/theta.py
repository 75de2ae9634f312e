"""θ files: the identified parameters of a band as JSON, or the same written by hand.

{"band": "...", "theta": {"youngs_modulus": ..., ... all five}}  and, where a stage wrote it,
"method", "nuisances": {"air_drag": ...}, "loss": {"geom", "force", "work", "total"}, "rollouts",
"confidence"

What its confidence rests on, samples of θ, lies beside in data/confidence/.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from pipeline.base.errors import UserError
from pipeline.base.layout import NotMade, owner
from pipeline.base.schema import Range
from pipeline.params import Parameters
from pipeline.params.identification import NUISANCES
from pipeline.sling.load import load_sling
from pipeline.sling.material import THETA
from pipeline.sling.model import Sling


def _limits(name: str) -> Range:
    """How far params.yaml lets the box of the search reach."""
    box = Parameters.model_fields[name].annotation
    return next(one for one in box.model_fields["low"].metadata if isinstance(one, Range))


LIMITS = {name: _limits(name) for name in THETA}


def load_theta(path: Path, band: str) -> dict:
    """Read and check a θ file. Raises UserError."""
    path = Path(path)
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        if owner(path):
            raise NotMade(path) from error
        raise UserError(
            f"{path}: no such file; `dvc repro` writes those of data/theta/{band}/"
        ) from error
    except (OSError, ValueError, RecursionError) as error:
        raise UserError(f"{path}: cannot be read as JSON ({error})") from error
    if not isinstance(content, dict) or content.get("band") != band:
        raise UserError(f'{path}: must hold an object with "band": "{band}"')
    theta, nuisances = content.get("theta"), content.get("nuisances", {})
    if not isinstance(theta, dict) or set(theta) != set(THETA):
        raise UserError(f'{path}: "theta" must hold exactly {", ".join(THETA)}')
    for name, value in theta.items():
        _expect_number(path, f"theta.{name}", value, LIMITS[name].low, LIMITS[name].high)
    if not isinstance(nuisances, dict) or not set(nuisances) <= set(NUISANCES):
        raise UserError(f'{path}: "nuisances" may hold {", ".join(NUISANCES)}, and nothing else')
    for name, value in nuisances.items():
        _expect_number(path, f"nuisances.{name}", value, *NUISANCES[name])
    return content


def _expect_number(path: Path, key: str, value: object, low: float, high: float) -> None:
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not number or not low <= value <= high:
        raise UserError(
            f"{path}: {key} must be a number between {low:g} and {high:g}, got {repr(value)[:60]}"
        )


def load_samples(path: Path) -> np.ndarray | None:
    """Samples of θ, and of the air's drag if searched, (M, 5) or (M, 6); None where there are none.

    Raises NotMade where the file is damaged.
    """
    if not path.is_file():
        return None
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        if content["samples"] == []:
            return None
        samples = np.array(content["samples"], float)
        known = content["names"] in (list(THETA), [*THETA, "air_drag"])
        if not known or samples.ndim != 2 or samples.shape[1] != len(content["names"]):
            raise ValueError
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise NotMade(path, "damaged") from error
    return samples


def law_discrepancy(content: dict) -> float:
    """Share of a landing by which the law errs, as a θ file says it; 0 where it says nothing."""
    known = content.get("confidence") or {}
    return float(known.get("discrepancy", {}).get("landing", 0.0))


def calibrated(params, band: str, content: dict, root: str | Path = ".") -> Sling:
    """The sling of a band in the air that a θ file's content has identified beside θ."""
    drag = content.get("nuisances", {}).get("air_drag", 0.0)
    return replace(load_sling(params, band, root), air_drag=drag)


def in_air(sling: Sling, points: np.ndarray) -> tuple[Sling, np.ndarray]:
    """A sling and θ (N, 5) of points (N, 5) or (N, 6), whose last column is the air's drag."""
    if points.shape[-1] == len(THETA):
        return sling, points
    return replace(sling, air_drag=points[:, -1]), points[:, :-1]


def vector(content: dict) -> np.ndarray:
    """θ in the simulator's order, physical units, shape (5,)."""
    return np.array([content["theta"][name] for name in THETA], float)
