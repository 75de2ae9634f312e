"""Fit how the band leaves its clamps and how stiff it bends, to the slack part of the recording.

    python -m stages.clamps band1

Reads data/episodes/<band>/; writes data/clamps/<band>.json.
"""

from __future__ import annotations

from sling2sim2real.base.files import write_json
from sling2sim2real.base.layout import Layout
from sling2sim2real.base.machine import cores
from sling2sim2real.identification.clamps import calibrate_clamps
from sling2sim2real.identification.objective.session import load_episode
from sling2sim2real.simulator.model import ClampedBand
from stages.start import run, started


def main() -> None:
    params, band = started("band")
    sling = ClampedBand.of(params.bands[band], params.setup, params.sling)
    clamps = calibrate_clamps(params, sling, load_episode(band), workers=cores())
    write_json(Layout().clamps(band), vars(clamps))
    print(
        f"{band}: clamps at {clamps.clamp_angle_deg:.1f} deg, bending"
        f" {clamps.relative_rigidity:.2f} of a solid round band's"
    )


if __name__ == "__main__":
    run(main)
