"""One change at a time of an exported stage: it changes that, and nothing else."""

import difflib

import numpy as np
import pytest

from pipeline.export import usd
from pipeline.export.mesh import Tube
from pipeline.params import load
from tests.project import DEFAULTS
from validation.engines import checks
from validation.engines.physx.causes import VARIANTS
from validation.engines.physx.exported import ExportedBand
from validation.simulator.finding import Bench

PLACE = np.array([0.0, -0.3, -0.15])


@pytest.fixture(scope="module")
def band(tmp_path_factory) -> ExportedBand:
    sling = checks.sling_of(checks.solid(Bench(load(DEFAULTS))))
    path = tmp_path_factory.mktemp("stage") / "band.usda"
    path.write_text(usd.text(Tube.of(sling, usd.EDGES, usd.GRADING), 2.2e5, 0.47, 2e-3, 0.7))
    return ExportedBand.read(path)


@pytest.mark.parametrize("name", [name for name in VARIANTS if name != "exported"])
def test_a_variant_differs_from_the_stage(band, name):
    other = VARIANTS[name](band)
    lines = difflib.unified_diff(band.text.splitlines(), other.text.splitlines(), n=0, lineterm="")
    changed = sum(line.startswith("+") for line in lines) - 1
    jobs = band.job(PLACE), other.job(PLACE)
    same = all(np.array_equal(jobs[0][key], jobs[1][key]) for key in jobs[0])
    if name.startswith(("drawn", "ends led")):
        assert not same
    assert changed <= 1 or "ends led" in name
    assert changed == 1 or not same


def test_led_ends_stay_where_the_clamps_hold_them(band):
    led = VARIANTS["ends led, not attached"](band)
    assert "Attachment" in band.text and "Attachment" not in led.text and "Clamp" not in led.text
    assert led.text.count("{") == led.text.count("}")
    for phase in (0, 1):
        job = led.job(PLACE)
        vertices, targets = job[f"vertices_{phase}"], job[f"targets_{phase}"]
        ends = band.tube.clamped[[0, 1, -2, -1]].reshape(-1, 3)
        assert targets.shape[1] == len(vertices)
        assert targets[-1, -len(ends) :] == pytest.approx(ends)
        assert band.tube.clamped.reshape(-1, 3)[vertices[-len(ends) :]] == pytest.approx(ends)


def test_what_a_variant_says_of_itself_is_in_its_stage(band):
    assert "poissonsRatio = 0.45" in VARIANTS["Poisson's ratio 0.45"](band).text
    fast = VARIANTS["1,000 steps a second"](band)
    assert fast.rate == 1000 and len(fast.job(PLACE)["targets_1"]) == 3000
    assert "solverPositionIterationCount = 256" in VARIANTS["256 iterations"](band).text
    assert VARIANTS["four times the mass"](band).tube.mass.sum() == pytest.approx(
        4 * band.tube.mass.sum()
    )
    straight = VARIANTS["points at rest"](band).text
    points = [line.split(" = ")[1] for line in straight.splitlines() if "points = " in line.lower()]
    assert len(set(points)) == 1 and len(points) == 3
