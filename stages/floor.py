"""The actuation floor of a rig band: an oracle policy, launched with the errors of the trials.

    python -m stages.floor band1

Reads params.yaml alone and writes data/floor/<band>.json. A coarse map of launches without errors
says where in the box a target is met, and least sensitively; a root search on the rig ends on it. A
target that is out of reach has no draw, and no launch at it lands. Only the report may
read it.
"""

from __future__ import annotations

import sys

from pipeline.layout import Layout
from rig.oracle.aim import least_sensitive_draw
from rig.oracle.floor import errors_of, trial_numbers
from rig.oracle.world import World
from sling2sim2real.base.errors import UserError
from sling2sim2real.base.files import write_json
from stages.start import arguments, parameters, run


def main() -> None:
    (band,), params = arguments("band"), parameters()
    if band not in params.run.floors:
        raise UserError(f"{band}: not under run.floors in params.yaml")
    targets = params.trials.targets
    with World(band) as world:
        landing_map = world.landing_map(params.setup, params.floor.map_size)
        starts = [least_sensitive_draw(landing_map, target) for target in targets]
        draws = world.hits(targets, starts)
        floor = errors_of(draws, world.landings(draws, trial_numbers(params)), params)
    for target, error in floor["targets"].items():
        if error["mean_error_m"] is None:
            print(
                f"warning: {band}: no launch lands at {target} m, which has no floor; raise"
                " setup.max_force, widen setup.draw_y and setup.draw_z, or move trials.targets",
                file=sys.stderr,
            )
    write_json(Layout().floor(band), {"band": band, **floor})
    error = floor["mean_error_m"]
    mean = "no launch lands" if error is None else f"{100 * error:.2f} cm"
    print(f"{band}: floor {mean}, {floor['failed']} launches failed")


if __name__ == "__main__":
    run(main)
