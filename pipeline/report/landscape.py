"""The paper's loss over a plane through θ*: what its search finds its way on."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pipeline.params import Params
from pipeline.report.results import Result
from sling2sim2real.episode.episode import Episode
from sling2sim2real.identification.objective.box import SearchBox
from sling2sim2real.identification.objective.evaluate import Evaluator
from sling2sim2real.identification.objective.loss import EpisodeLoss
from sling2sim2real.identification.results.theta import calibrated, parameters_of

AXES = "youngs_modulus", "elasticity_damping"  # two dominant factors, the paper says
SIZE = 17  # rollouts along each axis
AROUND = 0.04  # of the unit cube, about what is shown


@dataclass(frozen=True)
class Landscape:
    """The loss on a grid of the unit cube, all other parameters at θ*.

    Attributes:
        x, y: Places along AXES, shape (SIZE,) each.
        loss: +inf where the simulation fails, shape (SIZE, SIZE), y first.
    """

    x: np.ndarray
    y: np.ndarray
    loss: np.ndarray


def landscape(params: Params, result: Result, episode: Episode, clamps: Path) -> Landscape:
    """Around the regions of a search and where CMA-ES went from them."""
    box = SearchBox.of_method(params, result.method)
    sling = calibrated(params, result.band, result.theta, clamps)
    best = box.unit_of(parameters_of(result.theta))[0]
    x, y = (_span(result, name) for name in AXES)
    grid = np.tile(best, (SIZE * SIZE, 1))
    places = [box.names.index(name) for name in AXES]
    grid[:, places] = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    evaluate = Evaluator(episode, sling, EpisodeLoss.of(params, result.method, episode, sling), box)
    return Landscape(x, y, evaluate(grid).total.reshape(SIZE, SIZE))


def _span(result: Result, name: str) -> np.ndarray:
    refined = result.evaluations.loc[result.evaluations.phase == "cma", f"unit_{name}"]
    axis = result.axes.index(name)
    centres = [region.mu[axis] for region in result.regions]
    low, high = np.quantile(refined, [0.02, 0.98])
    low, high = min([low, *centres]) - AROUND, max([high, *centres]) + AROUND
    return np.linspace(max(low, 0), min(high, 1), SIZE)
