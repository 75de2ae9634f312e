"""An exported stage read back, and held by an engine whose band has a known stress."""

import numpy as np
import pytest

from pipeline.base.errors import UserError
from pipeline.export import usd
from pipeline.export.mesh import Tube
from pipeline.params import load
from pipeline.simulator.cylinder import volumes
from pipeline.simulator.model import GRAVITY
from tests.project import DEFAULTS
from validation.engines import checks
from validation.engines.physx import law
from validation.engines.physx.exported import LIMIT, SLIP, ExportedBand, compared, met, yielded
from validation.simulator.finding import Bench

YOUNG, POISSON = 2.2e5, 0.45
STRETCH, ACROSS = 1.6, 0.8


@pytest.fixture(scope="module")
def tube():
    sling = checks.sling_of(checks.solid(Bench(load(DEFAULTS))))
    return Tube.of(sling, usd.EDGES, usd.GRADING)


@pytest.fixture
def stage(tube, tmp_path):
    path = tmp_path / "band.usda"
    path.write_text(usd.text(tube, YOUNG, POISSON, 2e-3, 0.7))
    return path


class OneHalfStretched:
    """An engine whose band lies along x, thinner by one ratio, one half of it stretched."""

    def __init__(self, tube, slip: float = 0.0) -> None:
        self.tube, self.slip = tube, slip

    def run(self, text: str, job: dict) -> dict:
        tube = self.tube
        out = tube.rest * [1.0, ACROSS, ACROSS]
        middle = tube.rest[tube.middle, 0, 0]
        out[..., 0] = middle + np.where(out[..., 0] < middle, STRETCH, 1.0) * (out[..., 0] - middle)
        ends = [0, 1, -2, -1]
        out[ends] = tube.clamped[ends] + [0.0, 0.0, self.slip]
        return {"positions_1": out.reshape(1, 1, -1, 3)}


def test_the_stage_is_read_as_it_was_written(tube, stage):
    band = ExportedBand.read(stage)
    assert (band.young, band.poisson, band.rate) == (YOUNG, POISSON, usd.RATE)
    assert band.tube.rest == pytest.approx(tube.rest, abs=1e-8)
    assert band.tube.clamped == pytest.approx(tube.clamped, abs=1e-8)
    assert (band.tube.tetrahedra == tube.tetrahedra).all() and band.tube.middle == tube.middle
    assert band.tube.mass == pytest.approx(tube.mass, rel=1e-6)


def test_what_is_no_export_is_refused_in_a_line(stage, tmp_path):
    stage.write_text(stage.read_text().replace("restShapePoints", "shape"))
    with pytest.raises(UserError, match="has no point3f.. omniphysics:restShapePoints"):
        ExportedBand.read(stage)
    with pytest.raises(UserError, match="No such file"):
        ExportedBand.read(tmp_path / "none.usda")


def test_the_force_on_the_hand_is_what_the_stretched_half_pulls_more(tube, stage):
    force, gone = ExportedBand.read(stage).held(OneHalfStretched(tube), np.array([0.0, -0.38, 0.0]))
    pulls = [
        law.stress(np.diag([along, ACROSS, ACROSS]), YOUNG, POISSON)[0, 0] for along in (STRETCH, 1)
    ]
    near = tube.middle + 1
    length = np.ptp(tube.rest[[tube.middle, near], 0, 0])
    section = volumes(tube.rest[tube.middle : near + 1], _of_one_layer(tube)).sum() / length
    weight = tube.mass.reshape(tube.rest.shape[:2])[tube.middle].sum() * GRAVITY
    assert force == pytest.approx(np.hypot(section * (pulls[0] - pulls[1]), weight), rel=1e-5)
    assert gone == pytest.approx(0, abs=1e-9)


def _of_one_layer(tube) -> np.ndarray:
    """Tetrahedra between the middle section and the next, numbered from the first of their own."""
    count = tube.rest.shape[1]
    first = tube.middle * count
    inside = (tube.tetrahedra >= first) & (tube.tetrahedra < first + 2 * count)
    return tube.tetrahedra[inside.all(axis=1)] - first


def test_limits_count(tube, stage):
    band = ExportedBand.read(stage)
    draw = [-0.38, 0.0]
    force, _ = band.held(OneHalfStretched(tube), np.array([0.0, *draw]))

    def rows(share: float, slip: float = 0.0) -> list[dict]:
        launches = [{"draw_m": draw, "hold_force_n": force * share}]
        return compared(band, launches, None, OneHalfStretched(tube, slip))

    assert met(rows(1.0)) and met(rows(1 - 0.9 * LIMIT))
    assert not met(rows(1 - 1.2 * LIMIT)) and not met(rows(1.0, 2 * SLIP)) and not met([])


def test_an_arm_gives_way_towards_the_fork():
    assert yielded(np.array([-0.4, 0.0]), 12.0, 12_000.0) == pytest.approx([0.0, -0.399, 0.0])
    assert yielded(np.array([-0.3, -0.2]), 12.0, None) == pytest.approx([0.0, -0.3, -0.2])
