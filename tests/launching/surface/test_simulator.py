"""The calibrated simulator is that of the θ file, its air as well."""

import numpy as np

from pipeline.params import load
from sling2sim2real.identification.results.theta import parameters_of
from sling2sim2real.launching.surface.simulator import simulator
from sling2sim2real.simulator.parameters import THETA
from tests.project import DEFAULTS, with_


def test_the_simulator_launches_in_the_air_of_the_theta_file() -> None:
    """Drag takes speed; that of samples takes the place of the file's, launch by launch."""
    params = with_(load(DEFAULTS), "sling", edges=16, launch_step=1e-3)
    band, draw = next(iter(params.bands)), np.array([[-0.33, -0.15]])
    theta = dict(zip(THETA, (2.5e5, 0.47, 2e-3, 0.8, 0.6), strict=True))
    contents = [{"theta": theta, "nuisances": {"air_drag": drag}} for drag in (0.0, 6.0)]
    still, moving = (simulator(params, band, content, None) for content in contents)
    calm, windy = (launcher(draw).landing_y[0] for launcher in (still, moving))
    assert windy < 0.99 * calm
    samples = parameters_of(contents[0]).changed(air_drag=np.array([0.0, 6.0]))
    both = moving(np.repeat(draw, 2, axis=0), samples).landing_y
    np.testing.assert_allclose(both, [calm, windy], rtol=1e-5)
    alone = moving(draw, samples[1:]).landing_y
    np.testing.assert_allclose(alone, [windy], rtol=1e-5)
