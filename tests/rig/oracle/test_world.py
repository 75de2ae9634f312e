from pathlib import Path

import numpy as np
import pytest
from ruamel.yaml import YAML

from pipeline.params import load
from rig.oracle.world import World
from rig.physics.launch import launch
from sling2sim2real.launching.surface.aim import NEAR
from tests.project import DEFAULTS

DRAW = np.array([-0.31, -0.16])


@pytest.fixture
def written(tmp_path: Path):
    """Writes a params.yaml of the same world, integrated quickly, with other values in sections."""

    def write(**changes: dict) -> Path:
        yaml, path = YAML(), tmp_path / "params.yaml"
        content = yaml.load(DEFAULTS)
        content["rig"].update({"edges": 24, "tolerance": 1e-4})
        for section, values in changes.items():
            content[section].update(values)
        yaml.dump(content, path)
        return path

    return write


def test_launches_are_those_of_the_rig(written) -> None:
    """The second fails for its force: no landing, and the map gets the reason."""
    path = written(setup={"max_force": 11.0})
    draws, numbers = np.array([DRAW, [-0.40, -0.25]]), np.array([[7, 8], [9, 10]])
    with World("band1", path, workers=1) as world:
        landing, exact = world.landings(draws, numbers), world.exact(draws)
    landings = [launch("band1", load(path), DRAW, int(number)).landing_y for number in numbers[0]]
    assert landing[0].tolist() == landings and np.isnan(landing[1]).all()
    assert exact.landing_y[0] == launch("band1", load(path), DRAW, None).landing_y
    assert exact.failure[0] is None and "more than 11 N" in exact.failure[1]
    assert np.isnan(exact.landing_y[1]) and exact.hold_force[1] > 11.0


@pytest.mark.slow
def test_the_oracle_hits_on_the_rig(written) -> None:
    """Each on the line of its start."""
    targets, starts, path = (1.725, 2.125), [DRAW, [-0.26, -0.20]], written()
    with World("band1", path, workers=1) as world:
        draws = world.hits(targets, starts)
    for target, start, draw in zip(targets, starts, draws, strict=True):
        assert abs(launch("band1", load(path), draw, None).landing_y - target) <= NEAR
        assert np.isclose(draw[1] / draw[0], start[1] / start[0])
