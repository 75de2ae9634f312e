"""The actuation floor of a rig band: an oracle policy, launched with the errors of the trials.

    python -m stages.floor band1

Reads params.yaml alone and writes data/floor/<band>.json. A coarse map of launches without errors
says where in the box a target is met, and a root search on the rig ends on it. `targets` holds the
least sensitive draws: the floor. `ordinary` holds draws on the line through the middle of the box.
Only the report may read them.
"""

from __future__ import annotations

from pathlib import Path

from pipeline import errors
from pipeline.errors import UserError
from pipeline.files import write_json
from pipeline.oracle.aim import least_sensitive_draw, ordinary_draw
from pipeline.oracle.floor import errors_of, trial_seeds
from pipeline.oracle.world import World
from pipeline.stage import started


def main() -> None:
    params, band = started("band")
    if params.bands[band].source != "rig":
        raise UserError(f"band {band}: was recorded; only a band of the rig has a floor")
    targets, floors = params.trials.targets, []
    with World(band) as world:
        landing_map = world.landing_map(params.setup, params.floor.map_size)
        for find in (least_sensitive_draw, ordinary_draw):
            draws = world.hits(targets, [find(landing_map, target) for target in targets])
            floors.append(errors_of(draws, world.landings(draws, trial_seeds(params)), params))
    least, ordinary = floors
    for target, one in least["targets"].items():
        if one["mean_error_m"] is None:
            raise UserError(f"{band}: no launch at {target} m lands; move trials.targets inwards")
    content = {
        "band": band,
        "kind": "virtual",
        **least,
        "ordinary": ordinary,
        "actuation_error_m": params.trials.actuation_error,
        "release_jitter": params.rig.release_jitter,
        "seed": params.trials.seed,
    }
    write_json(Path("data/floor", f"{band}.json"), content)
    print(f"{band}: floor {100 * least['mean_error_m']:.2f} cm over {least['launches']} launches")


if __name__ == "__main__":
    errors.run(main)
