"""A match in PhysX, by an engine whose bands are strings of its law."""

from contextlib import nullcontext

import numpy as np
import pytest

from sling2sim2real import Band, Model, Settings, Theta, export
from sling2sim2real.base.errors import UserError
from sling2sim2real.engines.physx import launches, match
from sling2sim2real.exporting import usd
from sling2sim2real.exporting.match import compared, proof_draws
from sling2sim2real.exporting.mesh import Tube
from sling2sim2real.exporting.usd import UsdBand, near_draws, nominal
from sling2sim2real.simulator.cylinder import volumes


@pytest.fixture(scope="module")
def model() -> Model:
    sizes = Band(mass=0.023, diameter=0.010, rest_length=0.52, name="toy")
    return Model(sizes, Theta(1.8e5, 0.47, 2.4e-3, 0.7, 0.6), settings=Settings.coarse())


@pytest.fixture(scope="module")
def band(model) -> UsdBand:
    """Softer than what is wanted by a fifth."""
    return UsdBand(Tube.of(model.sling, usd.EDGES, usd.GRADING), 1.3e5, 0.47, 0.7)


class StringEngine:
    """Takes jobs as `bands.Engine` does, and leaves all nodes but the led ones at rest.

    Attributes:
        tube: Of the bands.
        texts: Of the stages that it was given.
    """

    def __init__(self, tube: Tube) -> None:
        self.tube, self.texts = tube, []

    def run(self, text: str, job: dict, steer) -> dict:
        self.texts.append(text)
        count, hand = len(job["offsets"]), len(self.tube.rest[0])
        targets = job["targets_1"][-1]
        while targets is not None:
            nodes = np.tile(self.tube.rest, (count, 1, 1, 1))
            nodes[:, self.tube.middle] = targets[:, -hand:]
            targets = steer(nodes.reshape(count, -1, 3))
        return {}


def force_on(tube, sections, nodes, young, poisson, step=None) -> np.ndarray:
    """Pull of both halves on middles wherever `nodes` have them, shape (N, 3)."""
    area = volumes(tube.rest, tube.tetrahedra).sum() / np.ptp(tube.rest[..., 0])
    places, length = nodes[:, sections[0]].mean(axis=1), np.ptp(tube.rest[1:-1, 0, 0]) / 2
    tips = tube.clamped[[1, -2], 0]
    away = tips - places[:, None]
    far = np.linalg.norm(away, axis=-1)
    pull = np.array([nominal(np.maximum(row, length) / length, poisson[0]) for row in far])
    return (area * young[:, None, None] * pull[..., None] * away / far[..., None]).sum(axis=1)


def held(model, shots) -> np.ndarray:
    """Errors of the force at the draws of the match."""
    draws, _ = near_draws(model)
    return np.array([row.errors["hold_force"] for row in compared(model, draws, shots)])


def test_a_soft_band_is_stiffened_and_corrected_by_its_own_stage(model, band, monkeypatch) -> None:
    """A band pulls a tenth less where it is the only one of its scene, as in its stage."""

    def weaker_alone(tube, sections, nodes, *rest, **more) -> np.ndarray:
        return (0.9 if len(nodes) == 1 else 1.0) * force_on(tube, sections, nodes, *rest, **more)

    monkeypatch.setattr(launches, "force_on", weaker_alone)
    engine, (draws, _) = StringEngine(band.tube), near_draws(model)
    start = held(model, match._launched_singly(engine, model, band, draws))
    (_, rough), (fitted, shots) = (
        match.fitted(engine, model, band, corrections=count) for count in (0, match.CORRECTIONS)
    )
    assert shots == match._launched_singly(engine, model, fitted, draws)
    assert fitted.young > 1.1 * band.young and fitted.poisson == band.poisson
    rough, left = held(model, rough), held(model, shots)
    assert start.mean() < rough.mean() < -0.08 and abs(left.mean()) < abs(rough.mean()) / 5
    assert np.abs(left).max() < np.abs(rough).max() / 2


def test_the_least_of_a_linear_model_is_found_and_lost_draws_do_not_count() -> None:
    """And what no error tells stays where it was."""
    grid = np.concatenate([side * np.eye(4) for side in (-0.02, 0.0, 0.02)])
    best = np.array([0.07, -0.12, 0.03, 0.01])
    slopes = 1e4 * (np.eye(6, 4) + 0.1)
    errors = (grid - best) @ slopes.T
    assert match._least(*match._linear(grid, errors)) == pytest.approx(best, abs=1e-6)
    lost = np.column_stack([errors, np.full(len(grid), np.nan)])
    assert match._least(*match._linear(grid, lost)) == pytest.approx(best, abs=1e-6)
    with pytest.raises(UserError, match="no draw of the match lands"):
        match._linear(grid, np.full((12, 2), np.nan))
    slopes = np.array([[50.0, 0.0, 0.0, 0.0]])
    assert match._least(np.array([1.0]), slopes) == pytest.approx([-0.02, 0, 0, 0], rel=1e-2)
    assert match._least(np.array([1e3]), slopes)[0] == pytest.approx(-match.FARTHEST_POINT[0])


def test_without_physx_or_a_gpu_there_is_no_match(model, band, monkeypatch) -> None:
    monkeypatch.setattr(match.wp, "is_cuda_available", lambda: False)
    monkeypatch.setattr(match, "release", lambda: "0.7")
    assert match.matched(model, band) is None

    def missing() -> str:
        raise UserError("PhysX is not installed")

    monkeypatch.setattr(match, "release", missing)
    assert match.matched(model, band) is None


def test_an_export_is_matched_where_it_can_be(model, monkeypatch, tmp_path) -> None:
    """Stage and card have what the match came to; the proof's draws took no part in it."""
    engine = StringEngine(Tube.of(model.sling, usd.EDGES, usd.GRADING))
    monkeypatch.setattr(launches, "force_on", force_on)
    monkeypatch.setattr(match, "Engine", lambda: nullcontext(engine))
    monkeypatch.setattr(match, "release", lambda: "0.7")
    monkeypatch.setattr(match.wp, "is_cuda_available", lambda: True)
    done = export(model, "usd", tmp_path / "usd")
    card, text = done.card, (done.folder / "toy.usda").read_text()
    assert card["replayed"] and done.met is card["met"] and "0.7" in card["engine"]
    assert text in engine.texts  # the very stage was launched
    young = float(text.split("youngsModulus = ")[1].split()[0])
    assert card["matched"][0]["value"] == pytest.approx(young, rel=1e-5)
    proven = {(row["draw_y_m"], row["draw_z_m"]) for row in card["proof"]}
    fitted = {(row["draw_y_m"], row["draw_z_m"]) for row in card["match"]}
    assert len(proven) == len(proof_draws(model)) == 3 and not proven & fitted
    readme = (done.folder / "README.md").read_text()
    assert "Match it before you rely on it" not in readme and "asked" in readme.lower()
