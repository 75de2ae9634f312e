"""All bands beside each other: flights, landings on the target, the bands under load."""

from __future__ import annotations

import numpy as np

from pipeline.policy.trials import stretch_of
from pipeline.report.replay import LOAD
from pipeline.report.report import Report


def pictures(report: Report) -> str:
    """The chapter; its pictures are those of write.py's `common_figures`."""
    flights = "Flights of the projectile from the pouch to the floor, to scale"
    if "virtual" in set(report.results.trials.kind):
        flights += "; those of the **virtual rig** meet a drag of the air that the predictions lack"
    beyond = _beyond(report)
    return f"""\
## All bands

{flights}.

![flights of every band and method](figures/trajectories.png)

Landings on the target of 1 m × 1 m, seen from above, to scale. Launches go in the plane of the
band: nothing is known across it, so each method has a strip of its own, with rings of its own.

![landings on the target](figures/scatter.png)

Above: each calibrated simulator's band with {LOAD:g} kg at its middle, at rest and to scale, as if
there were no floor. This is simulated; no recording shows it{beyond}. Below: force against draw,
from grasp to release, as recorded and as the calibrated simulators answer the same hand.

![bands under load](figures/loaded.png)
"""


def _beyond(report: Report) -> str:
    """Bands that the load stretches further than their recording did, in words."""
    params, bands = report.params, []
    for band, of_band in report.replays.items():
        length, width = params.bands[band].rest_length, params.setup.fork_width
        lowest = np.array([one.loaded[len(one.loaded) // 2] for one in of_band.values()])
        methods = report.results.methods[band].values()
        recorded = max(one.trials.recorded_stretch.max() for one in methods)
        if np.nanmax(stretch_of(lowest, width, length), initial=0) > recorded:
            bands.append(band)
    return f", and some stretch {' and '.join(bands)} beyond the recording" if bands else ""
