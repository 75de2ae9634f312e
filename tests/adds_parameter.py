"""A parameter more of the law rubber, by one row of the table and one line of the kernel's input.

tests/test_parameters.py runs it in a process of its own: the table is read when modules are.
"""

import json
import sys
from pathlib import Path

import numpy as np

from sling2sim2real.base import parameters
from sling2sim2real.base.parameters import PERCENT, Coordinate, Parameter

NAME = "stiffening"
ROW = Parameter(
    name=NAME,
    label="stiffening by cold",
    symbol="stiffening",
    read=PERCENT,
    reach=(0.0, 0.5),
    box=(0.0, 0.4),
    law="rubber",
    coordinate=Coordinate(0.02, prior=(0.0, 0.1), rectified=True),
)
parameters.TABLE = (*parameters.TABLE, ROW)

from sling2sim2real.api.model import Theta  # noqa: E402
from sling2sim2real.card.values import values  # noqa: E402
from sling2sim2real.identification.objective.box import SearchBox  # noqa: E402
from sling2sim2real.identification.posterior.coordinates import Coordinates  # noqa: E402
from sling2sim2real.identification.results.theta import (  # noqa: E402
    content_of,
    load_theta,
    parameters_of,
)
from sling2sim2real.quantities import QUANTITIES  # noqa: E402
from sling2sim2real.settings import Settings  # noqa: E402
from sling2sim2real.settings.identification import POSTERIOR  # noqa: E402
from sling2sim2real.settings.lab import BandParams  # noqa: E402
from sling2sim2real.simulator import launch, material  # noqa: E402
from sling2sim2real.simulator.model import ClampedBand, LaunchHistory, LaunchSetup  # noqa: E402

original = material.material


def stiffened(band, theta, rigidity=None):
    """The one line: `result["mu"] *= 1 + theta.column("stiffening")`."""
    result = original(band, theta, rigidity)
    result["mu"] *= 1 + theta.column(NAME)
    return result


def main(folder: Path) -> None:
    params, method = Settings.default(), POSTERIOR
    sizes = BandParams(source="rig", mass=0.02, diameter=0.01, rest_length=0.52)
    sling = ClampedBand.of(sizes, params.setup, params.sling, law="rubber")
    box = SearchBox.of_method(params, method)
    assert NAME in box.free and box.high[box.names.index(NAME)] == 0.4
    assert Theta(2e5, 0.47, 2e-3, 0.7, 0.6, **{NAME: 0.1}).content("band")["theta"][NAME] == 0.1
    density = Coordinates.of_method(params, method, sling)
    place = density.names.index(NAME)
    assert density.steps[place] == 0.02 and density.precision[place] == 0.1**-2
    phi = density.quantiles(np.full((1, len(density.names)), 0.5))[0]
    theta = density.parameters(phi[None])
    assert theta.column(NAME)[0] == phi[place] and density.of(theta)[place] == phi[place]

    history = LaunchHistory(4.0, 2.0, 0.4)
    path = folder / "theta.json"
    path.write_text(json.dumps({"band": "band1", **content_of(theta, history)}))
    read = load_theta(path, "band1")
    np.testing.assert_array_equal(parameters_of(read).values, theta.values)
    (shown,) = [value for value in values(read, {}) if value.name == NAME]
    assert (shown.label, shown.unit) == ("stiffening by cold", "%")
    assert QUANTITIES[NAME].heading == "stiffening [%]"

    setup = LaunchSetup.of(params.setup, params.sling, history)
    both = theta.spread(2).changed(**{NAME: np.array([0.0, 0.4])})
    for module in [*sys.modules.values()]:
        if vars(module).get("material") is original:
            module.material = stiffened
    landed = launch(sling, setup, both, np.tile([-0.36, -0.15], (2, 1))).landing_y
    assert landed[1] > 1.1 * landed[0], landed


if __name__ == "__main__":
    main(Path(sys.argv[1]))
