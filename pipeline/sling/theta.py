"""θ files: the identified parameters of a band as JSON, or the same written by hand.

{"band": "...", "theta": {"youngs_modulus": ..., ... all five}}  and, where a stage wrote it,
"method", "nuisances": {"air_drag": ...}, "loss": {"geom", "force", "work", "total"}, "rollouts",
"confidence"

What its confidence rests on, samples of θ, lies beside in data/confidence/.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import create_model, model_validator

from pipeline.base.errors import UserError
from pipeline.base.layout import NotMade, owner
from pipeline.base.schema import JsonRecord, Range, Section, read_json, refusal
from pipeline.params import Parameters
from pipeline.params.identification import NUISANCES
from pipeline.sling.load import load_sling
from pipeline.sling.material import THETA
from pipeline.sling.model import Sling


def _limits(name: str) -> Range:
    """How far params.yaml lets the box of the search reach."""
    box = Parameters.model_fields[name].annotation
    return next(one for one in box.model_fields["low"].metadata if isinstance(one, Range))


Theta = create_model(
    "Theta", __base__=Section, **{name: (Annotated[float, _limits(name)], ...) for name in THETA}
)
Nuisances = create_model(
    "Nuisances",
    __base__=Section,
    **{name: (Annotated[float, Range(*ends)], None) for name, ends in NUISANCES.items()},
)


class Discrepancy(JsonRecord):
    landing: float  # share of a landing by which the law errs


class Confidence(JsonRecord):
    discrepancy: Discrepancy | None = None


class ThetaFile(JsonRecord):
    band: str
    theta: Theta
    nuisances: Nuisances = Nuisances()
    confidence: Confidence | None = None


class PosteriorFile(JsonRecord):
    """What a θ file's confidence rests on; no samples where it has none."""

    names: list[str] = []
    samples: list[list[float]]

    @model_validator(mode="after")
    def _a_column_each(self) -> PosteriorFile:
        known = self.names in (list(THETA), [*THETA, "air_drag"])
        if self.samples and not (known and {*map(len, self.samples)} == {len(self.names)}):
            raise refusal("samples: must have a column for each of `names`, which are those of θ")
        return self


def load_theta(path: Path, band: str) -> dict:
    """Read and check a θ file. Raises UserError."""
    path = Path(path)
    if not (path.exists() or owner(path)):
        raise UserError(f"{path}: no such file; `dvc repro` writes those of data/theta/{band}/")
    content = read_json(path, ThetaFile)
    if content.band != band:
        raise NotMade(path, f'band: must be "{band}", got "{content.band[:60]}"')
    return content.model_dump(exclude_unset=True)


def load_samples(path: Path) -> np.ndarray | None:
    """Samples of θ, and of the air's drag if searched, (M, 5) or (M, 6); None where there are none.

    Raises NotMade where the file is damaged.
    """
    samples = read_json(path, PosteriorFile).samples if path.is_file() else []
    return np.array(samples, float) if samples else None


def law_discrepancy(content: dict) -> float:
    """Share of a landing by which the law errs, as a θ file says it; 0 where it says nothing."""
    known = (content.get("confidence") or {}).get("discrepancy") or {}
    return float(known.get("landing", 0.0))


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
