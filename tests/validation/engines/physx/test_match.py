"""A match in PhysX, by an engine whose bands are strings of its law."""

from contextlib import nullcontext

import numpy as np
import pytest

from pipeline.base.errors import UserError
from pipeline.export import usd
from pipeline.export.match import compared, proof_draws
from pipeline.export.mesh import Tube
from pipeline.export.usd import near_draws
from sling2sim2real import export
from tests.validation.engines.physx import strings
from tests.validation.engines.physx.strings import StringEngine
from validation.engines.physx import launches, match


@pytest.fixture(autouse=True)
def of_strings(monkeypatch) -> None:
    monkeypatch.setattr(launches, "force_on", strings.force_on)


def held(model, band) -> np.ndarray:
    """Errors of the force at the draws of the match."""
    (draws, _), engine = near_draws(model), StringEngine(band.tube)
    shots = match._launched_singly(engine, model, band, draws)
    return np.array([row.errors["hold_force"] for row in compared(model, draws, shots)])


def test_a_soft_band_is_stiffened_until_it_holds(model, band) -> None:
    fitted, shots = match.fitted(StringEngine(band.tube), model, band)
    before, after = held(model, band), held(model, fitted)
    assert before.mean() < -0.1 and abs(after.mean()) < 0.03
    assert np.abs(after).max() < np.abs(before).max() / 3
    assert fitted.young > 1.1 * band.young and fitted.poisson == band.poisson
    assert shots == match._launched_singly(
        StringEngine(band.tube), model, fitted, near_draws(model)[0]
    )


def test_what_a_stage_alone_does_otherwise_is_corrected(model, band, monkeypatch) -> None:
    """A band pulls a tenth less where it is the only one of its scene."""

    def force_on(tube, sections, nodes, *rest, **more) -> np.ndarray:
        return (0.9 if len(nodes) == 1 else 1.0) * strings.force_on(
            tube, sections, nodes, *rest, **more
        )

    monkeypatch.setattr(launches, "force_on", force_on)
    rough, corrected = (
        held(model, match.fitted(StringEngine(band.tube), model, band, corrections=count)[0])
        for count in (0, match.CORRECTIONS)
    )
    assert rough.mean() < -0.08 and abs(corrected.mean()) < abs(rough.mean()) / 5
    assert np.abs(corrected).max() < np.abs(rough).max() / 2


def test_each_value_changes_by_its_own(model, band) -> None:
    other = match.changed(model, band, np.append(np.log([1.2, 0.8, 1.05]), 0.01))
    assert other.young == pytest.approx(1.2 * band.young)
    assert other.rest_length == pytest.approx(1.05 * band.rest_length)
    assert other.mass / band.mass == pytest.approx(0.8, rel=5e-3)  # more of it is in the clamps
    assert other.height == pytest.approx(0.01) and band.height == pytest.approx(0, abs=1e-9)
    assert other.tube.clamped[0] == pytest.approx(band.tube.clamped[0] + [0, 0, 0.01])


def test_the_least_of_a_linear_model_is_found_and_lost_draws_do_not_count() -> None:
    grid = np.concatenate([side * np.eye(4) for side in (-0.02, 0.0, 0.02)])
    best = np.array([0.07, -0.12, 0.03, 0.01])
    slopes = 1e4 * (np.eye(6, 4) + 0.1)
    errors = (grid - best) @ slopes.T
    assert match._least(*match._linear(grid, errors)) == pytest.approx(best, abs=1e-6)
    lost = np.column_stack([errors, np.full(len(grid), np.nan)])
    assert match._least(*match._linear(grid, lost)) == pytest.approx(best, abs=1e-6)
    with pytest.raises(UserError, match="no draw of the match lands"):
        match._linear(grid, np.full((12, 2), np.nan))


def test_what_no_error_tells_stays_where_it_was() -> None:
    slopes = np.array([[50.0, 0.0, 0.0, 0.0]])
    assert match._least(np.array([1.0]), slopes) == pytest.approx([-0.02, 0, 0, 0], rel=1e-2)
    assert match._least(np.array([1e3]), slopes)[0] == pytest.approx(-match.FARTHEST[0])


def test_an_arm_gives_way_towards_the_fork() -> None:
    draws, force = np.array([[-0.4, 0.0], [-0.3, -0.4]]), np.array([12.0, 24.0])
    assert match.yielded(draws, force, 12_000.0) == pytest.approx(
        np.array([[-0.399, 0.0], [-0.2988, -0.3984]])
    )
    assert match.yielded(draws, force, None) == pytest.approx(draws)


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

    def begun() -> nullcontext:
        engines.append(StringEngine(Tube.of(model.sling, usd.EDGES, usd.GRADING)))
        return nullcontext(engines[-1])

    monkeypatch.setattr(match, "Engine", begun)
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
