"""A match in PhysX, by an engine whose bands are strings of its law."""

import numpy as np
import pytest

from pipeline.base.errors import UserError
from pipeline.export import usd
from pipeline.export.match import compared, proof_draws
from pipeline.export.mesh import Tube
from pipeline.export.usd import UsdBand, near_draws
from sling2sim2real import export
from tests.validation.engines.physx import strings
from tests.validation.engines.physx.strings import StringEngine
from validation.engines.physx import flight, match

POISSON = 0.47


@pytest.fixture(scope="module")
def band(model) -> UsdBand:
    """Softer than what is wanted by a fifth."""
    return UsdBand(Tube.of(model.sling, usd.EDGES, usd.GRADING), 1.3e5, POISSON, 0.7)


@pytest.fixture(autouse=True)
def of_strings(monkeypatch) -> None:
    monkeypatch.setattr(flight, "force_on", strings.force_on)
    monkeypatch.setattr(flight, "energy", strings.energy)


def held(model, band) -> np.ndarray:
    """Errors of the force at the draws of the match."""
    (draws, _), engine = near_draws(model), StringEngine(band.tube)
    shots = match._launched_singly(engine, model, band, draws)
    return np.array([row.errors["hold_force"] for row in compared(model, draws, shots)])


def test_a_soft_band_is_stiffened_until_it_holds(model, band) -> None:
    fitted = match.fitted(StringEngine(band.tube), model, band)
    before, after = held(model, band), held(model, fitted)
    assert before.mean() < -0.1 and abs(after.mean()) < 0.03
    assert np.abs(after).max() < np.abs(before).max() / 3
    assert fitted.young > 1.1 * band.young and fitted.poisson == band.poisson


def test_modulus_and_mass_change_by_their_logarithms(band) -> None:
    other = match.changed(band, np.log([1.2, 0.8]))
    assert other.young == pytest.approx(1.2 * band.young)
    assert other.tube.mass == pytest.approx(0.8 * band.tube.mass)


def test_the_least_of_a_linear_model_is_found_and_lost_draws_do_not_count() -> None:
    grid = np.array([[x, y] for x in (-0.1, 0, 0.1) for y in (-0.2, 0, 0.2)])
    best = np.array([0.07, -0.12])
    errors = (grid - best) @ np.array([[1.0, 0.0], [2.0, -0.5], [0.3, 0.3]]).T
    assert match._least(grid, errors) == pytest.approx(best)
    lost = np.column_stack([errors, np.full(len(grid), np.nan)])
    assert match._least(grid, lost) == pytest.approx(best)
    with pytest.raises(UserError, match="no draw of the match lands"):
        match._least(grid, np.full((9, 2), np.nan))


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
    engines = []

    class Process(StringEngine):
        def __enter__(self):
            engines.append(self)
            return self

        def __exit__(self, *_) -> None:
            pass

    tube = Tube.of(model.sling, usd.EDGES, usd.GRADING)
    monkeypatch.setattr(match, "Engine", lambda: Process(tube))
    monkeypatch.setattr(match, "release", lambda: "0.7")
    monkeypatch.setattr(match.wp, "is_cuda_available", lambda: True)
    monkeypatch.setattr(usd, "match_of", lambda target: match.matched)
    done = export(model, "usd", tmp_path / "usd")
    card, text = done.card, (done.folder / "toy.usda").read_text()
    assert card["replayed"] and done.met in (True, False) and "0.7" in card["engine"]
    assert text in engines[0].texts  # the very stage was launched
    young = float(text.split("youngsModulus = ")[1].split()[0])
    assert card["matched"][0]["value"] == pytest.approx(young, rel=1e-5)
    proven = {(row["draw_y_m"], row["draw_z_m"]) for row in card["proof"]}
    fitted = {(row["draw_y_m"], row["draw_z_m"]) for row in card["match"]}
    assert len(proven) == len(proof_draws(model)) == 3 and not proven & fitted
    readme = (done.folder / "README.md").read_text()
    assert "Match it before you rely on it" not in readme and "asked" in readme.lower()


def test_what_is_matched_is_what_lands_near_the_targets(model) -> None:
    draws, _ = near_draws(model)
    near, far = model.settings.policy.targets
    landing = model.launches(draws).landing_y
    assert (landing > near / usd.NEAR).all() and (landing < far * usd.NEAR).all()
