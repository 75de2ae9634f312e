"""All bands beside each other: flights, landings on the target, the bands under load."""

from __future__ import annotations

import numpy as np

from pipeline.drawing.replay import LOAD
from pipeline.launches.stretch import stretch_of
from pipeline.report.figures import episode, launches
from pipeline.report.report import Report, side_by_side


def pictures(report: Report) -> str:
    results, styles, setup = report.results, report.styles, report.params.setup
    methods = side_by_side(report.params)
    drawing = launches.trajectories, results, methods, styles, setup.fork_height
    trajectories = report.picture("trajectories", "flights of every band and method", *drawing)
    drawing = launches.scatter, results, methods, styles
    scatter = report.picture("scatter", "landings on the target", *drawing)
    shown = {band: {m: of_band[m] for m in methods} for band, of_band in report.replays.items()}
    drawing = episode.loaded, results.episodes, shown, styles, setup.fork_width, setup.fork_height
    under_load = report.picture("loaded", "bands under load", *drawing)
    flights = "Flights of the projectile from the pouch to the floor, to scale"
    kinds = set(results.trials.kind)
    marks = "rings of its own" + "; measured landings are hollow" * ("measured" in kinds)
    if "virtual" in kinds:
        flights += "; those of the **virtual rig** meet a drag of the air that the predictions lack"
    beyond = _beyond(report)
    return f"""\
## All bands

{flights}.

{trajectories}
Landings on the target of 1 m × 1 m, seen from above, to scale. Launches go in the plane of the
band: nothing is known across it, so each method has a strip of its own, with {marks}.

{scatter}
Above: each calibrated simulator's band with {LOAD:g} kg at its middle, at rest and to scale, as if
there were no floor. This is simulated; no recording shows it{beyond}. Below: force against draw,
from grasp to release, as recorded and as the calibrated simulators answer the same hand.

{under_load}"""


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
