"""One change at a time of an exported stage: it changes that, and nothing else."""

import difflib

import numpy as np
import pytest

from validation.engines.physx.causes import VARIANTS, Variant, measured
from validation.engines.physx.exported import job_of, read

PLACES = np.array([[0.0, -0.3, -0.15]])


@pytest.fixture(scope="module")
def stage(folder) -> Variant:
    return Variant(*read(folder))


@pytest.mark.parametrize("name", [name for name in VARIANTS if name != "exported"])
def test_a_variant_differs_from_the_stage_in_what_it_says(stage, name):
    other = VARIANTS[name](stage)
    lines = difflib.unified_diff(stage.text.splitlines(), other.text.splitlines(), n=0, lineterm="")
    changed = sum(line.startswith("+") for line in lines) - 1
    jobs = [
        job_of(variant.band, PLACES, np.zeros((1, 3)), variant.steps)["targets_1"]
        for variant in (stage, other)
    ]
    same = np.array_equal(*jobs)
    if name.startswith("drawn"):
        assert not same and other.text == stage.text
    elif "attached" in name:
        assert "OmniPhysicsVtxXformAttachment" in other.text and same
    else:
        assert changed == 1 + (name.count(",") if not name[0].isdigit() else 0)
    assert other.text.count("{") == other.text.count("}")
    assert other.bent == name.startswith("opened bent")


def test_what_a_variant_says_of_itself_is_in_its_stage(stage):
    assert "poissonsRatio = 0.3\n" in VARIANTS["Poisson's ratio 0.30"](stage).text
    fast = VARIANTS["1,000 steps a second"](stage)
    assert fast.steps.rate == 1000 and "timeStepsPerSecond = 1000" in fast.text
    assert "solverPositionIterationCount = 256" in VARIANTS["256 iterations"](stage).text
    assert "elasticityDamping = 0.002" in VARIANTS["damping 2 ms"](stage).text
    bent = VARIANTS["opened bent"](stage).text
    points = [line.split(" = ")[1] for line in bent.splitlines() if "points = " in line.lower()]
    assert len(points) == 3 and len(set(points)) == 2


def test_a_row_has_force_and_volume_beside_ours(stage):
    class Halved:
        """What it holds is the band as it opens, half as thick across."""

        def run(self, text: str, job: dict) -> dict:
            assert job["rest"] == pytest.approx(stage.band.tube.clamped.reshape(-1, 3))
            half = stage.band.tube.rest * [1.0, np.sqrt(0.5), np.sqrt(0.5)]
            return {"positions_1": half.reshape(1, 1, -1, 3)}

    launch = {"draw_m": [-0.3, -0.15], "hold_force_n": 8.0}
    (row,) = measured(Halved(), VARIANTS["opened bent"](stage), [launch], None)
    assert row["volume_left"] == pytest.approx(0.5) and row["hold_force_n"] == 8.0
    assert row["hold_force_error"] == pytest.approx(row["hold_force_there_n"] / 8.0 - 1)
