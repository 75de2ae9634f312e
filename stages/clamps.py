"""Fit how the band leaves its clamps and how stiff it bends, to the slack part of the recording.

    python -m stages.clamps band1

Reads data/episodes/<band>/<recording>/; writes data/clamps/<band>/<recording>.json.
"""

from __future__ import annotations

from pipeline.layout import Layout
from sling2sim2real.base.files import write_json
from sling2sim2real.base.machine import cores
from sling2sim2real.episode.episode import Episode
from sling2sim2real.identification.clamps import calibrate_clamps
from sling2sim2real.simulator.model import ClampedBand
from stages.start import recording_of_stage, run


def main() -> None:
    params, recording = recording_of_stage()
    layout = Layout()
    sling = ClampedBand.of(params.bands[recording.band], params.setup, params.sling)
    episode = Episode.load(layout.episode(recording))
    clamps = calibrate_clamps(params, sling, episode, workers=cores())
    write_json(layout.clamps(recording), vars(clamps))
    print(
        f"{recording.key}: clamps at {clamps.clamp_angle_deg:.1f} deg, bending"
        f" {clamps.relative_rigidity:.2f} of a solid round band's"
    )


if __name__ == "__main__":
    run(main)
