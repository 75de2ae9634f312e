"""A simulator with residuals linear in the even coordinates: its posterior is known."""

from types import SimpleNamespace

import numpy as np

from pipeline.confidence import rounds
from pipeline.confidence.axes import Axes
from pipeline.confidence.posterior import fit
from pipeline.confidence.residuals import Group
from pipeline.confidence.rounds import Tolerances
from pipeline.episode.episode import Episode
from pipeline.objective.space import Space
from pipeline.sling.material import THETA

SPACE = Space(
    names=THETA,
    low=np.array([3e4, 0.3, 1e-4, 0.05, 0.0]),
    high=np.array([1e7, 0.49, 5e-2, 1.0, 1.0]),
    log=np.array([True, False, True, False, False]),
)
TRUTH = np.array([3e5, 0.4, 4e-3, 0.5, 0.5])
COUNT = 400
GRID = np.stack([np.arange(COUNT), np.zeros(COUNT, int)], axis=1)
ONE_GROUP = [Group("force_x", "taut", 0, np.arange(COUNT), GRID)]
SCALE = np.array([0.01, 0.005, 0.05, 0.1, 0.03])  # posterior deviations of independent columns


class Toy:
    """residual = noise - columns (even(θ) - even(truth)) - late columns * times."""

    def __init__(self, seed: int, scale: np.ndarray = SCALE, noise: float = 0.2) -> None:
        """`scale` are the deviations that data give each coordinate; infinite: none."""
        rng = np.random.default_rng(seed)
        basis = np.linalg.qr(rng.normal(size=(COUNT, 7)))[0]
        self.columns = noise * basis[:, :5] / scale
        self.late = noise * basis[:, 5:] / 1e-4
        self.noise = rng.normal(0, noise, COUNT)
        self.axes = Axes(SPACE, TRUTH)
        self.truth = self.axes.even(TRUTH[None])[0]
        self.optimum = self.truth + np.linalg.lstsq(self.columns, self.noise, rcond=None)[0]

    def interact(self, sling, episode, theta):
        now = np.array([episode.release_time, episode.cloud_time[0]])
        return SimpleNamespace(
            even=self.axes.even(theta),
            shift=now - self.times,
            failure=[None] * len(theta),
            center_line=np.zeros((len(theta), 1)),
        )

    def residuals(self, episode, sling, cutoff, reference):
        return ToyResiduals(self)


class ToyResiduals:
    """What Rounds asks of Residuals."""

    size, groups = COUNT, ONE_GROUP

    def __init__(self, toy: Toy) -> None:
        self.toy = toy

    def hold_force(self, vectors: np.ndarray) -> np.ndarray:
        return np.ones(len(vectors))

    def __call__(self, rollouts) -> np.ndarray:
        gap = (rollouts.even - self.toy.truth) @ self.toy.columns.T
        return self.toy.noise - gap - self.toy.late @ rollouts.shift

    def columns(self) -> dict[str, np.ndarray]:
        return {}

    def of_frame(self, number: int) -> np.ndarray:
        return np.zeros(COUNT, bool)


def fitted(
    monkeypatch, toy: Toy, episode: Episode, *, start: np.ndarray = TRUTH, axes=None, **settings
):
    """The posterior of the toy."""
    toy.times = np.array([episode.release_time, episode.cloud_time[0]])
    monkeypatch.setattr(rounds, "interact", toy.interact)
    monkeypatch.setattr(rounds, "Residuals", toy.residuals)
    small = Tolerances(release=1e-7, camera=1e-7)
    return fit(
        episode, None, 35.0, axes or toy.axes, start, tolerances=small, workers=1, **settings
    )
