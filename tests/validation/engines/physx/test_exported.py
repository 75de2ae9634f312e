"""An exported stage read back, and held by an engine whose band has a known stress."""

import numpy as np
import pytest

from pipeline.base.errors import UserError
from pipeline.export.replay import Shot
from pipeline.simulator.cylinder import volumes
from sling2sim2real import export
from tests.validation.engines.physx import strings
from tests.validation.engines.physx.strings import StringEngine
from validation.engines.physx import flight, law
from validation.engines.physx.exported import Steps, held, job_of, launched, read, yielded

STRETCH, ACROSS = 1.6, 0.8
DRAWS = np.array([[-0.30, -0.20], [-0.35, -0.15]])


class OneHalfStretched:
    """An engine whose band lies along x, thinner by one ratio, one half of it stretched."""

    def __init__(self, tube) -> None:
        self.tube = tube

    def run(self, text: str, job: dict) -> dict:
        tube = self.tube
        out = tube.rest * [1.0, ACROSS, ACROSS]
        middle = tube.rest[tube.middle, 0, 0]
        out[..., 0] = middle + np.where(out[..., 0] < middle, STRETCH, 1.0) * (out[..., 0] - middle)
        return {"positions_1": out.reshape(1, 1, -1, 3)}


def test_the_stage_is_read_as_it_was_written(model, folder):
    text, band = read(folder)
    card_young = float(text.split("youngsModulus = ")[1].split()[0])
    assert band.young == card_young and band.poisson == 0.47 and band.friction == 0.7
    tube = band.tube
    assert tube.mass.sum() == pytest.approx(0.023 * 0.55 / 0.52, rel=1e-6)  # with what is clamped
    assert volumes(tube.rest, tube.tetrahedra).min() > 0
    assert tube.clamped[[1, -2]].mean(axis=1) == pytest.approx(model.sling.tips, abs=1e-8)


def test_what_is_no_export_is_refused_in_a_line(model, without_physx, tmp_path):
    folder = export(model, "usd", tmp_path / "usd").folder
    stage = folder / "toy.usda"
    stage.write_text(stage.read_text().replace("restShapePoints", "shapePoints"))
    with pytest.raises(UserError, match="has no point3f.. omniphysics:restShapePoints"):
        read(folder)
    with pytest.raises(UserError, match="No such file"):
        read(tmp_path / "none")
    (folder / "nodes.json").write_text('{"hanging_m": [[0, 0, 0]]}')
    stage.write_text(stage.read_text().replace("omniphysics:shape", "omniphysics:restShape"))
    with pytest.raises(UserError, match="nodes.json is of another stage"):
        read(folder)


def test_ends_and_hand_are_led_where_they_belong(folder):
    band = read(folder)[1]
    places = np.array([[0.0, -0.3, -0.15], [0.0, -0.35, -0.1]])
    job = job_of(band, places, np.zeros((2, 3)), Steps(rate=100, times=(0.1, 0.4, 0.2)))
    assert len(job["keep_0"]) == 10 and len(job["keep_1"]) == len(job["targets_1"]) == 60
    last, ends = job["targets_1"][-1], len(band.ends)
    flat = band.tube.clamped.reshape(-1, 3)
    assert last[:, :ends] == pytest.approx(np.tile(flat[band.ends], (2, 1, 1)))
    assert last[:, ends:].mean(axis=1) == pytest.approx(places)
    assert job["start"][0] == pytest.approx(flat)
    assert job["rest"] == pytest.approx(band.tube.rest.reshape(-1, 3))
    assert job["keep_1"].sum() == 1 and job["keep_1"][-1]


def test_the_force_on_the_hand_is_what_the_stretched_half_pulls_more(folder):
    text, band = read(folder)
    tube = band.tube
    force, volume = held(OneHalfStretched(tube), text, band, np.array([0.0, -0.38, 0.0]))
    pulls = [
        law.stress(np.diag([along, ACROSS, ACROSS]), band.young, band.poisson)[0, 0]
        for along in (STRETCH, 1)
    ]
    near = tube.middle + 1
    length = np.ptp(tube.rest[[tube.middle, near], 0, 0])
    section = volumes(tube.rest[tube.middle : near + 1], _of_one_layer(tube)).sum() / length
    assert force == pytest.approx(section * (pulls[0] - pulls[1]), rel=1e-5)
    assert volume == pytest.approx(ACROSS**2 * (STRETCH + 1) / 2, rel=1e-3)


def _of_one_layer(tube) -> np.ndarray:
    """Tetrahedra between the middle section and the next, numbered from the first of their own."""
    count = tube.rest.shape[1]
    first = tube.middle * count
    inside = (tube.tetrahedra >= first) & (tube.tetrahedra < first + 2 * count)
    return tube.tetrahedra[inside.all(axis=1)] - first


def test_bands_that_are_launched_together_land_as_one_by_one(model, folder, monkeypatch):
    monkeypatch.setattr(flight, "force_on", strings.force_on)
    monkeypatch.setattr(flight, "energy", strings.energy)
    text, band = read(folder)
    engine, rest = StringEngine(band.tube), (model.sling, model.launch_setup)
    both = launched(engine, text, band, *rest, DRAWS, youngs=np.array([1.0, 1.2]) * band.young)
    (single,) = launched(engine, text, band, *rest, DRAWS[:1])
    assert isinstance(single, Shot) and both[0] == single
    (other,) = launched(engine, text, band, *rest, DRAWS[1:])
    assert both[1].landing > 1.1 * other.landing > 0
    assert both[1].hold_force == pytest.approx(1.2 * other.hold_force)


def test_an_arm_gives_way_towards_the_fork():
    draws, force = np.array([[-0.4, 0.0], [-0.3, -0.4]]), np.array([12.0, 24.0])
    assert yielded(draws, force, 12_000.0) == pytest.approx(
        np.array([[-0.399, 0.0], [-0.2988, -0.3984]])
    )
    assert yielded(draws, force, None) == pytest.approx(draws)
